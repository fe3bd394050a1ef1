#pragma once
/// What all pictures of surfaces share: camera, lights, visible lamps, settings of the path tracer, and channels.

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "base/process/progress.h"
#include "integrators/path_tracing/load_paths.h"
#include "integrators/path_tracing/path_colors.h"
#include "integrators/path_tracing/path_tracing_method.h"
#include "renderer/camera/camera.h"
#include "renderer/camera/path_tracer.h"
#include "renderer/images/image.h"
#include "renderer/lights/lights.h"
#include "renderer/materials/material.h"
#include "renderer/surfaces/surface.h"
#include "scenes/description/description.h"
#include "scenes/description/method.h"
#include "scenes/scene/render.h"

namespace tensorray {

/// The camera of the scene; if it has no position, a camera that shows all of `points`.
/// @param free  Pixels that such a camera leaves free at the right.
/// @throw SceneError naming the values that do not fit together.
Camera make_camera(const SceneDescription& scene, const std::vector<Eigen::Vector3d>& points, int free);

/// The lights of the scene; if it has none, a white sky and a lamp at the viewer's upper left.
std::vector<Light> make_lights(const SceneDescription& description, const ShownLights& shown, const Camera& camera);

PathTracerSettings tracer_settings(const SceneDescription& scene, const PathTracingDescription& description);

/// The channels of pictures of surfaces. @param bends  Whether light bends in them.
std::vector<std::string> surface_channels(const SceneDescription& scene, bool bends);

/// Sets the groups of the scene's lights.
void set_groups(const SceneDescription& scene, ShadedScene& shaded);

/// Sets the picture, with all channels that it has, and the spectral one if the scene asks for it.
void set_picture(const SurfacePicture& picture, const ShownLight& light, const PathTracingDescription& description,
                 const SceneDescription& scene, Render& render);

/// @param so_far  What there is without a picture; must outlive the result. @param add_picture  Adds one to show.
RenderCallbacks render_callbacks(const Progress& progress, RenderJob* job, const Render& so_far,
                                 const std::function<void(const SurfacePicture&, Render&)>& add_picture);

/// Adds the area lights as surfaces, so that they are visible.
void add_lamps(const std::vector<Light>& lights, const ShownLight& light, std::vector<ShadedSurface>& surfaces,
               std::vector<Material>& materials);

class Job;

/// Makes a material from its description, for the bands of the light that shows the paths.
/// @throw std::invalid_argument if a metal is unknown.
Material load_material(const MaterialDescription& description, const ShownLight& light);

/// A mesh of the scene as a surface that is shaded with its normals.
/// @param smooth_angle  As of ObjectDescription. @throw as read_mesh.
ShadedSurface read_mesh_surface(const SceneDescription& scene, const std::filesystem::path& file,
                                std::optional<double> smooth_angle = {});

/// Adds the scene's context to `surfaces`, and the materials that it needs to `materials`.
/// @param legends  Gets that of the slice.
/// @param job  Whose ranks make the light on the plate together, and which keeps it; null: alone.
/// @throw SceneError if a slice or an isosurface is empty; Cancelled (light is traced for the plate); as
/// Ranks::all_gather.
void add_context(const Scene& scene, const PathScene& paths, Job* job, const Progress& progress,
                 std::vector<ShadedSurface>& surfaces, std::vector<Material>& materials,
                 std::vector<SurfaceLegend>& legends);

}  // namespace tensorray
