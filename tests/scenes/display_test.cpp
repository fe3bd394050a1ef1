// Annotations of display pictures: what each method draws, where, and that no other file changes.

#include <optional>

#include "base/constants.h"
#include "base/files/temporary_folder.h"
#include "base/process/progress.h"
#include "integrators/methods/read_scene.h"
#include "scenes/outputs/picture_outputs.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tests/files.h"
#include "tests/tracing/support.h"
#include "volumes/files/tensor_files.h"
#include "volumes/making/generators.h"

namespace tensorray {
namespace {

constexpr int size = 200;  // Pixels along both sides of all pictures.

/// The part of the picture that an annotation is in.
enum class Part { none, lower_left, upper_left, beside };

struct MethodCase {
  std::string name, text;
  bool has_legend;  ///< If not, it is left out, with a warning. The scale and the axes are always there.
};

const std::vector<MethodCase> methods{
    {"photons", R"({"integrator": {"type": "photon_distribution"}})", true},
    {"three colours", R"({"bending": {"rgb": [0.1, 0.2, 0.3]}, "integrator": {"type": "photon_distribution"}})", true},
    {"lens", R"({"integrator": {"type": "lens"}})", false},
    {"stretch", R"({"integrator": {"type": "stretch", "stretch": {"pixels": 200, "resolution": 8}}})", true},
    {"paths", R"({"integrator": {"type": "path_tracing"}})", true},
    {"paths of one colour", R"({"integrator": {"type": "path_tracing", "color": {"by": "none"}}})", false},
    {"paths from here", R"({"integrator": {"type": "path_tracing"}, "camera": {"position": [3, -4, 2]}})", true},
    {"parallel paths", R"({"integrator": {"type": "path_tracing"}, "camera": {"projection": "orthographic"}})", true},
    {"whole", R"({"integrator": {"type": "scene"}, "lights": [{"kind": "constant"}]})", false},
};

struct Rendered {
  Scene scene;
  Render render;
  Image display;
};

Scene loaded(const Json& json) { return load_scene(read_scene_json(json, "scene.json"), Progress()); }

/// @param annotations  The value of the key; null: it is not given.
Rendered rendered(const MethodCase& method, const Json& annotations) {
  Json json = Json::parse(method.text);
  json["field"] = {{"generate", {{"kind", "helix"}, {"resolution", 9}}}, {"scale", 0.6}};
  json["light"] = {{"photons", 2000}, {"wavelengths", {{"count", 4}}}};
  json["receiver"] = {{"size", {2.5, 2.5}}, {"resolution", {size, size}}};
  json["camera"]["resolution"] = {size, size};
  json["integrator"].update({{"max_samples", 1}, {"min_samples", 1}, {"bands", 8}, {"seeds", {{"count", 20}}}});
  if (!annotations.is_null()) json["output"] = {{"annotations", annotations}};
  Scene scene = loaded(json);
  Render render = tensorray::render(scene, Progress());
  Image display = display_image(scene, render, true);
  return {std::move(scene), std::move(render), std::move(display)};
}

bool is_within(Part part, int x, int y) {
  return (part == Part::lower_left && 3 * x < 2 * size && 4 * y > 3 * size) ||
         (part == Part::upper_left && 2 * x < size && 2 * y < size);
}

/// Expects that two pictures differ within a part of them, or beside the smaller one, and nowhere else.
void expect_only_within(Part part, const Image& with, const Image& without) {
  ASSERT_EQ(with.channels, without.channels);
  std::size_t within = 0, elsewhere = 0;
  for (int y = 0; y < without.height; ++y)
    for (int x = 0; x < without.width; ++x)
      if (!std::equal(with.pixel(x, y), with.pixel(x, y) + with.channels.size(), without.pixel(x, y)))
        ++(is_within(part, x, y) ? within : elsewhere);
  EXPECT_EQ(within > 20, part != Part::none && part != Part::beside);
  EXPECT_EQ(with.width > without.width, part == Part::beside);
  EXPECT_EQ(elsewhere, 0u);
}

TEST(Annotations, AreInTheirCornersAndNowhereElse) {
  for (const MethodCase& method : methods) {
    const Rendered plain = rendered(method, Json::array());
    const std::vector<std::pair<std::string, Part>> parts{{"scale", Part::lower_left},
                                                          {"axes", Part::upper_left},
                                                          {"legend", method.has_legend ? Part::beside : Part::none}};
    for (const auto& [annotation, part] : parts) {
      SCOPED_TRACE(annotation + " of " + method.name);
      const Rendered annotated = rendered(method, annotation);
      expect_only_within(part, annotated.display, plain.display);
      EXPECT_EQ(annotated.render.linear.pixels, plain.render.linear.pixels);  // What an EXR holds.
      const std::size_t warnings = annotated.render.warnings.size() - plain.render.warnings.size();
      EXPECT_EQ(warnings, part == Part::none ? 1u : 0u);
      if (part == Part::none) {
        EXPECT_THAT(annotated.render.warnings.back(), HasSubstr("/output/annotations"));
      }
    }
  }
}

/// Tubes have a legend, where it has a meaning, and a scale bar if nothing is said, with a note in perspective (there
/// is no one scale), and no warning. A camera that is chosen leaves room for this legend. Maps of stretch have a
/// legend.
TEST(Annotations, OfTubesAndStretchAreThereByDefault) {
  for (const MethodCase& method : methods) {
    SCOPED_TRACE(method.name);
    const Rendered plain = rendered(method, Json::array()), usual = rendered(method, nullptr);
    const Json json = Json::parse(method.text), type = json["integrator"]["type"];
    const bool is_given = json.value("camera", Json::object()).contains("position"), has_tubes = type == "path_tracing";
    EXPECT_EQ(usual.display.pixels != plain.display.pixels, has_tubes || type == "stretch");
    EXPECT_EQ(usual.display.width > plain.display.width, type == "stretch" || is_given);
    EXPECT_EQ(usual.render.linear.pixels != plain.render.linear.pixels, has_tubes && method.has_legend && !is_given);
    EXPECT_EQ(usual.render.warnings.size(), plain.render.warnings.size());
    const bool has_note = has_tubes && usual.render.view->is_perspective;
    EXPECT_EQ(usual.render.notes.size(), plain.render.notes.size() + (has_note ? 1 : 0));
    const Image preview = display_image(usual.scene, usual.render, true, 4);
    EXPECT_EQ(preview.width > size, usual.display.width > size);
  }
}

/// The lines of a body, where there is one: an obstacle, at the bottom of the volume. In no other file.
TEST(Annotations, ShowBodies) {
  const TemporaryFolder folder;
  write_mesh(folder / "box.ply", box_between({-0.5, -0.5, -0.9}, {0.5, 0.5, -0.5}), {});
  for (const MethodCase& method : methods) {
    SCOPED_TRACE(method.name);
    const bool has_lines = method.name == "photons" || method.name == "three colours" || method.name == "lens";
    MethodCase with = method;
    Json json = Json::parse(method.text);
    json["obstacles"] = {{{"file", (folder / "box.ply").string()}}};
    with.text = json.dump();
    const Rendered plain = rendered(with, Json::array()), visible = rendered(with, "body");
    EXPECT_EQ(visible.display.pixels != plain.display.pixels, has_lines);
    if (has_lines) {
      EXPECT_EQ(rendered(with, nullptr).display.pixels, visible.display.pixels);
    }
    EXPECT_EQ(visible.render.linear.pixels, plain.render.linear.pixels);
    EXPECT_EQ(visible.render.warnings.size() - plain.render.warnings.size(), has_lines ? 0u : 1u);
  }
  EXPECT_THAT(rendered(methods[0], "body").render.warnings.back(), HasSubstr("no lines of a body"));
}

/// The units of a scene of a field in a file. @param field  More keys of it. @param metadata  Of the file.
FieldUnits units_with(const ImageMetadata& metadata, const Json& field, const Json& world) {
  const TemporaryFolder folder;
  TensorGrid grid = generate(Helix{}, default_grid(Helix{}, 9));
  for (const auto& [key, value] : metadata) grid.metadata["tensorray:" + key] = value;
  write_tensor_vdb(folder / "field.vdb", grid);
  Json json{{"field", {{"file", (folder / "field.vdb").string()}, {"scale", 1}}},
            {"world", world},
            {"integrator", {{"type", "stretch"}}}};
  json["field"].update(field);
  return units_of(loaded(json));
}

/// A scene's units are its own, else those of the field's file.
TEST(Annotations, KnowTheUnitsOfAScene) {
  const Json none = Json::object();
  const FieldUnits unknown = units_with({}, none, none);
  EXPECT_EQ(unknown.length, "");
  EXPECT_EQ(unknown.tensor, "1/length");
  EXPECT_FALSE(unknown.is_anatomical);
  const ImageMetadata file{{"units", "mm^2/s"}, {"world_unit", "mm"}, {"world_axes", "RAS"}};
  EXPECT_EQ(units_with(file, none, none).length, "mm");
  EXPECT_EQ(units_with(file, none, none).tensor, "mm^2/s");
  EXPECT_TRUE(units_with(file, none, {{"up", "y"}}).is_anatomical);
  const FieldUnits own = units_with(file, {{"unit", "MPa"}}, {{"unit", "in"}});
  EXPECT_EQ(own.tensor, "MPa");
  EXPECT_EQ(own.length, "in");
  EXPECT_EQ(units_with(file, {{"derive", "viscous_stress"}}, {{"unit", "in"}}).tensor, "mm^2/s");
}

/// A gradient has the unit of its vector by that of lengths, and a stress of viscosity 1 that of its gradient.
TEST(Annotations, KnowTheUnitsOfDerivatives) {
  const std::string row = generate(Helix{}, default_grid(Helix{}, 9)).name + "_row0";
  struct Case {
    const char *of_vector, *derive, *length, *unit;
  };
  for (const Case& each : {Case{"m/s", "gradient", "m", "1/s"}, Case{"m/s", "-viscous_stress", "m", "1/s"},
                           Case{"m/s", "viscous_stress", "mm", "m/s/mm"}, Case{"mm", "gradient", "mm", "1"},
                           Case{"mm^2/s", "gradient", "mm", "mm^2/s/mm"}, Case{"m/s", "gradient", "", "m/s/length"}})
    EXPECT_EQ(units_with({{"units", each.of_vector}}, {{"name", row}, {"derive", each.derive}}, {{"unit", each.length}})
                  .tensor,
              each.unit);
}

/// Pixels of a plate have its size / resolution, those of a camera its height / resolution.
TEST(Annotations, KnowTheSizeOfPixels) {
  Plate plate;
  plate.size = {3, 2};
  plate.resolution = {600, 100};
  EXPECT_DOUBLE_EQ(picture_view(plate).pixel_size, 0.005);
  const Vector3d position(0, -5, 0), target(0, 0, 0), up(0, 0, 1);
  const Camera parallel = orthographic_camera(position, target, up, 4, {100, 200});
  EXPECT_DOUBLE_EQ(picture_view(parallel).pixel_size, 0.02);
  EXPECT_FALSE(picture_view(parallel).is_perspective);
  EXPECT_TRUE(picture_view(parallel).right.isApprox(Vector3d::UnitX()));
  EXPECT_TRUE(picture_view(parallel).up.isApprox(Vector3d::UnitZ()));
  const PictureView perspective = picture_view(perspective_camera(position, target, up, 30, {100, 200}));
  EXPECT_TRUE(perspective.is_perspective);
  EXPECT_DOUBLE_EQ(perspective.pixel_size, 5 * 2 * std::tan(15 * pi / 180) / 200);  // At the target.
}

/// @return the caption of a scene with these overrides, at a frame if one is given.
std::string caption(const std::string& text, std::optional<int> frame = {}) {
  SceneChanges changes;
  changes.frame = frame;
  const Json scale = frame ? Json::parse(R"({"keys": [[1, 0.5], [3, 1.5]]})") : Json(0.0123456);
  return read_scene_json({{"field", {{"file", "a.vdb"}, {"scale", scale}}},
                          {"light", {{"direction", {0, 0.5, -1}}}},
                          {"lights", {{{"kind", "constant"}}}},
                          {"integrator", {{"type", "scene"}}},
                          {"output", {{"caption", text}}}},
                         "scene.json", changes)
      .output.caption;
}

TEST(Captions, HaveTheValuesOfKeys) {
  EXPECT_EQ(caption("none"), "none");
  EXPECT_EQ(caption("scale {field.scale}, light along {light.direction}"), "scale 0.01235, light along 0, 0.5, -1");
  EXPECT_EQ(caption("{lights.0.kind}{light.direction.2}"), "constant-1");
  EXPECT_EQ(caption("##: {field.scale}", 2), "02: 1");
  for (const char* wrong : {"{field.sclae}", "{field.scale", "{}", "{lights.1}", "{field.scale.x}", "{lights.}"}) {
    EXPECT_THAT(message([&] { caption(wrong); }), HasSubstr("`/output/caption`")) << wrong;
  }
}

std::vector<Annotation> annotations_of(const Json& integrator, const Json& output) {
  const Json json{{"field", {{"file", "a.vdb"}}}, {"integrator", integrator}, {"output", output}};
  return read_scene_json(json, "scene.json").output.annotations;
}

TEST(Annotations, AreAListOfNames) {
  const auto named = [](const Json& names) {
    return annotations_of({{"type", "photon_distribution"}}, {{"annotations", names}});
  };
  EXPECT_THAT(named(Json::array()), IsEmpty());
  EXPECT_THAT(named({"legend", "scale"}), ElementsAre(Annotation::legend, Annotation::scale));
  EXPECT_THAT(named("axes"), ElementsAre(Annotation::axes));
  for (const Json& wrong : {Json("bar"), Json({"axes", "bar"}), Json({"axes", "axes"}), Json(true), Json({1, 2})}) {
    EXPECT_THAT(message([&] { named(wrong); }),
                HasSubstr(R"(`/output/annotations` must be a list of "scale", "axes", "legend", "body", "hidden")"));
  }
  const auto of_paths = [](const Json& color) {
    return annotations_of({{"type", "path_tracing"}, {"color", color}}, Json::object());
  };
  EXPECT_THAT(of_paths({{"legend", false}}), ElementsAre(Annotation::scale));
  for (const Json& color : {Json::object(), Json{{"legend", true}}})
    EXPECT_THAT(of_paths(color), ElementsAre(Annotation::scale, Annotation::legend));
}

// How bright scene-linear light is shown: the view and the exposure that are chosen where the scene names none.

Scene scene_shown(const Json& output) {
  return loaded({{"field", {{"generate", {{"kind", "helix"}, {"resolution", 5}}}, {"scale", 0.6}}},
                 {"integrator", {{"type", "photon_distribution"}}},
                 {"output", output}});
}

/// Pixels of these values, a hundred of each.
Render light_of(const std::vector<float>& values) {
  Render render;
  render.linear = Image(100, static_cast<int>(values.size()), {"R", "G", "B"});
  for (std::size_t i = 0; i < render.linear.pixels.size(); ++i) render.linear.pixels[i] = values[i / 300];
  return render;
}

double srgb(double linear) { return 1.055 * std::pow(linear, 1 / 2.4) - 0.055; }

TEST(Exposure, UndisturbedLightIsLightGreyAndBrightLightIsBelowWhite) {
  const Scene scene = scene_shown(Json::object());
  const std::vector<float> light{0, 0.25f, 1, 2, 6};
  const Image shown = display_image(scene, light_of(light), true);
  for (std::size_t i = 1; i < light.size(); ++i)
    EXPECT_NEAR(shown.pixels[300 * i], srgb(1 - std::exp(-light[i])), 1e-3) << light[i];
}

TEST(Exposure, IsTheScenesOrIsChosenWhereLightIsDarkOrMuchIsBright) {
  const Scene scene = scene_shown(Json::object());
  EXPECT_EQ(display_exposure(scene, light_of({0, 0, 0})), 0);
  EXPECT_EQ(display_exposure(scene, light_of({0, 0.5f, 1})), 0);
  EXPECT_EQ(display_exposure(scene, light_of({1, 8})), 0);
  EXPECT_NEAR(display_exposure(scene, light_of({0, 0.1f, 0.25f})), 2, 1e-12);
  EXPECT_NEAR(display_exposure(scene, light_of({1, 32})), -2, 1e-12);
  // Another view has the brightest hundredth below white. A scene may name the exposure.
  EXPECT_NEAR(display_exposure(scene_shown({{"view", "Un-tone-mapped"}}), light_of({1, 3.6f})), -2, 1e-6);
  EXPECT_EQ(display_exposure(scene_shown({{"exposure", -1.5}}), light_of({1, 32})), -1.5);
}

}  // namespace
}  // namespace tensorray
