// The density "mesh" of the method photon_distribution, in the whole program.

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "renderer/film/spectral_image.h"
#include "tests/data_folder.h"
#include "tests/scenes/pictures/pictures.h"

namespace tensorray {
namespace {

using namespace test;
using nlohmann::json;

class MeshLight : public Pictures {
 protected:
  MeshLight() {
    write("scene.json", R"({
      "field": { "generate": { "kind": "point_load", "resolution": 33 }, "eigenvalues": "absolute", "scale": 6 },
      "light": { "direction": [0, 0, -1], "wavelengths": { "count": 8 } },
      "receiver": { "distance": 0.5, "size": [2.6, 2.6], "resolution": [96, 96] },
      "integrator": { "type": "photon_distribution" }
    })");
  }
};

TEST_F(MeshLight, AllPowerIsAccountedFor) {
  render({});
  const json power = statistics_["power"];
  double stopped = 0;
  for (const auto& each : power["stopped"]) stopped += each.get<double>();
  EXPECT_NEAR(power["emitted"].get<double>(), 4, 1e-6);  // The volume's silhouette is a square of edge 2.
  EXPECT_NEAR(power["deposited"].get<double>() + power["missed"].get<double>() + stopped, 4, 1e-6);
  EXPECT_GT(power["deposited"].get<double>(), 3);
}

TEST_F(MeshLight, TheErrorIsBelowTheOneAskedFor) {
  const auto with_error = [&](double error) {
    return render({"light.wavelengths.count=3", "receiver.resolution=[48,48]",
                   fmt::format("integrator.density.error={}", error)});
  };
  const Image exact = with_error(0.03);
  for (const double bound : {0.3, 0.1}) {
    const double error = relative_distance(with_error(bound), exact);
    const double estimate = statistics_["error"].get<double>();
    EXPECT_LE(estimate, bound);
    EXPECT_LT(error, estimate);
    EXPECT_GT(error, estimate / 20);
  }
}

/// The mean light of blocks of 4 × 4 pixels.
std::vector<double> block_means(const Image& image) {
  const auto channel = std::find(image.channels.begin(), image.channels.end(), "G") - image.channels.begin();
  const int columns = image.width / 4, rows = image.height / 4;
  std::vector<double> means(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (int y = 0; y < 4 * rows; ++y)
    for (int x = 0; x < 4 * columns; ++x)
      means[static_cast<std::size_t>(y / 4) * columns + x / 4] += image.pixel(x, y)[channel] / 16;
  return means;
}

/// At the default tolerance the mesh shows what a histogram of many photons shows: blocks of pixels differ by 3% of the
/// picture's own light and by the noise of the photons' number, root mean square.
TEST_F(MeshLight, IsThatOfAHistogramInExampleScenes) {
  constexpr double photons = 1e5, bound = 0.03;
  struct Case {
    const char* scene;
    int resolution;
    const char* change;
  };
  for (const Case& each :
       {Case{"helix", 64, ""}, Case{"vortex", 64, ""}, Case{"point_load_photons", 64, ""},
        Case{"two_point_load", 64, ""}, Case{"hemisphere_photons_front", 64, ""},
        Case{"hemisphere_photons_side", 64, ""}, Case{"hemisphere_photons_front", 96, "field.scale=0.675"}}) {
    const auto blocks_of = [&](const char* kind) {
      Settings settings{fmt::format("receiver.resolution=[{0},{0}]", each.resolution),
                        R"(light.wavelengths={"min":549,"max":551,"count":1})",
                        fmt::format("light.photons={}", photons), fmt::format("integrator.density.kind={}", kind)};
      if (*each.change) settings.push_back(each.change);
      return block_means(
          render_all(settings, {}, 0, source_folder() / "scenes" / fmt::format("{}.json", each.scene)).linear);
    };
    const std::vector<double> expected = blocks_of("histogram");
    const json power = statistics_["power"];
    const double on_plate = power["deposited"].get<double>() / power["emitted"].get<double>() * photons;
    const std::vector<double> light = blocks_of("mesh");
    double all = 0, squares = 0, differences = 0;
    for (std::size_t i = 0; i < light.size(); ++i) {
      all += expected[i];
      squares += expected[i] * expected[i];
      differences += std::pow(light[i] - expected[i], 2);
    }
    // The variance of a number of photons is the number.
    const double noise = all * all / on_plate;
    EXPECT_LT(differences, 1.1 * noise + bound * bound * squares) << each.scene << " " << each.resolution;
    EXPECT_LT(noise, 0.005 * squares) << each.scene << ": too few photons";
  }
}

TEST_F(MeshLight, WithoutBendingTheMapIsThatOfStraightLight) {
  const Image image = render({"bending.a=0", "bending.b=0"});
  const auto at = [&](const std::string& name, int x, int y) {
    const auto channel = std::find(image.channels.begin(), image.channels.end(), name) - image.channels.begin();
    return image.pixel(x, y)[channel];
  };
  for (const int i : {20, 48, 70}) {
    EXPECT_EQ(at("folds", i, 48), 1);
    EXPECT_NEAR(at("displacement.x", i, 48), 0, 1e-5);
    EXPECT_NEAR(at("magnification.log", i, 48), 0, 1e-4);
    EXPECT_NEAR(at("magnification.major", i, 48), 0, 1e-4);
    EXPECT_NEAR(at("length", i, 48), at("length", 48, 48), 1e-5);
    EXPECT_LT(at("error", i, 48), 1e-3);
  }
  EXPECT_NEAR(at("length", 48, 48), 2.5, 0.05);  // The volume is nearly 2 high, and the plate half a unit below it.
  EXPECT_EQ(at("folds", 2, 48), 0) << "beside the silhouette";
  EXPECT_EQ(at("length", 2, 48), 0);
}

/// The magnification is that of the displacement, from pixel to pixel.
TEST_F(MeshLight, TheMapsChannelsDescribeOneMap) {
  const Image image = render({});
  const auto index = [&](const std::string& name) {
    return std::find(image.channels.begin(), image.channels.end(), name) - image.channels.begin();
  };
  const auto dx = index("displacement.x"), dy = index("displacement.y"), log = index("magnification.log"),
             major = index("magnification.major"), minor = index("magnification.minor"), folds = index("folds");
  const double pixel = 2.6 / 96;
  int compared = 0;
  for (int y = 1; y < 95; ++y)
    for (int x = 1; x < 95; ++x) {
      const float* const here = image.pixel(x, y);
      EXPECT_NEAR(here[log], here[major] + here[minor], 1e-4);
      EXPECT_GE(here[major], here[minor]);
      if (std::hypot(x - 47.5, y - 47.5) > 25 || here[folds] != 1) continue;  // Within the bright disc.
      // By the position across the beam where the light of neighbouring pixels starts; y of the plate is along −y.
      const auto slope = [&](const float* after, const float* before, int axis) {
        return (axis == 0 ? after[dx] - before[dx] : after[dy] - before[dy]) / (2 * pixel);
      };
      const float *right = image.pixel(x + 1, y), *left = image.pixel(x - 1, y), *above = image.pixel(x, y - 1),
                  *below = image.pixel(x, y + 1);
      const double a = 1 - slope(right, left, 0), b = -slope(above, below, 0), c = -slope(right, left, 1),
                   d = 1 - slope(above, below, 1);
      EXPECT_NEAR(-std::log(std::abs(a * d - b * c)), here[log], 0.15) << x << " " << y;
      ++compared;
    }
  EXPECT_GT(compared, 1000);
}

TEST_F(MeshLight, TheNumberOfBandsHardlyChangesThePicture) {
  const Image many = render({"light.wavelengths.count=64"});
  EXPECT_LT(relative_distance(render({}), many), 0.02);
  EXPECT_LT(relative_distance(render({"light.wavelengths.count=2"}), many), 0.02);
}

TEST_F(MeshLight, PhotonDifferentialsAreNearerThanPointsOfFixedWidth) {
  write("scene.json", R"({
      "field": { "generate": { "kind": "helix" } },
      "light": { "direction": [0, 0, -1], "wavelengths": { "count": 16 } },
      "receiver": { "resolution": [64, 64] },
      "integrator": { "type": "photon_distribution" }
    })");
  const Image exact = render({"integrator.density.error=0.05"});
  const auto error_of = [&](const std::string& kind, const std::string& tau) {
    return relative_distance(
        render({"integrator.density.kind=" + kind, "integrator.density.tau=" + tau, "light.photons=576"}), exact);
  };
  const double error = error_of("photon_differential", "1");
  EXPECT_LT(error, 0.5 * error_of("histogram", "1"));
  for (const char* tau : {"0.5", "1", "2", "4"}) EXPECT_LT(error, error_of("gaussian", tau)) << tau;
}

TEST_F(MeshLight, OtherOutputsDoNotChangeThePicture) {
  const Image alone = render({"light.photons=50000"});
  const Image beside = render({"light.photons=50000", "light.wavelengths.per_photon=1"},
                              {"out.spectral.exr", "photons.vdb", "light.fluence.vdb"});
  EXPECT_EQ(alone.pixels, beside.pixels);
  EXPECT_EQ(read_image(in_folder("out.spectral.exr")).channels.size(), 3 + 8u);
  EXPECT_GT(std::filesystem::file_size(in_folder("photons.vdb")), 1000u);
  EXPECT_GT(std::filesystem::file_size(in_folder("light.fluence.vdb")), 1000u);
}

TEST_F(MeshLight, ColoursOfRgbModeAreDrawnOnTheirOwn) {
  render({"bending.rgb=[0.1,0.2,0.3]"});
  EXPECT_EQ(statistics_["channels"].size(), 3u);
}

TEST_F(MeshLight, SettingsWithoutEffectAndErrorsThatCannotBeReachedAreTold) {
  const std::pair<Settings, const char*> cases[] = {
      {{"integrator.density.tau=3"}, "`/integrator/density/tau` has no effect"},
      {{"integrator.density.error=0.01", "integrator.density.kind=histogram"},
       "`/integrator/density/error` has no effect: it belongs to the density \"mesh\""},
      {{"integrator.density.error=0.001"}, "raise `light.photons`"}};
  for (const auto& [settings, warning] : cases) {
    Settings few = settings;
    few.push_back("light.photons=2000");
    render(few);
    EXPECT_THAT(notes_, ::testing::Contains(::testing::HasSubstr(warning)));
  }
}

}  // namespace
}  // namespace tensorray
