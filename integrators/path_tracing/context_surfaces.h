#pragma once
/// @file integrators/path_tracing/context_surfaces.h
/// The other surfaces in a picture of paths: the volume's edges, obstacles, the plate, a slice, isosurfaces.

#include <filesystem>
#include <optional>
#include <vector>

#include "base/process/progress.h"
#include "integrators/path_tracing/load_paths.h"
#include "renderer/materials/material.h"
#include "renderer/surfaces/surface.h"

namespace tensorray {

class Job;

/// Makes a material from its description, for the bands of the light that shows the paths.
/// @throw std::invalid_argument if a metal is unknown.
Material load_material(const MaterialDescription& description, const ShownLight& light);

/// A mesh as a surface that is shaded with its normals.
/// @param smooth_angle  As of ObjectDescription. @throw as read_mesh.
ShadedSurface read_mesh_surface(const std::filesystem::path& file, std::optional<double> smooth_angle = {});

/// Adds the scene's context to `surfaces`, and the materials that it needs to `materials`.
/// @param job  Whose ranks make the light on the plate together, and which keeps it; null: alone.
/// @throw SceneError if a slice or an isosurface is empty; Cancelled (light is traced for the plate); as
/// Ranks::all_gather.
void add_context(const Scene& scene, const PathScene& paths, Job* job, const Progress& progress,
                 std::vector<ShadedSurface>& surfaces, std::vector<Material>& materials);

}  // namespace tensorray
