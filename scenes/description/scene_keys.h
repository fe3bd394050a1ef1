#pragma once
/// The table of all keys of a scene file except those of the methods, which have their own tables.

#include <filesystem>
#include <string>

#include "renderer/spectra/spectrum.h"
#include "scenes/description/choices.h"
#include "scenes/description/description.h"
#include "scenes/keys/values.h"
#include "volumes/making/smoothing.h"

namespace tensorray {

/// The largest integer that every JSON reader keeps exactly: 2^53.
constexpr double largest_exact_integer = 9007199254740992.0;

inline void describe(ComponentGrids& grids, KeyVisitor& visit) {
  constexpr const char* entries[] = {"xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"};
  constexpr const char* axes[] = {"x", "y", "z"};
  for (std::size_t i = 0; i < 9; ++i)
    visit(entries[i], grids.tensor[i], "name of the scalar grid that is this component of the tensor");
  for (std::size_t i = 0; i < 3; ++i)
    visit(axes[i], grids.vector[i], "name of the scalar grid that is this component of the vector to derive");
}

inline void describe(FieldDescription& field, KeyVisitor& visit) {
  visit.exactly_one({"file", "generate"});
  visit("file", field.file, "OpenVDB file with the tensor field");
  visit("name", field.name, "name of the field in the file; not needed if there is only one");
  visit.generator("generate", field.generate, "an analytic field instead of a file");
  visit("derive", field.derive,
        "derivative that makes the tensor: gradient of a vector grid, hessian of a scalar grid, viscous_stress of a "
        "velocity or of its gradient, -viscous_stress: what acts in the whole stress -pI + viscous_stress");
  visit("unit", field.unit, "unit of the tensor, for legends, such as MPa; default: that which the file notes");
  visit.section("components", field.components,
                "scalar grids of the file that are the components, whatever their names");
  visit.exclude("components", {"generate"});
  visit("smooth", field.smooth, "standard deviation of a Gaussian that smooths the field first, voxels; 0 is none",
        between(0, max_smoothing));
  visit("noise", field.noise, "replace the field by its noise alone, without structure, for a picture beside its own");
  visit("eigenvalues", field.eigenvalues,
        "raw: as they are; absolute: |T|; positive: (T^2)^(1/2); auto: absolute if the field is symmetric (not "
        "of -viscous_stress), else raw",
        knob());
  visit("interpolation", field.interpolation, "what the field is between its voxels: smooth (cubic), or linear");
  visit("border", field.border,
        "cubic: inactive voxels fade to zero, or extend the values of active ones; auto extends where the field has a "
        "surface, or obstacles or bounds are given");
  visit("scale", field.scale,
        "factor on the flexibility; auto: the scale that shows the field's structure without tangling the light",
        not_zero().or_word("auto").as_knob());
  visit(
      "bounds", field.bounds,
      "closed mesh that limits the volume, outside which light is straight; auto: the surface of the field's body, if "
      "its file has one; none: the box alone");
}

inline void describe(BendingDescription& bending, KeyVisitor& visit) {
  visit("a", bending.flexibility.a, "constant part of the flexibility of light, s = a + b * wavelength", knob(-2, 2));
  visit("b", bending.flexibility.b, "slope of the flexibility of light, s = a + b * wavelength, per nm",
        knob(-0.004, 0.004));
  visit("rgb", bending.rgb, "three flexibilities, one for each colour channel, instead of wavelengths");
  visit("method", bending.settings.method,
        "how rays are integrated; auto is splitting4 between cubic voxels, splitting between linear ones; all but "
        "splitting4 between cubic voxels are five to six times slower");
  visit("step", bending.settings.step,
        "arc length per step, in voxels; auto follows the error, or the strength of the field",
        above(0).or_word("auto"));
  visit("tolerance", bending.settings.tolerance, "adaptive methods: error per step, in voxels", above(0));
  visit("max_steps", bending.settings.max_steps, "number of steps after which a ray is given up", between(1, 1e9));
}

inline void describe(ApertureDescription& aperture, KeyVisitor& visit) {
  visit("center", aperture.center, "middle of the aperture, world; default: that of the volume's silhouette");
  visit("size", aperture.size, "width and height, world units", above(0));
}

/// `light.wavelengths`.
struct WavelengthKeys {
  LightDescription& light;
};

inline void describe(WavelengthKeys& keys, KeyVisitor& visit) {
  LightDescription& light = keys.light;
  visit("min", light.wavelength_min, "shortest wavelength, nm", between(observer_min, observer_max).as_knob());
  visit("max", light.wavelength_max, "longest wavelength, nm", between(observer_min, observer_max).as_knob());
  visit("count", light.wavelength_count, "number of bands between the two", between(1, 1000).as_knob(1, 128));
  visit("per_photon", light.wavelengths_per_photon, "bands that each photon carries; a divisor of count",
        between(1, 1000).or_word("all"));
}

inline void describe(LightDescription& light, KeyVisitor& visit) {
  visit("direction", light.direction,
        "direction in which light travels, of any length; auto: of 26 directions, the one in which light "
        "shows most of the field",
        not_zero().or_word("auto").as_knob());
  visit("up", light.up, "up axis of aperture and receiver; default: +z, or +y for light along z", not_zero());
  visit("photons", light.photons, "approximate number of positions that emit", between(1, 1e12).as_knob(1e3, 4e6));
  visit("pattern", light.pattern, "pattern of these positions on the aperture");
  visit("spectrum", light.spectrum,
        "an illuminant (D65, E, A), \"blackbody KELVIN\", or a text file with columns wavelength (nm) and value",
        knob().with_examples({"D65", "E", "A", "blackbody 3000", "blackbody 5500", "blackbody 9000"}));
  visit.section("wavelengths", WavelengthKeys{light}, "the bands of light that are traced");
  visit("irradiance", light.irradiance, "irradiance of the undisturbed beam, W per world unit squared", above(0));
  visit("beam", light.beam,
        "plate: undisturbed light is all around the volume, on all of the plate; volume: light goes only through the "
        "volume, and the plate is 1.25 times as large",
        knob());
  visit.section("aperture", light.aperture, "a rectangle that light comes from, instead of `beam`");
}

inline void describe(ReceiverDescription& receiver, KeyVisitor& visit) {
  visit.exclude("center", {"distance"});
  visit("distance", receiver.distance,
        "distance of the plate behind the volume, along the light; default: 1/4 of its depth", at_least(0).as_knob());
  visit("center", receiver.center, "middle of the plate, world");
  visit("normal", receiver.normal, "normal of the plate; default: opposite to the light", not_zero().as_knob());
  visit("up", receiver.up, "up axis of the plate; default: that of the light", not_zero());
  visit("size", receiver.size, "width and height, world units; default: what straight light from the volume reaches",
        above(0).as_knob());
  visit("resolution", receiver.resolution, "pixels, width and height; default: 512 along the longer side",
        between(1, 32768).or_one_for_all());
}

inline void describe(CameraDescription& camera, KeyVisitor& visit) {
  visit.exclude("position", {"direction"});
  visit("projection", camera.projection, "perspective or orthographic");
  visit("position", camera.position, "position of the camera, world; default: everything is visible");
  visit("target", camera.target, "point that the camera looks at, world; default: the middle of the scene");
  visit("direction", camera.direction, "view direction, if there is no position", not_zero());
  visit("up", camera.up, "up direction of the picture; default: +z", not_zero());
  visit("angle", camera.angle, "vertical angle of view, degrees", between(0.01, 175));
  visit("height", camera.height, "orthographic, with a position: visible height; default: everything", above(0));
  visit("lens_radius", camera.lens_radius, "radius of a thin lens, world units; 0: everything is sharp", at_least(0));
  visit("focus_distance", camera.focus_distance, "distance that is sharp; default: that of the target", above(0));
  visit("resolution", camera.resolution, "pixels, width and height", between(1, 32768).or_one_for_all());
}

inline void describe(LightSourceDescription& light, KeyVisitor& visit) {
  visit.require({"kind"});
  visit("kind", light.kind, "kind of light");
  visit("color", light.color, "colour, linear Rec. 709; environment: a factor", at_least(0));
  visit("strength", light.strength, "radiance; directional: irradiance / pi; point: the same at a distance of 1",
        at_least(0));
  visit("direction", light.direction,
        "directional: direction in which light travels; area: direction that the light faces", not_zero());
  visit("angle", light.angle, "directional: angular diameter, degrees (the sun: 0.53)", between(0, 180));
  visit("center", light.center, "area: middle, world");
  visit("size", light.size, "area: width and height, world units", above(0));
  visit("position", light.position, "point: where it is, world");
  visit("file", light.file, "environment: a latitude-longitude picture");
  visit("layer", light.layer, "environment: layer of the file (.exr); default: R, G, B, or the first layer");
  visit("rotation", light.rotation, "environment: rotation about +z, degrees");
  visit("caustic", light.caustic,
        "directional, point, area: how integrator `scene` finds light that comes through the field to objects");
  visit("group", light.group, "name of a layer of the .exr that has the light of all lights of this group");
  visit.only_for({"direction"}, "kind", light.kind, {LightKind::directional, LightKind::area});
  visit.only_for({"angle"}, "kind", light.kind, {LightKind::directional});
  visit.only_for({"caustic"}, "kind", light.kind, {LightKind::directional, LightKind::point, LightKind::area});
  visit.only_for({"center", "size"}, "kind", light.kind, {LightKind::area});
  visit.only_for({"position"}, "kind", light.kind, {LightKind::point});
  visit.only_for({"file", "layer", "rotation"}, "kind", light.kind, {LightKind::environment});
}

inline void describe(PlateDescription& plate, KeyVisitor& visit) {
  visit.require({"center"});
  visit("center", plate.center, "middle of the plate, world");
  visit("normal", plate.normal, "normal of the plate", not_zero());
  visit("up", plate.up, "up axis of its texture; default: +z, or +y for a plate across z", not_zero());
  visit("size", plate.size, "width and height, world units", above(0));
}

inline void describe(PathsDescription& paths, KeyVisitor& visit) {
  visit("count", paths.count, "number of seeds; default: that of integrator.seeds", between(1, 1e6));
}

inline void describe(ObjectDescription& object, KeyVisitor& visit) {
  visit.exactly_one({"plate", "file", "paths"});
  visit.section("plate", object.plate, "a flat rectangle");
  visit("file", object.file, "a mesh");
  visit("smooth_angle", object.smooth_angle,
        "of a mesh: edges look smooth up to this angle between triangles, degrees; auto takes the file's normals",
        between(0, 180).or_word("auto"));
  visit.section("paths", object.paths,
                "bent rays as tubes, with the seeds, style, radius and colours of `integrator` (path_tracing)");
  visit("texture", object.texture,
        "a picture whose colours are the reflectance of a plate, or of a mesh with texture coordinates; of a plate "
        "also a pattern");
  visit("texture_layer", object.texture_layer, "of a picture: layer of the file (.exr)");
  visit("roughness_texture", object.roughness_texture, "of a mesh: a picture of its roughness, 0 to 1, not converted");
  visit("normal_texture", object.normal_texture, "of a mesh: a picture of its normals along u, v and the surface");
  visit("squares", object.squares, "checkerboard: squares along the shorter side", between(1, 4096));
  visit.section("material", object.material, "material; the brighter squares of a checkerboard have its colour");
}

inline void describe(IntegratorDescription& integrator, KeyVisitor& visit) {
  visit.require({"type"});
  visit("type", integrator.type, "the method", knob());
  for (const auto& method : integrator.methods) method->visit(visit);
}

inline void describe(OutputDescription& output, KeyVisitor& visit) {
  for (const Output& kind : output.kinds) {
    std::filesystem::path file;
    visit(kind.key, file, kind.meaning, endings(kind.endings));
    if (!file.empty()) output.files[kind.key] = file;
  }
  visit("fluence_bands", output.fluence_bands, "write a further grid to `fluence` for each band of wavelengths");
  visit("stokes", output.stokes,
        "polariscope: `spectral` has the four Stokes parameters of the light on the last polariser");
  visit("exr_type", output.exr_type, "how `exr` stores colours and normals; other layers are always float");
  visit("exr_layers", output.exr_layers, "layers of `exr` beside R, G, B and A, such as Z, normal; default: all");
  visit("exposure", output.exposure, "exposure of `image`, stops", between(-100, 100).or_word("auto").as_knob(-8, 8));
  visit("white_balance", output.white_balance, "adapt the light's white to the working space's");
  visit("ocio", output.ocio,
        "OpenColorIO config: a file, ocio://NAME, or built-in; default: $OCIO, or the built-in one");
  visit("display", output.display, "OpenColorIO display; default: that of the config", knob());
  visit("view", output.view, "OpenColorIO view; default: that of the display", knob());
  visit("annotations", output.annotations,
        "what is drawn over `image`: a scale bar, the world's axes, a legend, the lines of bodies");
  visit("caption", output.caption, "a line over `image`; {field.scale} is the value of a key, # counts frames");
}

inline void describe(WorldDescription& world, KeyVisitor& visit) {
  visit("up", world.up, "the axis that points up, here and in the files that are read and written: z or y");
  visit("unit", world.unit,
        "unit of lengths, for scale bars and legends, such as mm; default: that which the field's file notes");
}

/// An item of `obstacles`.
struct ObstacleKeys {
  std::filesystem::path& file;
};

inline void describe(ObstacleKeys& keys, KeyVisitor& visit) {
  visit.require({"file"});
  visit("file", keys.file, "mesh that absorbs light");
}

inline void describe(SceneDescription& scene, KeyVisitor& visit) {
  visit.require({"field", "integrator"});
  std::string schema;  // Only editors use it.
  visit("$schema", schema, "path of this schema, for editors");
  visit("seed", scene.seed, "seed of the random numbers", between(0, largest_exact_integer));
  visit.section("world", scene.world, "the axes and the unit of the scene");
  visit.section("field", scene.field, "the tensor field");
  visit.section("bending", scene.bending, "how the field bends light");
  visit.section("light", scene.light, "parallel light through the volume");
  visit.list("obstacles", scene.obstacles, "surfaces that absorb light",
             [](std::filesystem::path& file) { return ObstacleKeys{file}; });
  visit.section("receiver", scene.receiver, "photon_distribution, lens, path_tracing: the plate that collects light");
  visit.section("integrator", scene.integrator, "the method");
  visit.section("camera", scene.camera, "path_tracing, scene: the camera");
  visit.list("lights", scene.lights,
             "path_tracing, scene: lights; default: a white sky and a lamp, or a sky and the sun",
             [](LightSourceDescription& item) -> LightSourceDescription& { return item; });
  visit.list("objects", scene.objects, "scene: what the light falls on; default: a checkerboard as floor",
             [](ObjectDescription& item) -> ObjectDescription& { return item; });
  visit.section("output", scene.output, "files to write; default: the scene file's name with .png and .exr");
}

}  // namespace tensorray
