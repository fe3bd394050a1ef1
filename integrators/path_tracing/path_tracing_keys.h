#pragma once
/// @file integrators/path_tracing/path_tracing_keys.h
/// The table of path tracing's keys. For visitors see scenes/description/scene_keys.h.

#include <array>

#include "integrators/path_tracing/path_tracing_description.h"
#include "renderer/spectra/spectrum.h"
#include "scenes/description/choices.h"
#include "scenes/keys/limits.h"

namespace tensorray {

inline auto choices(SeedKind) {
  using C = Choice<SeedKind>;
  return std::array{C{"grid", SeedKind::grid},           C{"poisson_disk", SeedKind::poisson_disk},
                    C{"line", SeedKind::line},           C{"sphere", SeedKind::sphere},
                    C{"threshold", SeedKind::threshold}, C{"file", SeedKind::file}};
}

inline auto choices(PathStyle) {
  using C = Choice<PathStyle>;
  return std::array{C{"tube", PathStyle::tube}, C{"wire", PathStyle::wire}, C{"ellipses", PathStyle::ellipses},
                    C{"lines", PathStyle::lines}};
}

inline auto choices(TubeCaps) {
  using C = Choice<TubeCaps>;
  return std::array{C{"open", TubeCaps::open}, C{"flat", TubeCaps::flat}, C{"round", TubeCaps::round}};
}

inline auto choices(PathColor) {
  using C = Choice<PathColor>;
  return std::array{C{"force", PathColor::force},           C{"transverse_force", PathColor::transverse_force},
                    C{"curvature", PathColor::curvature},   C{"length", PathColor::length},
                    C{"wavelength", PathColor::wavelength}, C{"direction", PathColor::direction},
                    C{"invariant", PathColor::invariant},   C{"none", PathColor::none}};
}

inline auto choices(Shading) {
  using C = Choice<Shading>;
  return std::array{C{"path", Shading::path}, C{"ambient_occlusion", Shading::ambient_occlusion},
                    C{"headlight", Shading::headlight}};
}

inline auto choices(PixelFilterShape) {
  using C = Choice<PixelFilterShape>;
  return std::array{C{"blackman_harris", PixelFilterShape::blackman_harris}, C{"gaussian", PixelFilterShape::gaussian},
                    C{"box", PixelFilterShape::box}};
}

inline auto choices(Background) {
  using C = Choice<Background>;
  return std::array{C{"color", Background::color}, C{"lights", Background::lights},
                    C{"transparent", Background::transparent}};
}

template <class Visitor>
void describe(SeedDescription& seeds, Visitor& visit) {
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

template <class Visitor>
void describe(RadiusDescription& radius, Visitor& visit) {
  visit.exclude("scale", {"typical"});
  visit("scale", radius.scale, "world units for each unit of the tensor; default: the median semi-axis is `typical`",
        above(0).or_word("auto"));
  visit("typical", radius.typical, "median semi-axis, world units; default: by the distance between seeds", above(0));
  visit("min", radius.min, "least semi-axis, so that flat ellipses are visible; default: typical / 5", above(0));
  visit("max", radius.max, "greatest semi-axis, to which larger ellipses shrink; default: 3 * typical", above(0));
}

template <class Visitor>
void describe(PathColorDescription& color, Visitor& visit) {
  visit("by", color.by, "quantity that is shown as colour: force is |T V|, curvature |V'|", knob());
  visit("invariant", color.invariant, "by invariant: the invariant");
  visit("map", color.map, "colormap", knob());
  visit("range", color.range, "values at the ends of the map; default: the 1st and the 99th percentile");
  visit("logarithmic", color.logarithmic, "logarithmic colour scale");
  visit("legend", color.legend, "draw a colour bar into output.image");
}

template <class Visitor>
void describe(SliceDescription& slice, Visitor& visit) {
  visit("normal", slice.normal, "normal of the plane", not_zero());
  visit("center", slice.center, "a point of the plane, world; default: the middle of the volume");
  visit("invariant", slice.invariant, "invariant that is shown as colour");
  visit("map", slice.map, "colormap");
  visit("range", slice.range, "values at the ends of the map; default: the 1st and the 99th percentile");
}

template <class Visitor>
void describe(IsosurfaceDescription& isosurface, Visitor& visit) {
  visit.require({"value"});
  visit("invariant", isosurface.invariant, "invariant that is constant on the surface");
  visit("value", isosurface.value, "value of the invariant on the surface");
  visit.section("material", isosurface.material, "material of the surface");
}

template <class Visitor>
void describe(ContextDescription& context, Visitor& visit) {
  visit("box", context.box, "the volume's edges");
  visit("obstacles", context.obstacles, "the scene's obstacles as surfaces");
  visit("plate", context.plate, "the receiver, with the photons that fall on it");
  visit.section("slice", context.slice, "a plane through the volume, coloured by an invariant");
  visit.list("isosurfaces", context.isosurfaces, "surfaces on which an invariant has one value",
             [](IsosurfaceDescription& item) -> IsosurfaceDescription& { return item; });
}

template <class Visitor>
void describe(PathTracingDescription& paths, Visitor& visit) {
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

}  // namespace tensorray
