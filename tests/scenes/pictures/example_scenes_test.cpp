// The example scenes render, and their pictures have the features of the paper's figures.

#include "tests/data_folder.h"
#include "tests/scenes/pictures/pictures.h"

namespace tensorray {
namespace {

std::vector<std::filesystem::path> scenes_in(const char* folder) {
  std::vector<std::filesystem::path> scenes;
  for (const auto& entry : std::filesystem::directory_iterator(source_folder() / folder)) {
    const bool is_copy = entry.path().stem().extension() == ".view";  // Of a live view.
    if (entry.path().extension() == ".json" && !is_copy) scenes.push_back(entry.path());
  }
  return scenes;
}

std::string name_of(const testing::TestParamInfo<std::filesystem::path>& scene) { return scene.param.stem().string(); }

class ExampleScene : public Pictures, public ::testing::WithParamInterface<std::filesystem::path> {
 protected:
  /// Renders the scene, whose light bends.
  Image picture(const Settings& settings) {
    const Image image = render_all(settings, {}, 0, GetParam()).linear;
    const std::string text = bytes_of(GetParam());
    if (text.find("\"scale\"") == std::string::npos && text.find("\"polariscope\"") == std::string::npos) {
      EXPECT_THAT(notes_, Contains(HasSubstr("the median ray turns by")));
    }
    expect_finite(image);
    EXPECT_LT(*std::min_element(image.pixels.begin(), image.pixels.end()), 0.1f);
    EXPECT_GT(greatest(image.pixels), 0.5f);
    return image;
  }
};

TEST_P(ExampleScene, RendersAndBendsLight) {
  picture({"light.photons=4000", "receiver.resolution=[48,48]", "light.wavelengths.count=8",
           "camera.resolution=[48,48]", "integrator.max_samples=4"});
}

INSTANTIATE_TEST_SUITE_P(Scenes, ExampleScene, testing::ValuesIn(scenes_in("scenes")), name_of);

double luminance(const Image& image, int x, int y) {
  const float* pixel = image.pixel(x, y);
  return 0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2];
}

class WholeExample : public ExampleScene {};

/// Those of the method "scene": no pixel is above 20 times the median of those around it.
TEST_P(WholeExample, HasNoFireflies) {
  const Image image = picture({"camera.resolution=[48,36]", "integrator.max_samples=32",
                               "integrator.caustic.resolution=256", "integrator.caustic.rays=16384"});
  for (int y = 1; y + 1 < image.height; ++y)
    for (int x = 1; x + 1 < image.width; ++x) {
      std::vector<double> around;
      for (int i = 0; i < 9; ++i)
        if (i != 4) around.push_back(luminance(image, x - 1 + i % 3, y - 1 + i / 3));
      std::nth_element(around.begin(), around.begin() + 4, around.end());
      EXPECT_LE(luminance(image, x, y), 20 * std::max(around[4], 1e-3)) << x << " " << y;
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, WholeExample, testing::ValuesIn(scenes_in("scenes/whole")), name_of);

/// A picture of a point load. The plate reaches from −1.3 to 1.3 along both axes.
class PointLoadPicture : public Pictures {
 protected:
  Image picture(const std::string& scene, const Settings& more = {}) {
    const Settings settings{"light.photons=40000", "light.wavelengths.count=16", "receiver.resolution=[130,130]",
                            "receiver.size=[2.6,2.6]", "field.generate.resolution=49"};
    return render_all(joined(settings, more), {}, 0, source_folder() / "scenes" / scene).linear;
  }

  /// Mean colour on a ring about the picture's middle; radii in world units.
  static Vector3d ring(const Image& image, double from, double to) {
    Vector3d sum = Vector3d::Zero();
    int count = 0;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const double r = 0.02 * std::hypot(x + 0.5 - 65, y + 0.5 - 65);
        if (r < from || r >= to) continue;
        sum += Vector3f(image.pixel(x, y)).cast<double>();
        ++count;
      }
    return sum / count;
  }
};

TEST_F(PointLoadPicture, WithThePushThereIsADarkDiscWithARedRim) {
  for (const Settings& light : {Settings{}, {"bending.rgb=[0.1,0.2,0.3]"}}) {
    const Image image = picture("point_load_photons.json", light);
    EXPECT_LT(ring(image, 0, 0.2).maxCoeff(), 0.03);
    // Red bends outwards the least. From the centre outwards red begins first, then green, then blue.
    Vector3d begins = Vector3d::Zero();
    for (int colour = 0; colour < 3; ++colour)
      for (double r = 0.02; begins[colour] == 0 && r < 1.2; r += 0.02)
        if (ring(image, r, r + 0.02)[colour] > 0.3) begins[colour] = r;
    EXPECT_GT(begins[0], 0.4);
    EXPECT_GT(begins[1], begins[0] + 0.05);
    EXPECT_GT(begins[2], begins[1] + 0.03);
    EXPECT_LT(begins[2], 1.2);
    if (light.empty()) continue;
    // One flexibility per colour gives a sharp edge: dark to bright within three standard deviations of the estimate.
    EXPECT_LT(ring(image, begins[0] - 0.08, begins[0] - 0.06).x(), 0.05);
    EXPECT_GT(ring(image, begins[0] + 0.04, begins[0] + 0.06).x(), 0.9);
  }
}

}  // namespace
}  // namespace tensorray
