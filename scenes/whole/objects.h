#pragma once
/// @file scenes/whole/objects.h
/// The surfaces of a whole scene.

#include <memory>
#include <optional>
#include <vector>

#include "renderer/materials/material.h"
#include "renderer/surfaces/surface.h"
#include "scenes/path_tracing/load_paths.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// A plate or a mesh.
struct SceneObject {
  std::optional<Plate> plate;  ///< If it is flat.
  TriangleMesh mesh;
  std::shared_ptr<const SurfaceTexture> texture;
  MaterialDescription material;
};

/// The objects of the scene (without any, a checkerboard as floor below the volume), then its obstacles.
/// @throw std::runtime_error naming the file that cannot be read.
std::vector<SceneObject> load_objects(const Scene& scene, const ShownLight& light);

/// Adds their surfaces and materials.
void add_objects(const std::vector<SceneObject>& objects, const ShownLight& light, std::vector<ShadedSurface>& surfaces,
                 std::vector<Material>& materials);

}  // namespace tensorray
