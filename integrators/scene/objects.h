#pragma once
/// @file integrators/scene/objects.h
/// The surfaces of the method "scene".

#include <memory>
#include <optional>
#include <vector>

#include "base/process/progress.h"
#include "integrators/path_tracing/load_paths.h"
#include "renderer/lights/lights.h"
#include "renderer/materials/material.h"
#include "renderer/surfaces/surface.h"
#include "renderer/surfaces/surface_scene.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// A plate, a mesh, or paths of light.
struct SceneObject {
  std::optional<Plate> plate;  ///< If it is flat.
  ShadedSurface surface;       ///< A mesh.
  MaterialDescription material;
  std::optional<PathScene> paths;  ///< If its mesh are tubes about paths: `surface` is empty until these are followed.

  const TriangleMesh& mesh() const { return std::get<TriangleMesh>(surface.shape); }
};

/// Lights, and what they light.
struct LitObjects {
  const Scene& scene;
  const std::vector<Light>& lights;
  const std::vector<SceneObject>& objects;
  const SurfaceScene& surfaces;  ///< All surfaces, of which that of object i has the index i, and lamps are the last.
  Job* job = nullptr;            ///< Whose ranks trace the light together, and all have it; null: alone.
};

/// The objects of the scene (without any, a checkerboard as floor below the volume), then its obstacles.
/// @throw std::runtime_error naming the file that cannot be read; SceneError if seeds of paths are wrong.
std::vector<SceneObject> load_objects(const Scene& scene, const PathTracingDescription& tracing,
                                      const ShownLights& lights, std::vector<std::string>& notes);

/// Follows the paths of objects that consist of paths, and makes their tubes.
/// @param tolerance  Greatest distance of triangles from the tubes, world units.
/// @throw SceneError if no path meets the volume; Cancelled.
void make_tubes(const Scene& scene, double tolerance, Job* job, const Progress& progress,
                std::vector<SceneObject>& objects);

/// Adds their surfaces and materials.
void add_objects(const std::vector<SceneObject>& objects, const ShownLight& light, std::vector<ShadedSurface>& surfaces,
                 std::vector<Material>& materials);

}  // namespace tensorray
