#pragma once
/// @file integrators/path_tracing/path_tracing_description.h
/// The keys of `integrator` that path tracing has.
/// Lengths are in world units, angles in degrees.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "renderer/camera/pixel_filter.h"
#include "renderer/charts/colormap.h"
#include "renderer/shading/shading.h"
#include "renderer/surfaces/tube_mesh.h"
#include "scenes/description/material_description.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {

enum class SeedKind { grid, poisson_disk, line, sphere, threshold, file };

struct SeedDescription {
  SeedKind kind = SeedKind::grid;
  std::uint64_t count = 400;                ///< Approximate number of seeds; `file` has its own number.
  std::optional<Eigen::Vector3d> from, to;  ///< line: its ends; none: across the middle of the volume.
  std::optional<Eigen::Vector3d> center;    ///< sphere: its middle; none: the middle of the volume.
  std::optional<double> radius;             ///< sphere: its radius; none: a quarter of the volume's shortest side.
  Invariant invariant = Invariant::norm;    ///< threshold: seeds are where this has a value in the range.
  std::optional<double> above, below;       ///< threshold: least and greatest value; none: no limit.
  std::filesystem::path file;               ///< file: text with a point in each line.
};

enum class PathStyle { tube, wire, ellipses, lines };

struct RadiusDescription {
  std::optional<double> scale;     ///< World units per unit of T; none: the median semi-axis becomes `typical`.
  std::optional<double> typical;   ///< Median semi-axis; none: by the number of paths. For lines, their radius.
  std::optional<double> min, max;  ///< Limits of semi-axes; none: a fifth of `typical`, and three times it.
};

enum class PathColor { force, transverse_force, curvature, length, wavelength, direction, invariant, none };

struct PathColorDescription {
  PathColor by = PathColor::force;
  Invariant invariant = Invariant::norm;  ///< `by` invariant: the invariant that is shown.
  Colormap map = Colormap::viridis;
  std::optional<Eigen::Vector2d> range;  ///< Values at the ends of the map; none: the 1st and 99th percentiles.
  bool logarithmic = false;
  bool legend = false;  ///< Whether a colour bar is drawn into the display-referred picture.
};

struct SliceDescription {
  Eigen::Vector3d normal{0, 1, 0};        ///< Not zero.
  std::optional<Eigen::Vector3d> center;  ///< None: the middle of the volume.
  Invariant invariant = Invariant::norm;
  Colormap map = Colormap::viridis;
  std::optional<Eigen::Vector2d> range;
};

struct IsosurfaceDescription {
  Invariant invariant = Invariant::norm;
  double value = 0;
  MaterialDescription material;
};

struct ContextDescription {
  bool box = true;        ///< The volume's edges.
  bool obstacles = true;  ///< The obstacles of the scene, as surfaces.
  bool plate = false;     ///< The receiver, with the light of the photons on it.
  std::optional<SliceDescription> slice;
  std::vector<IsosurfaceDescription> isosurfaces;
};

enum class Background { color, lights, transparent };

struct PathTracingDescription {
  SeedDescription seeds;
  std::filesystem::path paths;  ///< File with paths, instead of seeds; empty: none.
  bool backwards = true;        ///< Whether light is also followed back from seeds within the volume.
  bool outside = false;         ///< Whether the straight parts before and behind the volume are drawn.
  PathStyle style = PathStyle::tube;
  TubeCaps caps = TubeCaps::round;
  RadiusDescription radius;
  PathColorDescription color;
  MaterialDescription material;
  ContextDescription context;
  Shading shading = Shading::path;
  int bands = 16;  ///< Number of bands of the light that shows the paths.
  int max_depth = 6;
  double indirect_clamp = 10;  ///< ShadingSettings::indirect_clamp where the strongest light has the strength 1.
  int samples = 64;
  int min_samples = 16;
  double noise = 0.02;                ///< Relative error at which a pixel is done; 0: every pixel gets all samples.
  std::optional<double> max_seconds;  ///< After this time no pixel gets more samples; none: no limit.
  PixelFilterShape filter = PixelFilterShape::blackman_harris;
  Background background = Background::color;
  Eigen::Vector3d background_color{1, 1, 1};  ///< Linear Rec. 709.
};

}  // namespace tensorray
