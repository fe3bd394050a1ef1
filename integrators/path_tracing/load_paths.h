#pragma once
/// What path tracing needs in addition to the field: the rays to follow, and the light that shows their paths.

#include <vector>

#include "base/process/progress.h"
#include "integrators/path_tracing/path_tracing_method.h"
#include "renderer/lights/lights.h"
#include "renderer/spectra/reflectance.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tracing/paths/paths.h"

namespace tensorray {

/// The bands of the light that shows the paths, and the conversion of colours to and from them.
struct ShownLight {
  std::vector<Band> bands;
  Eigen::Matrix3d xyz_to_working;     ///< The white of the light becomes neutral.
  Eigen::Matrix3d rec709_to_working;  ///< For the colours that scene files give.
  ReflectanceModel model;

  /// The spectrum of a colour of linear Rec. 709, times a factor; one value for each band.
  std::vector<float> radiance(const Eigen::Vector3d& rec709, double factor) const;

  /// The luminance of each band.
  std::vector<float> luminances() const;
};

/// The lights that need loaded data.
struct ShownLights {
  ShownLight light;
  std::vector<EnvironmentLight> environments;  ///< The environments among the scene's lights, in their order.
};

/// @param bands  Number of bands. @param notes  Gets warnings.
/// @throw std::runtime_error naming the file that cannot be read.
ShownLights load_lights(const Scene& scene, int bands, std::vector<std::string>& notes);

/// A picture file, and which of its layers counts; empty: any.
struct PictureFile {
  std::filesystem::path path;
  std::string layer;
};

/// Reads a picture and converts it to linear Rec. 709. @param notes  Gets warnings. @throw std::runtime_error.
Image load_rec709(const PictureFile& file, const ColorManagement& color, const Eigen::Matrix3d& to_rec709,
                  std::vector<std::string>& notes);

struct PathScene {
  PathTracingDescription settings;
  std::vector<PathSeed> seeds;
  std::vector<Path> paths;  ///< Paths that were read from a file; there are no seeds then.
  ShownLights lights;
};

/// @throw std::runtime_error naming a file that cannot be read; SceneError if a value does not fit the loaded data.
PathScene load_paths(const Scene& scene, const PathTracingDescription& settings, std::vector<std::string>& notes);

/// Follows the rays, counts them by channel and end, and leaves out those that do not meet the volume.
/// @param tensors  Whether the points of paths need the tensor (PathSettings).
/// @param job  Whose ranks trace them together, and all have them; null: this process is alone.
/// @throw std::runtime_error if no path is left; Cancelled; as Ranks::all_gather.
std::vector<Path> follow_paths(const Scene& scene, const PathScene& paths, bool tensors, Job* job,
                               const Progress& progress, Statistics& statistics);

}  // namespace tensorray
