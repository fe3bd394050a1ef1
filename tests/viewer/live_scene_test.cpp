// A scene whose keys change: its pictures are those of a scene that is loaded anew, bit for bit.

#include "scenes/outputs/picture_outputs.h"
#include "tests/viewer/view_support.h"
#include "tools/viewer/stages.h"

namespace tensorray {
namespace {

class LiveSceneTest : public test::ViewTest {
 protected:
  std::vector<std::filesystem::path> outputs_{in_folder("p.png"), in_folder("p.exr")};
  Progress progress_;

  Image shown(LiveScene& live, const Json& scene) {
    live.load(scene, outputs_, progress_);
    return display_image(live.scene(), *live.render(progress_), false);
  }
};

TEST_F(LiveSceneTest, PicturesAfterChangesAreThoseOfANewScene) {
  LiveScene live(scene_file());
  Json scene = test::small_scene();
  std::vector<Json> versions{scene};
  const auto change = [&](const char* pointer, const Json& value) {
    scene[Json::json_pointer(pointer)] = value;
    versions.push_back(scene);
  };
  change("/output", {{"exposure", 1}});
  change("/receiver/distance", 0.7);
  change("/receiver/distance", 0.72);
  change("/output/white_balance", false);
  change("/receiver/distance", 0.9);
  change("/light/wavelengths/count", 5);
  change("/field/scale", "auto");
  change("/receiver/normal", {0.2, 0, 1});
  change("/light/direction", "auto");
  change("/field/eigenvalues", "raw");
  change("/integrator/density", {{"kind", "histogram"}});
  change("/integrator/type", "lens");
  change("/output/exposure", -1);
  versions.push_back(test::small_scene());
  for (const Json& version : versions) {
    LiveScene anew(scene_file());
    const Image picture = shown(live, version), expected = shown(anew, version);
    ASSERT_EQ(picture.pixels, expected.pixels) << version;
    EXPECT_EQ(live.scene().scale.scale, anew.scene().scale.scale);
  }
}

TEST_F(LiveSceneTest, ARecolouredPictureIsNotRenderedAgain) {
  LiveScene live(scene_file());
  Json scene = test::small_scene();
  shown(live, scene);
  const auto render = live.render(progress_);
  scene["output"]["exposure"] = 2;
  EXPECT_TRUE(live.has_picture(scene, outputs_));
  live.load(scene, outputs_, progress_);
  EXPECT_EQ(live.render(progress_), render);
  scene["receiver"]["distance"] = 0.5;
  EXPECT_FALSE(live.has_picture(scene, outputs_));
  live.load(scene, outputs_, progress_);
  EXPECT_NE(live.render(progress_), render);
}

TEST_F(LiveSceneTest, RaysThroughTheVolumeAreKept) {
  LiveScene live(scene_file());
  Json scene = test::small_scene();
  const auto samples = [&](LiveScene& of) {
    of.load(scene, outputs_, progress_);
    return of.render(progress_)->statistics.tensor_samples;
  };
  samples(live);
  scene["output"]["white_balance"] = false;  // From now on the rays are remembered.
  samples(live);
  scene["light"]["wavelengths"]["count"] = 12;
  EXPECT_EQ(samples(live), 0u);
  scene["receiver"]["distance"] = 0.6;
  LiveScene anew(scene_file());
  EXPECT_LT(2 * samples(live), samples(anew));
  scene["field"]["scale"] = 4.5;
  LiveScene another(scene_file());
  EXPECT_EQ(samples(live), samples(another));
}

TEST_F(LiveSceneTest, ThePolariscopeTracesOnceForAllArrangements) {
  LiveScene live(scene_file());
  Json scene = test::small_scene();
  scene["integrator"] = {{"type", "polariscope"}};
  shown(live, scene);
  const auto kept = live.scene().kept;
  for (const double angle : {10.0, 40.0}) {
    scene["integrator"]["analyzer"] = angle;
    LiveScene anew(scene_file());
    EXPECT_EQ(shown(live, scene).pixels, shown(anew, scene).pixels) << angle;
    EXPECT_EQ(live.scene().kept, kept);
  }
  scene["field"]["generate"]["resolution"] = 9;
  LiveScene anew(scene_file());
  EXPECT_EQ(shown(live, scene).pixels, shown(anew, scene).pixels);
  EXPECT_NE(live.scene().kept, kept);
}

TEST_F(LiveSceneTest, StaysAsItWasWhereASceneIsWrong) {
  LiveScene live(scene_file());
  Json scene = test::small_scene();
  const Image before = shown(live, scene);
  const float* const voxels = live.scene().field.brick({0, 0, 0}).bending;
  Json wrong = scene;
  wrong["receiver"]["size"] = {1e30, 1};
  EXPECT_THROW(live.load(wrong, outputs_, progress_), SceneError);
  wrong["receiver"] = {{"unknown", 1}};
  EXPECT_THROW(live.load(wrong, outputs_, progress_), SceneError);
  // With another field, loading begins anew.
  wrong = scene;
  wrong["field"] = {{"file", "missing.vdb"}};
  EXPECT_THROW(live.load(wrong, outputs_, progress_), std::runtime_error);
  EXPECT_EQ(live.scene().field.brick({0, 0, 0}).bending, voxels);
  EXPECT_TRUE(live.has_picture(scene, outputs_));
  wrong["field"] = {{"generate", {{"kind", "vortex"}, {"resolution", 12}}}, {"scale", "auto"}};
  progress_.cancelled = true;
  EXPECT_THROW(live.load(wrong, outputs_, progress_), Cancelled);
  progress_.cancelled = false;
  EXPECT_EQ(shown(live, scene).pixels, before.pixels);
  EXPECT_EQ(live.scene().field.brick({0, 0, 0}).bending, voxels);
}

}  // namespace
}  // namespace tensorray
