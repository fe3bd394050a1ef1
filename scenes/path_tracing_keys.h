#pragma once
/// @file scenes/path_tracing_keys.h
/// The part of scene_keys.h (see there) that tells of path tracing.

#include "renderer/color/spectrum.h"
#include "scenes/choices.h"
#include "scenes/limits.h"
#include "scenes/path_tracing_description.h"

namespace tensorray {

template <class Visitor>
void describe(SeedDescription& seeds, Visitor& visit) {
  visit("kind", seeds.kind, "how seeds are spread: on the entry plane (grid, poisson_disk), or in the volume");
  visit("count", seeds.count, "about how many", between(1, 2e6));
  visit("from", seeds.from, "line: one end, world; without both the line runs across the middle of the volume");
  visit("to", seeds.to, "line: the other end, world");
  visit("center", seeds.center, "sphere: middle, world; without it the volume's");
  visit("radius", seeds.radius, "sphere: world units; default: a quarter of the volume's shortest side", above(0));
  visit("invariant", seeds.invariant, "threshold: seeds are where this is above and below");
  visit("above", seeds.above, "threshold: least value");
  visit("below", seeds.below, "threshold: greatest value");
  visit("file", seeds.file, "file: a text file with x y z in each line, and perhaps a direction");
}

template <class Visitor>
void describe(RadiusDescription& radius, Visitor& visit) {
  visit.exclude("scale", {"typical"});
  visit("scale", radius.scale, "world units for each unit of the tensor; without it the median semi-axis is typical",
        above(0).or_word("auto"));
  visit("typical", radius.typical, "median semi-axis, world units; default: by the distance between seeds", above(0));
  visit("min", radius.min, "no semi-axis is shorter, so that flat ellipses can be seen; default: typical / 5",
        above(0));
  visit("max", radius.max, "larger ellipses shrink to it; default: 3 * typical", above(0));
}

template <class Visitor>
void describe(PathColorDescription& color, Visitor& visit) {
  visit("by", color.by, "what is shown as colour: force is |T V|, curvature |V'|");
  visit("invariant", color.invariant, "by invariant: which");
  visit("map", color.map, "colormap");
  visit("range", color.range, "values of the map's ends; without it the 1st and the 99th percentile");
  visit("logarithmic", color.logarithmic, "equal ratios are equally far apart");
  visit("legend", color.legend, "draw a colour bar into output.image");
}

template <class Visitor>
void describe(MaterialDescription& material, Visitor& visit) {
  visit("kind", material.kind, "what the surface is made of");
  visit("color", material.color, "where it has no colours of its own; linear Rec. 709", between(0, 1));
  visit("roughness", material.roughness, "0 polished, 1 matt (not diffuse)", between(0, 1));
  visit("metallic", material.metallic, "principled: 0 plastic, 1 metal", between(0, 1));
  visit("specular", material.specular, "principled: reflection of plastic, 0.5 is 4 %", between(0, 1));
  visit("clearcoat", material.clearcoat, "principled: lacquer", between(0, 1));
  visit("metal", material.metal, "metal: which");
  visit("index", material.index, "glass: index of refraction", between(1.01, 5));
}

template <class Visitor>
void describe(SliceDescription& slice, Visitor& visit) {
  visit("normal", slice.normal, "of the plane", not_zero());
  visit("center", slice.center, "a point of the plane, world; without it the volume's middle");
  visit("invariant", slice.invariant, "what colours it");
  visit("map", slice.map, "colormap");
  visit("range", slice.range, "values of the map's ends; without it the 1st and the 99th percentile");
}

template <class Visitor>
void describe(IsosurfaceDescription& isosurface, Visitor& visit) {
  visit.require({"value"});
  visit("invariant", isosurface.invariant, "what is constant on it");
  visit("value", isosurface.value, "where the surface is");
  visit.section("material", isosurface.material, "of the surface");
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
  visit.section("seeds", paths.seeds, "path_tracing: where paths are caught");
  visit("paths", paths.paths, "path_tracing: a file of paths that are drawn instead of traced",
        endings({".vtp", ".tck"}));
  visit("backwards", paths.backwards, "path_tracing: light is also followed back from seeds in the volume");
  visit("outside", paths.outside, "path_tracing: draw the straight pieces before and behind the volume, too");
  visit("style", paths.style, "path_tracing: how paths are drawn");
  visit("caps", paths.caps, "path_tracing: ends of tubes");
  visit.section("radius", paths.radius, "path_tracing: size of the ellipses");
  visit.section("color", paths.color, "path_tracing: colour of the paths");
  visit.section("material", paths.material, "path_tracing: of the paths");
  visit.section("context", paths.context, "path_tracing: what else is shown");
  visit("shading", paths.shading, "path_tracing: path is physically based; the others are fast previews");
  visit("bands", paths.bands, "path_tracing: wavelengths of the light that shows the paths", between(3, 1000));
  visit("max_depth", paths.max_depth, "path_tracing: surfaces that light meets at most; 1 is direct light alone",
        between(1, 1000));
  visit("max_samples", paths.samples, "path_tracing: samples of a pixel at most", between(1, 1e6));
  visit("min_samples", paths.min_samples, "path_tracing: samples of a pixel at least", between(1, 1e6));
  visit("noise", paths.noise, "path_tracing: a pixel is done at this relative error; 0: all have max_samples",
        between(0, 1));
  visit("filter", paths.filter, "path_tracing: pixel filter");
  visit("background", paths.background, "path_tracing: what is seen where nothing is");
  visit("background_color", paths.background_color, "path_tracing: linear Rec. 709", at_least(0));
}

template <class Visitor>
void describe(CameraDescription& camera, Visitor& visit) {
  visit.exclude("position", {"direction"});
  visit("projection", camera.projection, "perspective or orthographic");
  visit("position", camera.position, "world; without it everything is seen");
  visit("target", camera.target, "what the camera looks at; without it the middle of the scene");
  visit("direction", camera.direction, "of the view, where there is no position", not_zero());
  visit("up", camera.up, "upwards in the picture; without it +z", not_zero());
  visit("angle", camera.angle, "of the view from lower to upper edge, degrees", between(0.01, 175));
  visit("height", camera.height, "orthographic, with a position: of what is seen; default: everything", above(0));
  visit("lens_radius", camera.lens_radius, "of a thin lens, world units; 0: everything is sharp", at_least(0));
  visit("focus_distance", camera.focus_distance, "of what is sharp; default: the target's", above(0));
  visit("resolution", camera.resolution, "pixels, width and height", between(1, 32768).or_one_for_all());
}

template <class Visitor>
void describe(LightSourceDescription& light, Visitor& visit) {
  visit.require({"kind"});
  visit("kind", light.kind, "what shines");
  visit("color", light.color, "linear Rec. 709; of an environment a factor", at_least(0));
  visit("strength", light.strength, "radiance; of directional light irradiance / pi", at_least(0));
  visit("direction", light.direction, "directional: where light travels to; area: what it faces", not_zero());
  visit("angle", light.angle, "directional: of the disk, degrees (the sun: 0.53)", between(0, 180));
  visit("center", light.center, "area: middle, world");
  visit("size", light.size, "area: width and height, world units", above(0));
  visit("file", light.file, "environment: a latitude-longitude picture");
  visit("rotation", light.rotation, "environment: about +z, degrees");
}

}  // namespace tensorray
