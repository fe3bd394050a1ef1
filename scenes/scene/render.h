#pragma once
/// The result of rendering a scene, ready to be written.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/process/job.h"
#include "renderer/charts/annotations.h"
#include "renderer/film/film.h"
#include "renderer/film/spectral_image.h"
#include "renderer/images/image.h"
#include "renderer/light_maps/photon_map.h"
#include "renderer/surfaces/plate.h"
#include "tracing/bending/bending.h"
#include "tracing/paths/paths.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

struct Progress;
struct Scene;

/// The work of the method "scene".
struct SceneMethodStatistics {
  std::uint64_t samples = 0;          ///< Of all pixels.
  std::vector<PhotonCounts> photons;  ///< Of each pass, by their end.
};

struct Statistics {
  std::uint64_t positions = 0;         ///< Positions from which light was emitted.
  std::vector<std::uint64_t> emitted;  ///< Numbers of rays by channel, counted where they start, ...
  std::vector<EndCounts> ends;         ///< ... and by channel and end, counted there.
  /// Power of one ray of each channel, for a beam of irradiance 1; empty if rays carry no power.
  std::vector<double> channel_power;
  /// Power by channel and end, for a beam of irradiance 1, if rays of a channel differ in power; and the whole beam's.
  std::vector<std::array<double, ray_end_count>> power;
  double beam_power = 0;
  std::optional<SceneMethodStatistics> scene_method;  ///< Its `ends` are those of all rays that bend.
  std::optional<double> error;  ///< Estimated relative error of the picture, if the scene bounds it.
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  double seconds_tracing = 0, seconds_density = 0, seconds_drawing = 0, seconds_color = 0;
};

/// Whether no ray of any channel ended on the plate (lens: on the image), so that the picture shows nothing.
bool nothing_arrived(const Statistics& statistics);

/// How the pixels of a picture lie in the world.
struct PictureView {
  Eigen::Vector3d right, up;  ///< Unit; along x of the picture, and against its y.
  double pixel_size;          ///< Of all pixels along x, world units; in perspective, where the camera is focused.
  std::optional<Plate> plate = {};  ///< That has the pixels, in the program's axes; none: of a camera.
  bool is_perspective = false;
};

struct Render {
  /// R, G, B in the scene-linear working space (1 is the undisturbed light, or the image's white), then A (colours are
  /// multiplied by it) and other channels, if the method has them.
  Image linear;
  std::optional<Image> display;           ///< The picture as a display shows it; none: it is computed from `linear`.
  std::optional<SpectralImage> spectral;  ///< Set if the scene asks for it.
  std::vector<PlatePhoton> photons;       ///< Filled if the scene asks for it.
  std::vector<ScalarGrid> grids;          ///< Volumes that the method computes, if the scene asks for them.
  std::vector<Path> paths;                ///< Paths of the method path_tracing.
  std::optional<double> exposure;         ///< Stops that keep the picture's colours; none: chosen by its brightness.
  ImageMetadata metadata;                 ///< Entries of the method for the headers of its files.
  /// Writes the tubes about `paths`; empty unless the scene asks for them.
  std::function<void(const std::filesystem::path&, const std::vector<Path>& paths)> write_tubes;
  std::vector<OutlineStroke> outline;  ///< Lines of bodies, in pixels of the picture, if annotations want them.
  std::optional<PictureView> view;     ///< Of `linear`; none: there is no picture.
  /// Draws a legend at the right of a scene-linear picture whose exposure is so many stops (of `display`: over it);
  /// empty: no legend.
  std::function<void(Image&, double exposure)> draw_legend;
  int legend_room = 0;      ///< Pixels of the picture at the right that are the legend's; 0: it is beside the picture.
  std::string legend_note;  ///< A line below; may be empty.
  /// Whether a pixel of `linear` is hatched, as far as it is transparent; empty: none is.
  std::function<bool(const float* pixel)> is_hatched;
  Statistics statistics;
  std::vector<std::string> notes;     ///< What the picture shows, for the user; one line each.
  std::vector<std::string> warnings;  ///< Problems that the picture does not show by itself; one line each.

  /// Values of a pixel of `linear` that its channels do not show as they are, with their names; may be empty.
  std::function<std::vector<std::pair<std::string, std::string>>(const float* pixel)> describe_pixel;
};

/// Adds the steps and samples of the other ranks, at the root. @throw as Ranks::gather.
void gather_counts(Ranks* ranks, Statistics& statistics);

/// A render whose work is kept, and may be divided. Where Progress is cancelled while tiles are rendered, the work
/// stops, and the result is what there is.
struct RenderJob : Job {
  using Job::Job;

  /// Gets what there is so far when a picture is wanted; may be empty.
  std::function<void(Render)> show;

  /// Whether it is wanted now, and is not any more then. Only the root asks.
  bool takes_picture_request() { return show && is_root(ranks) && picture_wanted.exchange(false); }
};

/// Renders the scene with its method. @param job  Null: nothing is kept. Of ranks, only the root has the result; a
/// shard has none: what it makes is in the job.
/// @throw Cancelled; std::runtime_error; SceneError.
Render render(const Scene& scene, const Progress& progress, RenderJob* job = nullptr);

}  // namespace tensorray
