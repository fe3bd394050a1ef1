#pragma once
/// The method "path_tracing": a picture of bent rays as tubes in light. The keys of `integrator` that it has; lengths
/// are in world units, angles in degrees.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/camera/pixel_filter.h"
#include "renderer/charts/colormap.h"
#include "renderer/shading/shading.h"
#include "renderer/spectra/spectrum.h"
#include "renderer/surfaces/tube_mesh.h"
#include "scenes/description/choices.h"
#include "scenes/description/description.h"
#include "scenes/description/method.h"
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
  double body = 0;        ///< Opacity of the surface on which the field ends; 0: it is not shown.
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

inline Words words(SeedKind) { return {"grid", "poisson_disk", "line", "sphere", "threshold", "file"}; }
inline Words words(PathStyle) { return {"tube", "wire", "ellipses", "lines"}; }
inline Words words(TubeCaps) { return {"open", "flat", "round"}; }

inline Words words(PathColor) {
  return {"force", "transverse_force", "curvature", "length", "wavelength", "direction", "invariant", "none"};
}

inline Words words(Shading) { return {"path", "ambient_occlusion", "headlight"}; }

inline Choices<PixelFilterShape> choices(PixelFilterShape) {
  return {{"blackman_harris", PixelFilterShape::blackman_harris},
          {"gaussian", PixelFilterShape::gaussian},
          {"box", PixelFilterShape::box}};
}

inline Words words(Background) { return {"color", "lights", "transparent"}; }

inline void describe(SeedDescription& seeds, KeyVisitor& visit) {
  visit("kind", seeds.kind, "how seeds are spread: on the entry plane (grid, poisson_disk), or in the volume", knob());
  visit("count", seeds.count, "approximate number of seeds", between(1, 2e6).as_knob(1, 5000));
  visit("from", seeds.from, "line: one end, world; default: an end of a line across the middle of the volume");
  visit("to", seeds.to, "line: the other end, world; default: as for `from`");
  visit("center", seeds.center, "sphere: middle, world; default: that of the volume");
  visit("radius", seeds.radius, "sphere: radius, world units; default: a quarter of the volume's shortest side",
        above(0));
  visit("invariant", seeds.invariant, "threshold: invariant whose value is limited");
  visit("above", seeds.above, "threshold: least value of the invariant");
  visit("below", seeds.below, "threshold: greatest value of the invariant");
  visit("file", seeds.file, "file: a text file with x y z, and optionally a direction, in each line");
  visit.only_for({"from", "to"}, "kind", seeds.kind, {SeedKind::line});
  visit.only_for({"center", "radius"}, "kind", seeds.kind, {SeedKind::sphere});
  visit.only_for({"invariant", "above", "below"}, "kind", seeds.kind, {SeedKind::threshold});
  visit.only_for({"file"}, "kind", seeds.kind, {SeedKind::file});
}

inline void describe(RadiusDescription& radius, KeyVisitor& visit) {
  visit.exclude("scale", {"typical"});
  visit("scale", radius.scale, "world units for each unit of the tensor; default: the median semi-axis is `typical`",
        above(0).or_word("auto"));
  visit("typical", radius.typical, "median semi-axis, world units; default: by the distance between seeds", above(0));
  visit("min", radius.min, "least semi-axis, so that flat ellipses are visible; default: typical / 5", above(0));
  visit("max", radius.max, "greatest semi-axis, to which larger ellipses shrink; default: 3 * typical", above(0));
}

inline void describe(PathColorDescription& color, KeyVisitor& visit) {
  visit("by", color.by, "quantity that is shown as colour: force is |T V|, curvature |V'|", knob());
  visit("invariant", color.invariant, "by invariant: the invariant");
  visit("map", color.map, "colormap", knob());
  visit("range", color.range, "values at the ends of the map; default: the 1st and the 99th percentile");
  visit("logarithmic", color.logarithmic, "logarithmic colour scale");
  visit("legend", color.legend, "draw a colour bar into output.image");
}

inline void describe(SliceDescription& slice, KeyVisitor& visit) {
  visit("normal", slice.normal, "normal of the plane", not_zero());
  visit("center", slice.center, "a point of the plane, world; default: the middle of the volume");
  visit("invariant", slice.invariant, "invariant that is shown as colour");
  visit("map", slice.map, "colormap");
  visit("range", slice.range, "values at the ends of the map; default: the 1st and the 99th percentile");
}

inline void describe(IsosurfaceDescription& isosurface, KeyVisitor& visit) {
  visit.require({"value"});
  visit("invariant", isosurface.invariant, "invariant that is constant on the surface");
  visit("value", isosurface.value, "value of the invariant on the surface");
  visit.section("material", isosurface.material, "material of the surface");
}

inline void describe(ContextDescription& context, KeyVisitor& visit) {
  visit("box", context.box, "the volume's edges");
  visit("obstacles", context.obstacles, "the scene's obstacles as surfaces");
  visit("body", context.body, "opacity of the surface on which the field ends (`field.bounds`); 0: it is not shown",
        between(0, 1));
  visit("plate", context.plate, "the receiver, with the photons that fall on it");
  visit.section("slice", context.slice, "a plane through the volume, coloured by an invariant");
  visit.list("isosurfaces", context.isosurfaces, "surfaces on which an invariant has one value",
             [](IsosurfaceDescription& item) -> IsosurfaceDescription& { return item; });
}

inline void describe(PathTracingDescription& paths, KeyVisitor& visit) {
  visit.section("seeds", paths.seeds, "path_tracing: where paths start");
  visit("paths", paths.paths, "path_tracing: a file of paths that are drawn instead of traced",
        endings({".vtp", ".tck"}));
  visit("backwards", paths.backwards, "path_tracing: also follow light back from seeds in the volume");
  visit("outside", paths.outside, "path_tracing: draw the straight pieces before and behind the volume, too");
  visit("style", paths.style, "path_tracing: how paths are drawn", knob());
  visit("caps", paths.caps, "path_tracing: form of the ends of tubes");
  visit.section("radius", paths.radius, "path_tracing: size of the ellipses");
  visit.section("color", paths.color, "path_tracing: colour of the paths");
  visit.section("material", paths.material, "path_tracing: material of the paths");
  visit.section("context", paths.context, "path_tracing: surfaces that are shown besides the paths");
  visit("shading", paths.shading, "path_tracing, scene: path is physically based; the others are fast previews",
        knob());
  visit("bands", paths.bands, "path_tracing, scene: number of wavelengths of the light that shows the paths",
        between(3, 1000));
  visit("max_depth", paths.max_depth,
        "path_tracing, scene: greatest number of surfaces that light meets; 1: direct light only", between(1, 1000));
  visit("indirect_clamp", paths.indirect_clamp,
        "path_tracing, scene: most that light scattered twice or more adds to a sample, where the strongest light has "
        "the "
        "strength 1; 0: no limit",
        at_least(0));
  visit("max_samples", paths.samples, "path_tracing, scene: greatest number of samples per pixel", between(1, 1e6));
  visit("min_samples", paths.min_samples, "path_tracing, scene: least number of samples per pixel", between(1, 1e6));
  visit("noise", paths.noise,
        "path_tracing, scene: relative error at which a pixel is finished; 0: every pixel takes max_samples",
        between(0, 1));
  visit("max_seconds", paths.max_seconds,
        "path_tracing, scene: time after which no pixel takes more samples, seconds; the picture then depends on the "
        "machine",
        above(0));
  visit("filter", paths.filter, "path_tracing, scene: pixel filter");
  visit("background", paths.background, "path_tracing, scene: what pixels without a surface show");
  visit("background_color", paths.background_color, "path_tracing, scene: colour of the background, linear Rec. 709",
        at_least(0));
}

std::shared_ptr<Method> path_tracing_method();

}  // namespace tensorray
