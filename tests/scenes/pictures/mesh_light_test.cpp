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

TEST_F(MeshLight, OtherOutputsDoNotChangeThePicture) {
  const Image alone = render({"light.photons=50000"});
  const Image beside = render({"light.photons=50000", "light.wavelengths.per_photon=1"},
                              {"out.spectral.exr", "photons.vdb", "light.fluence.vdb"});
  EXPECT_EQ(alone.pixels, beside.pixels);
  EXPECT_EQ(read_image(in_folder("out.spectral.exr")).channels.size(), 3 + 8u);
  EXPECT_GT(std::filesystem::file_size(in_folder("photons.vdb")), 1000u);
  EXPECT_GT(std::filesystem::file_size(in_folder("light.fluence.vdb")), 1000u);
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
