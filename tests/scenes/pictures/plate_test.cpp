// The method photon_distribution: colours, places and statistics of light on a plate.

#include <functional>

#include <fmt/format.h>

#include "renderer/film/spectral_image.h"
#include "tests/scenes/pictures/pictures.h"
#include "tests/scenes/small_scene.h"
#include "volumes/files/tensor_files.h"

namespace tensorray {
namespace {

class PlatePicture : public Pictures {
 protected:
  PlatePicture() { write("scene.json", small_scene()); }
  /// Light that goes straight.
  void remove_field() const {
    const std::string none = R"({"kind": "constant", "resolution": 9, "tensor": [[0, 0, 0], [0, 0, 0], [0, 0, 0]]})";
    write("scene.json", small_scene(R"({"generate": )" + none + "}"));
  }
};

TEST_F(PlatePicture, WithoutAFieldItIsNeutralAndUniform) {
  remove_field();
  for (const std::string illuminant : {"D65", "A", "blackbody 3000"}) {
    const Image image = render({"light.pattern=grid", "light.photons=40000", "receiver.size=[1.5,1.5]",
                                "light.spectrum=" + illuminant, "receiver.resolution=[64,64]"});
    ASSERT_EQ(image.channels.size(), 3u);
    using Rows = Eigen::Array<float, 64, 3 * 64, Eigen::RowMajor>;
    // Six standard deviations of the estimate away from the edge of the plate.
    const auto inner = Eigen::Map<const Rows>(image.pixels.data()).block(12, 3 * 12, 40, 3 * 40).cast<double>();
    EXPECT_NEAR(inner.mean(), 1, 0.02) << illuminant;
    // Light starts every 0.427 pixels. The spline of the estimate leaves 2 sinc(2.34)^4 = 4e-4 of this lattice along
    // each axis, and the blur 2e-4 of that: 3e-7 from the darkest pixel to the brightest. Others are of rounding.
    EXPECT_LT((inner.maxCoeff() - inner.minCoeff()) / inner.mean(), 2e-6) << illuminant;
  }
}

TEST_F(PlatePicture, WithoutWhiteBalanceItHasTheLightsColour) {
  remove_field();
  const Image image = render(
      {"light.spectrum=A", "output.white_balance=false", R"(light.wavelengths={"min":360,"max":830,"count":4})"});
  const float* rgb = image.pixel(16, 16);
  // Illuminant A, x = 0.4476, y = 0.4074, in linear Rec. 709 (IEC 61966-2-1) at Y = 1.
  const double X = 0.4476 / 0.4074, Z = (1 - 0.4476 - 0.4074) / 0.4074;
  const double red = 3.2406 * X - 1.5372 - 0.4986 * Z, green = -0.9689 * X + 1.8758 + 0.0415 * Z;
  const double blue = 0.0557 * X - 0.2040 + 1.0570 * Z;
  EXPECT_NEAR(rgb[0] / rgb[1], red / green, 3e-3);
  EXPECT_NEAR(rgb[2] / rgb[1], blue / green, 3e-3);
}

/// Valid, but unusual. Of one voxel across, see TensorField::index_bounds.
TEST_F(PlatePicture, OddFieldsAreRendered) {
  write("scene.json", small_scene(R"({"file": "odd.vdb"})"));
  const auto render_field = [&](int last, const std::function<Matrix3d(const Vector3i&)>& tensor) {
    write_tensor_vdb(in_folder("odd.vdb"),
                     dense_grid({Vector3i(0, 0, 0), Vector3i(8, 8, last)}, Affine3d::Identity(), tensor));
    render_all({"light.direction=[1,2,-3]"});
  };
  const Matrix3d plain = Vector3d(1, -3, 2).asDiagonal();
  render_field(0, [&](const Vector3i&) { return plain; });
  render_field(8, [&](const Vector3i&) -> Matrix3d { return 1e30 * plain; });
  render_field(8, [&](const Vector3i& at) -> Matrix3d {
    return (at == Vector3i(4, 4, 4) ? NAN : at == Vector3i(2, 3, 4) ? INFINITY : 1) * plain;
  });
  EXPECT_THAT(notes_, Contains(testing::ContainsRegex("odd.vdb.*2 of 729 voxels are not finite")));
  EXPECT_EQ(statistics_["field"]["non_finite_voxels"], 2);
  EXPECT_EQ(statistics_["photons"]["stopped"]["degenerate"], 0);
  EXPECT_THAT(message([&] { render_field(-1, [&](const Vector3i&) { return plain; }); }), HasSubstr("active voxel"));
}

TEST_F(PlatePicture, RgbModeIsThePapers) {
  EXPECT_EQ(render({"bending.rgb=[0.1,0.2,0.3]"}).channels.size(), 3u);
  const Image grey = render({"bending.rgb=[0.2,0.2,0.2]"});  // Equal flexibilities give no colour at all.
  for (const char* other : {"G", "B"})
    EXPECT_THAT(channel(grey, other), testing::Pointwise(testing::FloatNear(1e-5f), channel(grey, "R"))) << other;
}

TEST_F(PlatePicture, OddLightIsWarnedOf) {
  for (const auto& [setting, pattern] : std::vector<std::pair<std::string, std::string>>{
           {"bending.a=0.5", "negative"},
           {"bending.max_steps=1", "[0-9]+% of the rays.*max_steps"},
           {"field.scale=1e-6", "light turns too little to be seen: `field.scale` .* shows"},
           {"field.scale=3e4", "light is tangled: `field.scale` .* shows"},
           {"field.scale=-1", "negative: light bends the other way"},
           {"receiver={\"center\":[0,0,9],\"size\":[1,1]}", "the plate lies before the volume"},
           {"receiver={\"center\":[0,0,-0.5],\"size\":[1,1]}", "the plate lies in the volume"},
           {R"(field.generate={"kind":"constant","tensor":[[1,0,0],[0,1,0],[0,0,1]]})", "no probe ray is turned"}}) {
    render_all({setting});
    EXPECT_THAT(notes_, Contains(testing::ContainsRegex(pattern))) << setting;
  }
  render_all({"light.beam=volume", "receiver={\"center\":[900,0,-3],\"size\":[1,1]}"});
  EXPECT_THAT(notes_, Contains(HasSubstr("no light reached the plate")));
  for (const char* straight : {"bending={\"a\":0,\"b\":0}", "bending.rgb=[0.1,0,0.3]"}) {
    render_all({"field.scale=1e-6", straight});
    EXPECT_THAT(notes_, Not(Contains(HasSubstr("inf")))) << straight;
  }
}

TEST_F(PlatePicture, IsSeenAlongTheLightAnywhere) {
  remove_field();
  const auto column_of_light = [&](const Settings& receiver) {
    const Image image = render(joined(receiver, {R"(light.aperture={"center":[0.5,0,0],"size":[0.5,0.5]})"}));
    double moment = 0;
    for (int i = 0; i < 32 * 32; ++i) moment += image.pixel(i % 32, i / 32)[1] * (i % 32 + 0.5);
    return moment / sum(channel(image, "G"));
  };
  const std::string size = "receiver.size=[2,2]";
  EXPECT_NEAR(column_of_light({size}), 24, 0.2);
  EXPECT_NEAR(column_of_light({size, "receiver.normal=[0,0,-1]"}), 24, 0.2);  // The opposite normal.
  EXPECT_NEAR(column_of_light({size, "receiver.center=[0,0,5]"}), 24, 0.2);   // A plate before the volume.
  EXPECT_NEAR(column_of_light({size, "receiver.center=[0,0,0]"}), 24, 0.2);   // A plate in the volume.
  EXPECT_NEAR(column_of_light({"receiver.size=[4000,4000]", "receiver.distance=1e4"}), 16, 0.2);
}

double sum_of_ends(const nlohmann::json& counts) {
  double sum = counts["deposited"].get<double>() + counts["missed"].get<double>() + counts.value("side", 0.0);
  for (const auto& [reason, stopped] : counts["stopped"].items()) sum += stopped.get<double>();
  return sum;
}

TEST_F(PlatePicture, BalancesWithEveryMethodAndEnd) {
  const std::vector<Settings> cases{{"integrator.density.kind=mesh"},
                                    {"integrator.density.kind=mesh", "integrator.side_light=false"},
                                    {"integrator.density.kind=gaussian", "integrator.side_light=false"},
                                    {"integrator.density.kind=histogram", "bending.max_steps=20"},
                                    {"integrator.type=lens"}};
  for (const Settings& settings : cases) {
    render(joined(settings, {"field.scale=20"}));
    const double emitted = statistics_["photons"]["emitted"].get<double>();
    EXPECT_GT(emitted, 0) << settings[0];
    EXPECT_EQ(sum_of_ends(statistics_["photons"]), emitted) << settings[0];
    for (const auto& channel : statistics_["channels"])
      EXPECT_EQ(sum_of_ends(channel["rays"]), channel["rays"]["emitted"].get<double>()) << settings[0];
    if (!statistics_.contains("power")) continue;
    const double power = statistics_["power"]["emitted"].get<double>();
    EXPECT_NEAR(sum_of_ends(statistics_["power"]), power, 1e-6 * power) << settings[0];
  }
}

TEST_F(PlatePicture, HasStatistics) {
  render({"field.scale=20", "light.beam=volume"});
  const nlohmann::json& stats = statistics_;
  EXPECT_EQ(stats["photons"]["emitted"], 4 * stats["positions"].get<std::uint64_t>());
  EXPECT_GT(stats["photons"]["deposited"], 0);
  ASSERT_EQ(stats["channels"].size(), 4u);
  for (const auto& channel : stats["channels"]) EXPECT_EQ(channel["rays"]["emitted"], stats["positions"]);
  for (const auto& channel : stats["channels"]) EXPECT_GT(channel["ray_power"], 0);
  EXPECT_NEAR(stats["power"]["emitted"], 4, 1e-3);  // Irradiance 1 times the area of the beam's cross section.
  for (const char* key : {"ray_steps", "tensor_samples", "peak_memory_bytes"}) EXPECT_GT(stats[key], 0) << key;
  for (const char* phase : {"load", "trace", "density", "color", "write"})
    EXPECT_GE(stats["seconds"][phase], 0) << phase;
}

class MeshLight : public Pictures {
 protected:
  MeshLight() {
    write("scene.json", R"({
      "field": {"generate": {"kind": "point_load", "resolution": 33}, "eigenvalues": "absolute", "scale": 6},
      "light": {"direction": [0, 0, -1], "wavelengths": {"count": 8}},
      "receiver": {"distance": 0.5, "size": [2.6, 2.6], "resolution": [96, 96]},
      "integrator": {"type": "photon_distribution"}})");
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
  const auto at = [&](const char* name, int x, int y) {
    return image.pixel(x, y)[std::find(image.channels.begin(), image.channels.end(), name) - image.channels.begin()];
  };
  const auto displacement = [&](int x, int y) {
    return Vector2d(at("displacement.x", x, y), at("displacement.y", x, y));
  };
  const double pixel = 2.6 / 96;
  int compared = 0;
  for (int y = 1; y < 95; ++y)
    for (int x = 1; x < 95; ++x) {
      const double log = at("magnification.log", x, y), major = at("magnification.major", x, y),
                   minor = at("magnification.minor", x, y);
      EXPECT_NEAR(log, major + minor, 1e-4);
      EXPECT_GE(major + 1e-6, minor);
      if (std::hypot(x - 47.5, y - 47.5) > 25 || at("folds", x, y) != 1) continue;  // Within the bright disc.
      // By the position across the beam where the light of neighbouring pixels starts; y of the plate is along −y.
      Matrix2d slopes;
      slopes << displacement(x + 1, y) - displacement(x - 1, y), displacement(x, y - 1) - displacement(x, y + 1);
      const double starts = (Matrix2d::Identity() - slopes / (2 * pixel)).determinant();
      EXPECT_NEAR(-std::log(std::abs(starts)), log, 0.15) << x << " " << y;
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
    render(joined(settings, {"light.photons=2000"}));
    EXPECT_THAT(notes_, Contains(HasSubstr(warning)));
  }
}

/// A cube in which all light of one colour turns alike, before a plate that catches all of it.
class TurningCube : public Pictures {
 protected:
  TurningCube() {
    write("scene.json", R"({
      "field": {"generate": {"kind": "constant", "resolution": 9, "tensor": [[0, 0, 1], [0, 0, 0], [1, 0, 0]]},
                "eigenvalues": "raw", "scale": 1},
      "light": {"direction": [0, 0, -1], "photons": 60000},
      "receiver": {"distance": 0.1, "size": [8, 8], "resolution": [256, 256]},
      "integrator": {"type": "photon_distribution"}})");
  }

  /// @param s  Flexibility of the light.
  Render light_of(const std::string& density, double s, const Settings& more) {
    return render_all(
        joined({"integrator.density.kind=" + density, fmt::format("bending.rgb=[{0},{0},{0}]", s)}, more));
  }

  /// The light of the last render with this end, as a part of what was emitted.
  double share(const char* end) const {
    const nlohmann::json& light = statistics_[statistics_.contains("power") ? "power" : "photons"];
    const double emitted = light["emitted"].get<double>();
    EXPECT_NEAR(sum_of_ends(light), emitted, 1e-6 * emitted);
    return light.value(end, 0.0) / emitted;
  }
};

/// In this field V = (sin θ, 0, −cos θ) turns by θ' = −s cos 2θ. All light is displaced alike, by x on its way from
/// z = 1 to z = −1, and the part |x| / 2 leaves by the sides.
double displaced_part(double s) {
  double angle = 0, x = 0, z = 1;
  for (const double h = 1e-5; z > -1; x += h * std::sin(angle), z -= h * std::cos(angle))
    angle -= h * s * std::cos(2 * angle);
  return std::abs(x) / 2;
}

/// What is left out by the sides is what the plate lacks: no power is lost, with photons and with the mesh.
TEST_F(TurningCube, SideLightIsLeftOutAndCounted) {
  const double s = 0.3;
  const std::string beam = "light.beam=volume";
  for (const std::string density : {"mesh", "histogram"}) {
    const Render with = light_of(density, s, {beam, "integrator.side_light=true"});
    EXPECT_NEAR(share("deposited"), 1, 1e-3) << density;
    const Render without = light_of(density, s, {beam, "integrator.side_light=false"});
    const double side = share("side");
    EXPECT_NEAR(side, displaced_part(s), 0.01) << density;
    EXPECT_NEAR(share("deposited"), 1 - side, 1e-3) << density;
    // The volume is 64 pixels wide; the mesh knows the edge of the light that is left to one of them.
    EXPECT_NEAR(mean(without.linear, "R") / mean(with.linear, "R"), 1 - side, 1.0 / 64) << density;
    EXPECT_THAT(without.notes, ElementsAre(HasSubstr("side faces"))) << density;
    EXPECT_EQ(light_of(density, s, {beam}).linear.pixels, with.linear.pixels) << density;
  }
}

/// Straight light is 1 on all of a plate: the default one, one larger than the volume, a part, one beside it, and
/// cos 45° on one that is inclined so.
TEST_F(TurningCube, UndisturbedLightIsOneOnAllOfThePlate) {
  const std::vector<std::pair<Settings, double>> plates{
      {{}, 1},
      {{"receiver.size=[7,5]"}, 1},
      {{"receiver.size=[0.5,0.3]"}, 1},
      {{"receiver.size=[2,2]", "receiver.center=[2,1,-4]"}, 1},
      {{"receiver.size=[5,5]", "receiver.normal=[1,0,1]"}, std::sqrt(0.5)}};
  for (const std::string density : {"mesh", "gaussian", "histogram"})
    for (const std::string direction : {"[0,0,-1]", "[0.3,0.1,-1]", "[1,1,-1.5]"})
      for (const auto& [plate, cosine] : plates) {
        if (cosine < 1 && direction != "[0,0,-1]") continue;
        if (density != "mesh" && direction == "[1,1,-1.5]") continue;
        SCOPED_TRACE(density + direction + testing::PrintToString(plate));
        const Settings common{"light.direction=" + direction, R"(receiver={"resolution":[48,48]})"};
        const Image image = light_of(density, 0, joined(common, plate)).linear;
        for (const char* color : {"R", "G", "B"}) EXPECT_NEAR(mean(image, color), cosine, 0.02);
        // Rays start 3e-6 of the volume's light inside of its edge, which is up to 500 pixels long. Of photons, few are
        // in a pixel.
        if (density != "mesh") continue;
        const auto is_undisturbed = testing::Each(testing::FloatNear(static_cast<float>(cosine), 2e-3f));
        for (const char* color : {"R", "G", "B"}) EXPECT_THAT(channel(image, color), is_undisturbed);
        EXPECT_EQ(share("side"), 0);
      }
}

/// Light from the cube is displaced by x within it, and by the distance of the plate times its slope behind it: it
/// leaves a gap on one side, and lies over the undisturbed light on the other. What leaves by the side is left out.
TEST_F(TurningCube, UndisturbedLightIsBesideLightThatIsDisplaced) {
  const double s = 0.3, x = 2 * displaced_part(s), pixel = 8.0 / 256;
  for (const std::string density : {"mesh", "histogram"}) {
    const Image image = light_of(density, s, {"light.photons=400000"}).linear;
    const auto at = [&](double from, double to) {  // Mean of the middle rows; light is displaced to −x.
      double sum = 0;
      int count = 0;
      for (int y = 110; y < 146; ++y)
        for (int column = 0; column < 256; ++column) {
          const double place = (column + 0.5) * pixel - 4;
          if (place < from + pixel || place > to - pixel) continue;
          sum += image.pixel(column, y)[1];
          ++count;
        }
      return sum / count;
    };
    const double error = density == "mesh" ? 1e-3 : 0.02;
    EXPECT_NEAR(at(-4, -1.1), 1, error) << density;
    EXPECT_NEAR(at(-0.98, 1 - x - 0.1), 1, error) << density;
    EXPECT_NEAR(at(1 - x, 1), 0, error) << density;
    EXPECT_NEAR(at(1, 4), 1, error) << density;
    // All light that is emitted, but for that of the sides, lands or misses the plate.
    if (density == "mesh") {
      EXPECT_NEAR(statistics_["power"]["emitted"].get<double>() * share("side"), 2 * x, 0.05);
    }
    EXPECT_NEAR(64 * mean(image, "G"), 64 - 2 * x, 0.1) << density;
  }
}

}  // namespace
}  // namespace tensorray
