#pragma once
/// @file scenes/path_tracing/path_tracing_description.h
/// The keys of `integrator` that path tracing has.
/// Lengths are world units, angles degrees.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "renderer/color/colormap.h"
#include "renderer/shading/pixel_filter.h"
#include "renderer/shading/shading.h"
#include "renderer/surfaces/tube_mesh.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {

enum class SeedKind { grid, poisson_disk, line, sphere, threshold, file };

struct SeedDescription {
  SeedKind kind = SeedKind::grid;
  std::uint64_t count = 400;                ///< About so many; `file` has its own number.
  std::optional<Eigen::Vector3d> from, to;  ///< line; none: across the middle of the volume.
  std::optional<Eigen::Vector3d> center;    ///< sphere; none: the middle of the volume.
  std::optional<double> radius;             ///< sphere; none: a quarter of the volume's shortest side.
  Invariant invariant = Invariant::norm;    ///< threshold: seeds are where this is ...
  std::optional<double> above, below;       ///< ... above and below these.
  std::filesystem::path file;               ///< file: points.
};

enum class PathStyle { tube, wire, ellipses, lines };

struct RadiusDescription {
  std::optional<double> scale;     ///< World units per unit of T; none: so that the median semi-axis is `typical`.
  std::optional<double> typical;   ///< None: by the distance between seeds. Of lines, their radius.
  std::optional<double> min, max;  ///< None: a fifth of `typical`, and three times it.
};

enum class PathColor { force, transverse_force, curvature, length, wavelength, direction, invariant, none };

struct PathColorDescription {
  PathColor by = PathColor::force;
  Invariant invariant = Invariant::norm;  ///< by invariant: which.
  Colormap map = Colormap::viridis;
  std::optional<Eigen::Vector2d> range;  ///< None: from the 1st to the 99th percentile.
  bool logarithmic = false;
  bool legend = false;  ///< A colour bar in the display-referred picture.
};

enum class MaterialKind { diffuse, principled, metal, glass };
enum class Metal { gold, silver, copper, aluminium };

struct MaterialDescription {
  MaterialKind kind = MaterialKind::principled;
  Eigen::Vector3d color{0.7, 0.7, 0.7};  ///< Where the surface has no colours of its own; linear Rec. 709.
  double roughness = 0.4;
  double metallic = 0, specular = 0.5, clearcoat = 0;  ///< principled.
  Metal metal = Metal::gold;                           ///< metal.
  double index = 1.5;                                  ///< glass.
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
  bool obstacles = true;  ///< The scene's, as surfaces.
  bool plate = false;     ///< The receiver, with the photons' caustic.
  std::optional<SliceDescription> slice;
  std::vector<IsosurfaceDescription> isosurfaces;
};

enum class Background { color, lights, transparent };

struct PathTracingDescription {
  SeedDescription seeds;
  std::filesystem::path paths;  ///< Paths of a file instead of seeds; empty: none.
  bool backwards = true;        ///< Whether light is also followed back from seeds within the volume.
  bool outside = false;         ///< Whether the straight pieces before and behind the volume are drawn.
  PathStyle style = PathStyle::tube;
  TubeCaps caps = TubeCaps::round;
  RadiusDescription radius;
  PathColorDescription color;
  MaterialDescription material;
  ContextDescription context;
  Shading shading = Shading::path;
  int bands = 16;  ///< Wavelengths of the light that shows the paths.
  int max_depth = 6;
  int samples = 64;
  int min_samples = 16;
  double noise = 0.02;  ///< Relative; 0: all samples.
  PixelFilterShape filter = PixelFilterShape::blackman_harris;
  Background background = Background::color;
  Eigen::Vector3d background_color{1, 1, 1};  ///< Linear Rec. 709.
};

}  // namespace tensorray
