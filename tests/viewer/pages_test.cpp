#include "tools/viewer/pages.h"

#include <cstdlib>
#include <future>
#include <set>

#include <sys/stat.h>

#include "renderer/images/image.h"
#include "scenes/outputs/picture_outputs.h"
#include "tests/data_folder.h"
#include "tests/viewer/view_support.h"
#include "tools/viewer/stages.h"
#include "volumes/files/tensor_files.h"
#include "volumes/making/generators.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

class PagesTest : public test::ViewTest {
 protected:
  Progress progress_;
  test::Mailbox page_, other_;
  Pages pages_{viewed(), progress_};
  Json scene_ = test::small_scene();

  PagesTest() { page_.open(pages_); }

  Image picture_of(const test::Received& message, const std::string& ending) {
    write_bytes(in_folder("received" + ending), message.bytes);
    return read_image(in_folder("received" + ending));
  }
};

TEST_F(PagesTest, SendsACoarsePictureThenTheOneOfRender) {
  const test::Received last = page_.picture_of_scene(1, test::small_scene());
  const Json first = page_.wait("picture", 1).json;
  EXPECT_EQ(first.at("stage"), 0);
  EXPECT_LT(first.at("width"), 64);
  EXPECT_EQ(last.json.at("width"), 64);
  EXPECT_EQ(last.json.at("/chosen/field/scale"_json_pointer), 4);

  LiveScene anew(scene_file());
  anew.load(test::small_scene(), {in_folder("p.png"), in_folder("p.exr")}, progress_);
  const auto render = anew.render(progress_);
  const std::vector<unsigned char> expected_png = encode_for_screen(display_image(anew.scene(), *render, false));
  EXPECT_EQ(last.bytes, std::string(expected_png.begin(), expected_png.end()));

  const test::Received file = page_.answer("file", {{"type", "export"}, {"id", 2}, {"file", "exr"}});
  EXPECT_EQ(file.json.at("name"), "scene.exr");
  write_image(in_folder("expected.exr"), render->linear);
  const Image exported = picture_of(file, ".exr"), expected = read_image(in_folder("expected.exr"));
  EXPECT_EQ(exported.channels, expected.channels);
  EXPECT_EQ(exported.pixels, expected.pixels);
}

/// Of light that is traced, the finished picture is there at once.
TEST_F(PagesTest, ATurnedAnalyserHasNoCoarsePicture) {
  const auto first_picture = [&](int id, const Json& scene) {
    page_.picture_of_scene(id, scene);
    return page_.wait("picture", id).json;
  };
  scene_["integrator"] = {{"type", "polariscope"}};
  EXPECT_LT(first_picture(1, scene_).at("width"), 64);
  scene_["integrator"]["analyzer"] = 10;
  const Json turned = first_picture(2, scene_);
  EXPECT_EQ(turned.at("width"), 64);
  EXPECT_TRUE(turned.at("final"));
  EXPECT_EQ(picture_of(page_.final_picture(2), ".png").width, 64);
  scene_["integrator"]["samples"] = 1;  // All is traced again.
  EXPECT_LT(first_picture(3, scene_).at("width"), 64);
}

/// Scenes that come while the page's thread is busy: here, while it sends its first message.
TEST_F(PagesTest, TheNewestSceneWins) {
  std::promise<void> all_sent;
  const std::shared_future<void> is_free = all_sent.get_future().share();
  const auto receive = other_.sender();
  const Pages::Id page = pages_.open([receive, is_free](const PageMessage& message) {
    is_free.wait();
    receive(message);
  });
  for (int id = 1; id <= 40; ++id) {
    scene_["field"]["scale"] = 4 + 0.01 * id;
    pages_.receive(page, test::scene_message(id, scene_).dump());
  }
  all_sent.set_value();
  EXPECT_NEAR(other_.final_picture(40).json.at("/chosen/field/scale"_json_pointer).get<double>(), 4.4, 1e-9);
  std::set<int> shown;
  for (const test::Received& message : other_.all())
    if (message.json.at("type") == "picture") shown.insert(message.json.at("id").get<int>());
  // The thread had either not begun, or shows the first picture of the scene that it had.
  EXPECT_LE(shown.size(), 2u);
  EXPECT_EQ(*shown.rbegin(), 40);
}

TEST_F(PagesTest, TellsAboutAPixelAndTheLightThere) {
  page_.picture_of_scene(1, test::small_scene());
  // The spectrum comes with a further picture, which is made while nothing else is to be done.
  page_.wait("details", 1);
  const Json answer = page_.answer("look", {{"type", "look"}, {"id", 2}, {"x", 0.3}, {"y", 0.4}}).json;
  EXPECT_EQ(answer.at("spectrum").at("nm").size(), 8u);
  ASSERT_GE(answer.at("rays").size(), 3u);
  // Each ray ends at the place of the plate that was asked for.
  const Json plate = page_.answer("space", {{"type", "space"}, {"id", 300}}).json.at("plate");
  const auto vector = [](const Json& json) { return Vector3d(json[0], json[1], json[2]); };
  const Vector3d right = vector(plate[1]) - vector(plate[0]), up = vector(plate[3]) - vector(plate[0]);
  const Vector3d expected = vector(plate[3]) + 0.3 * right - 0.4 * up;
  for (const Json& ray : answer.at("rays"))
    EXPECT_LT((vector(ray.at("points").back()) - expected).norm(), 0.03 * right.norm()) << ray;
}

/// A picture of a camera has bands of its own, fewer than the light has or more.
TEST_F(PagesTest, APixelHasTheBandsOfItsPicture) {
  scene_["integrator"] = {{"type", "path_tracing"}, {"bands", 6}, {"max_samples", 1}, {"min_samples", 1}};
  scene_["camera"] = {{"resolution", {16, 16}}};
  for (const int count : {3, 12}) {
    scene_["light"]["wavelengths"]["count"] = count;
    page_.picture_of_scene(count, scene_);
    const Json look{{"type", "look"}, {"id", 100 + count}, {"x", 0}, {"y", 0}};
    const Json spectrum = page_.answer("look", look).json.at("spectrum");
    EXPECT_EQ(spectrum.at("nm").size(), 6u);
    for (const Json& value : spectrum.at("values")) EXPECT_TRUE(value >= 0 && value < 100) << value;
  }
}

TEST_F(PagesTest, SavesToItsOwnFileAlone) {
  scene_["field"]["scale"] = 7;
  const std::filesystem::path copy = in_folder("scene.view.json");
  EXPECT_EQ(page_.answer("saved", {{"type", "save"}, {"id", 5}, {"scene", scene_}}).json.at("file"), copy.string());
  EXPECT_EQ(read_json_object(copy), scene_);
  EXPECT_EQ(read_json_object(scene_file()), test::small_scene());
  Json wrong = scene_;
  wrong["nonsense"] = 1;
  page_.answer("error", {{"type", "save"}, {"id", 6}, {"scene", wrong}});
  EXPECT_EQ(read_json_object(copy), scene_);
  EXPECT_THROW(Pages({scene_file(), {}, scene_file()}, progress_), std::invalid_argument);
  std::filesystem::remove(copy);
  ASSERT_EQ(mkfifo(copy.c_str(), 0600), 0);  // To open it would wait for a reader.
  page_.answer("error", {{"type", "save"}, {"id", 7}, {"scene", scene_}});
}

TEST_F(PagesTest, RefusesInOneLineAndGoesOn) {
  Json foreign = scene_, huge = foreign, unknown = foreign, field = foreign;
  foreign["obstacles"] = {{{"file", "/etc/passwd"}}};
  huge["receiver"]["resolution"] = {30000, 30000};
  unknown["ligth"] = 1;
  field["field"] = {{"file", "/dev/zero"}};
  int id = 10;
  for (const Json& scene : {foreign, huge, unknown, field})
    EXPECT_THAT(page_.refusal_of(test::scene_message(++id, scene)), Not(HasSubstr("\n")));
  // The fuzzer `page` sends others.
  const std::vector<std::string> wrong{"{", R"({"type":"shutdown"})", R"({"type":"scene","scene":[]})",
                                       R"({"type":"export","file":"../x"})", std::string(100000, '[')};
  for (const std::string& text : wrong) page_.send_text(text);
  for (int i = 0; i < 1000; ++i) page_.send({{"type", "look"}, {"id", 1000 + i}, {"x", 1e308}, {"y", -1e308}});
  page_.picture_of_scene(20, test::small_scene());
  std::size_t errors = 0;
  for (const test::Received& message : page_.all()) errors += message.json.at("type") == "error" ? 1 : 0;
  EXPECT_GE(errors, 4 + wrong.size());
}

/// A page that comes while another one looks at another field.
TEST_F(PagesTest, AllPagesBeginWithTheSameField) {
  scene_["field"]["generate"]["resolution"] = 7;
  page_.picture_of_scene(1, scene_);
  other_.open(pages_);
  EXPECT_EQ(other_.hello().at("field").at("voxels")[0], 12);
}

/// The field that an import made has a name that the user has never seen.
TEST_F(PagesTest, AnImportHasTheNameOfItsFile) {
  write_tensor_vdb(in_folder("made.vdb"), generate(Helix{}, default_grid(Helix{}, 9)));
  const std::filesystem::path mesh = in_folder("part.vtu");
  write_bytes(mesh, "a mesh");
  ViewedScene viewed{mesh, {"receiver.resolution=[16,16]", "light.photons=1000"}, ""};
  viewed.imported = in_folder("made.vdb");
  test::Mailbox page;
  Pages pages(viewed, progress_);
  page.open(pages);
  const Json hello = page.hello(), scene = hello.at("scene");
  EXPECT_EQ(hello.at("file"), mesh.string());
  EXPECT_EQ(scene.at("field").at("file"), mesh.string());
  EXPECT_EQ(hello.at("field").at("voxels")[0], 9);
  Json wrong = scene, other = scene;
  wrong["light"]["photons"] = -1;
  other["field"]["file"] = "other.vdb";
  EXPECT_THAT(page.refusal_of(test::scene_message(1, wrong)), HasSubstr("part.vtu"));
  EXPECT_THAT(page.refusal_of(test::scene_message(4, other)), HasSubstr("this view shows"));
  page.picture_of_scene(2, scene);
  EXPECT_EQ(page.answer("file", {{"type", "export"}, {"id", 3}, {"file", "png"}}).json.at("name"), "part.png");
  for (const test::Received& message : page.all()) EXPECT_THAT(message.json.dump(), Not(HasSubstr("made.vdb")));
}

TEST_F(PagesTest, RequestsWaitForTheSceneBeforeThem) {
  std::promise<Pages::Id> opened;
  std::future<Pages::Id> id = opened.get_future();
  const Pages::Send send = other_.sender();
  opened.set_value(pages_.open([this, &id, send](const PageMessage& message) {
    if (test::received(message).json.at("type") == "hello") {  // Its thread then looks for more requests.
      const Pages::Id page = id.get();
      pages_.receive(page, test::scene_message(1, test::small_scene()).dump());
      pages_.receive(page, Json{{"type", "space"}, {"id", 2}}.dump());
    }
    send(message);
  }));
  const Json answer = other_.wait({{"id", 2}}).json;
  EXPECT_EQ(answer.at("type"), "space") << answer;
}

TEST_F(PagesTest, PagesDoNotDisturbEachOther) {
  other_.open(pages_);
  scene_["field"]["generate"]["kind"] = "two_point_load";
  other_.send(test::scene_message(1, scene_));
  const test::Received mine = page_.picture_of_scene(1, test::small_scene()), theirs = other_.final_picture(1);
  EXPECT_NE(mine.bytes, theirs.bytes);
  EXPECT_EQ(page_.picture_of_scene(2, test::small_scene()).bytes, mine.bytes);
  other_.close();
  page_.picture_of_scene(3, test::small_scene());
}

// The page of the live view in a real browser, with a real server: tools/viewer/page/test/page_test.mjs.

bool runs(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }

class Browser : public test::ViewTest {};

TEST_F(Browser, ThePageFollowsItsUser) {
  const fs::path program(TENSORRAY_VIEW_PROGRAM), page = test::source_folder() / "tools" / "viewer" / "page";
  const fs::path built = program.parent_path().parent_path() / "view";
  if (!fs::exists(built / "view.js")) GTEST_SKIP() << "the page is not built (tools/viewer/page/build " << built << ")";
  if (!fs::exists(page / "node_modules" / "puppeteer-core")) GTEST_SKIP() << "puppeteer-core is not installed";
  if (!runs("node --version") || !runs("chromium --version")) GTEST_SKIP() << "node or chromium is not installed";
  const std::string command = "node '" + (page / "test" / "page_test.mjs").string() + "' '" + program.string() + "' '" +
                              scene_file().string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

// A scene whose keys change: its pictures are those of a scene that is loaded anew, bit for bit.

class LiveSceneTest : public test::ViewTest {
 protected:
  std::vector<std::filesystem::path> outputs_{in_folder("p.png"), in_folder("p.exr")};
  Progress progress_;
  LiveScene live_{scene_file()};
  Json scene_ = test::small_scene();

  Image shown(LiveScene& live, const Json& scene) {
    live.load(scene, outputs_, progress_);
    return display_image(live.scene(), *live.render(progress_), false);
  }
  void expect_as_anew(const Json& scene) {
    LiveScene anew(scene_file());
    EXPECT_TRUE(shown(live_, scene).pixels == shown(anew, scene).pixels) << scene;
    EXPECT_EQ(live_.scene().scale.scale, anew.scene().scale.scale) << scene;
  }
};

TEST_F(LiveSceneTest, PicturesAfterChangesAreThoseOfANewScene) {
  expect_as_anew(scene_);
  const auto change = [&](const char* pointer, const Json& value) {
    scene_[Json::json_pointer(pointer)] = value;
    expect_as_anew(scene_);
  };
  change("/output", {{"exposure", 1}});
  change("/receiver/distance", 0.7);
  change("/receiver/distance", 0.72);
  change("/output/white_balance", false);
  change("/receiver/distance", 0.9);
  change("/light/wavelengths/count", 5);
  change("/field/scale", "auto");
  change("/receiver/normal", {0.2, 0, 1});
  change("/integrator/density", {{"kind", "histogram"}});
  change("/light/direction", "auto");  // Of 26, which takes long.
  change("/field/eigenvalues", "raw");
  change("/integrator/type", "lens");
  change("/world", {{"up", "y"}});
  change("/light/direction", {0, 0, -1});
  change("/output/exposure", -1);
  change("/camera", {{"direction", {0, -1, 0}}, {"resolution", {8, 8}}});
  const Json few{{"rays", 1024}, {"passes", 1}, {"resolution", 32}};
  change("/integrator", {{"type", "scene"}, {"max_samples", 1}, {"min_samples", 1}, {"caustic", few}});
  change("/camera/direction", {1, 0, 0});
  expect_as_anew(test::small_scene());
}

TEST_F(LiveSceneTest, ARecolouredPictureIsNotRenderedAgain) {
  shown(live_, scene_);
  const auto render = live_.render(progress_);
  scene_["output"]["exposure"] = 2;
  EXPECT_TRUE(live_.has_picture(scene_, outputs_));
  live_.load(scene_, outputs_, progress_);
  EXPECT_EQ(live_.render(progress_), render);
  scene_["receiver"]["distance"] = 0.5;
  EXPECT_FALSE(live_.has_picture(scene_, outputs_));
  live_.load(scene_, outputs_, progress_);
  EXPECT_NE(live_.render(progress_), render);
}

TEST_F(LiveSceneTest, StaysAsItWasWhereASceneIsWrong) {
  const Image before = shown(live_, scene_);
  const float* const voxels = live_.scene().field.brick({0, 0, 0}).bending;
  Json wrong = scene_;
  wrong["receiver"]["size"] = {1e30, 1};
  EXPECT_THROW(live_.load(wrong, outputs_, progress_), SceneError);
  wrong["receiver"] = {{"unknown", 1}};
  EXPECT_THROW(live_.load(wrong, outputs_, progress_), SceneError);
  // With another field, loading begins anew.
  wrong = scene_;
  wrong["field"] = {{"file", "missing.vdb"}};
  EXPECT_THROW(live_.load(wrong, outputs_, progress_), std::runtime_error);
  EXPECT_EQ(live_.scene().field.brick({0, 0, 0}).bending, voxels);
  EXPECT_TRUE(live_.has_picture(scene_, outputs_));
  wrong["field"] = {{"generate", {{"kind", "vortex"}, {"resolution", 12}}}, {"scale", "auto"}};
  progress_.cancelled = true;
  EXPECT_THROW(live_.load(wrong, outputs_, progress_), Cancelled);
  progress_.cancelled = false;
  EXPECT_EQ(shown(live_, scene_).pixels, before.pixels);
  EXPECT_EQ(live_.scene().field.brick({0, 0, 0}).bending, voxels);
}

TEST_F(LiveSceneTest, ThePolariscopeTracesOnceForAllArrangements) {
  scene_["integrator"] = {{"type", "polariscope"}};
  shown(live_, scene_);
  const auto kept = live_.scene().kept;
  for (const double angle : {10.0, 40.0}) {
    scene_["integrator"]["analyzer"] = angle;
    expect_as_anew(scene_);
    EXPECT_EQ(live_.scene().kept, kept);
  }
  scene_["field"]["generate"]["resolution"] = 9;
  expect_as_anew(scene_);
  EXPECT_NE(live_.scene().kept, kept);
}

}  // namespace
}  // namespace tensorray
