// The method polariscope: polarised light through a field, between polarisers.

#include <Eigen/LU>
#include <fmt/format.h>

#include "base/constants.h"
#include "scenes/outputs/picture_outputs.h"
#include "scenes/scene/kept_results.h"
#include "tests/scenes/pictures/pictures.h"

namespace tensorray {
namespace {

/// A plate 0.01 thick with a stress of 8e6 along x: 4.4 µm of retardance with C = 55e-12.
constexpr const char* plate_scene = R"({
  "field": {"generate": {"kind": "constant", "resolution": [5, 5, 1], "min": [-1, -1, 0], "max": [1, 1, 0],
                         "tensor": [[8e6, 0, 0], [0, 0, 0], [0, 0, 0]]}},
  "light": {"wavelengths": {"min": 380, "max": 780, "count": 40}},
  "receiver": {"size": [1, 1], "resolution": [4, 3]},
  "integrator": {"type": "polariscope", "angle": 45, "stress_optic": 1e-13, "unit_length": 1}})";

class Polariscope : public Pictures {
 protected:
  void SetUp() override { write("scene.json", plate_scene); }

  /// The coefficient with which the plate has a retardance.
  double coefficient(double nanometres) { return nanometres * 1e-9 / (8e6 * channel(render({}), "length")[0]); }
  /// The setting of it.
  std::string retarding(double nanometres) {
    return fmt::format("integrator.stress_optic={}", coefficient(nanometres));
  }
};

/// The interference-colour chart: XYZ of sin² times the illuminant, 1 nm at a time.
TEST_F(Polariscope, ColoursAreThoseOfTheInterferenceChart) {
  const Spectrum light = illuminant("D65");
  for (const double retardance : {250.0, 551.0, 1100.0, 1700.0}) {
    const Image image = render({retarding(retardance), "output.white_balance=false", "light.wavelengths.count=400",
                                "integrator.arrangement=plane"});
    Vector3d xyz = Vector3d::Zero();
    double white = 0;
    for (double wavelength = 380.5; wavelength < 780; ++wavelength) {
      const double sine = std::sin(pi * retardance / wavelength);
      xyz += sine * sine * light.at(wavelength) * observer(wavelength);
      white += light.at(wavelength) * observer(wavelength).y();
    }
    const Vector3d expected = rec709_to_xyz().inverse() * xyz / white;
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.pixel(1, 1)[c], expected[c], 2e-4) << retardance << " " << c;
    EXPECT_NEAR(channel(image, "integral")[0], retardance, 1e-3);
  }
}

TEST_F(Polariscope, ChannelsAreRetardanceAndDirections) {
  // 0.3 and 1.7 orders of 545 nm, the middle of the band nearest to 550 nm: the principal value is below half an order,
  // and then the slow axis is the other one.
  for (const auto& [orders, wrapped, azimuth] : {std::tuple(0.3, 0.3, 0.0), std::tuple(1.7, 0.3, pi / 2)}) {
    const Image image = render({retarding(545 * orders)});
    EXPECT_NEAR(channel(image, "integral")[0], orders * 545, 0.01);
    EXPECT_NEAR(channel(image, "retardance")[0], wrapped * 545, 0.01);
    EXPECT_NEAR(std::abs(channel(image, "azimuth")[0]), azimuth, 1e-4);
    EXPECT_NEAR(std::abs(channel(image, "rotation")[0]), 0, 1e-4);
  }
  // A negative coefficient: the slow axis is across the stress.
  EXPECT_NEAR(std::abs(channel(render({retarding(-0.3 * 545)}), "azimuth")[0]), pi / 2, 1e-4);
}

TEST_F(Polariscope, UnitsOfLengthAndOfStressCancel) {
  const Image expected = render({"integrator.stress_optic=3e-14"});
  for (const char* unit : {"integrator.unit_length=0.001", "world.unit=mm"}) {
    const Image found =
        render({"integrator.stress_optic=3e-11", unit, unit[0] == 'w' ? "integrator.unit_length=null" : unit});
    for (std::size_t i = 0; i < expected.pixels.size(); ++i)
      EXPECT_NEAR(found.pixels[i], expected.pixels[i], 1e-5 * (1 + std::abs(expected.pixels[i])));
  }
}

TEST_F(Polariscope, AutomaticCoefficientGivesFourOrders) {
  const Image image = render({"integrator.stress_optic=auto"});
  EXPECT_THAT(notes_, Contains(HasSubstr("stress_optic: ")));
  EXPECT_NEAR(channel(image, "integral")[0] / 545, 4, 0.02);
  EXPECT_THAT(render_all({}).notes, Contains(HasSubstr("greatest order: ")));
  render({"integrator.stress_optic=1e-20"});
  EXPECT_THAT(notes_, Contains(HasSubstr("check the units")));
  render({"field.generate.tensor=[[1,0,0],[0,1,0],[0,0,0]]", "integrator.stress_optic=auto"});
  EXPECT_THAT(notes_, Contains(HasSubstr("turns no polarisation")));
}

/// Retardance by a table of coefficients: 10% more at 380 nm.
TEST_F(Polariscope, DispersionComesFromAFile) {
  const double C = coefficient(800);
  write("glass.txt", fmt::format("# nm, 1/Pa\n380 {}\n555 {}\n780 {}\n", 1.1 * C, C, 0.95 * C));
  const Render seen =
      render_all({"integrator.stress_optic=glass.txt", "integrator.arrangement=plane"}, {"a.exr", "a.spectral.exr"});
  ASSERT_TRUE(seen.spectral.has_value());
  const Spectrum table{{380, 555, 780}, {1.1, 1, 0.95}};
  const auto& bands = seen.spectral->bands;
  for (std::size_t k = 0; k < bands.size(); ++k) {
    const double expected = std::pow(std::sin(pi * 800 * table.at(bands[k].wavelength) / bands[k].wavelength), 2);
    EXPECT_NEAR(seen.spectral->image.pixel(0, 0)[3 + k] * bands[k].width / bands[k].power * pi, expected, 1e-4)
        << bands[k].wavelength;
  }
  write("short.txt", "400 1e-12\n700 1e-12\n");
  write("none.txt", "300 1e-12\n500 0\n800 0\n");
  write("bad.txt", "380 1e-12\n370 1e-12\n");
  expect_error(1, "short.txt: its coefficients, from 400 to 700 nm, do not cover the light",
               {"integrator.stress_optic=short.txt"});
  expect_error(1, "none.txt: the coefficient at 545 nm must not be 0", {"integrator.stress_optic=none.txt"});
  expect_error(1, "bad.txt, line 2", {"integrator.stress_optic=bad.txt"});
  expect_error(1, "missing.txt", {"integrator.stress_optic=missing.txt"});
}

TEST_F(Polariscope, SaysWhatIsWrongInOneLine) {
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"integrator.stress_optic=0", "/integrator/stress_optic` must be a number other than 0"},
      {"integrator.stress_optic=glass", "or a file"},
      {"integrator.unit_length=0", "/integrator/unit_length`"},
      {"integrator.unit_length=-1", "/integrator/unit_length"},
      {"integrator.samples=0", "/integrator/samples"},
      {"integrator.arrangement=crossed", R"(one of "circular")"},
      {R"(integrator.arrangement={"before":[{"prism":0}]})", R"(of elements \{"polarizer": DEGREES\})"},
      {R"(integrator.arrangement={"before":[{"retarder":550}]})", R"(\{"retarder": NM, "axis": DEGREES\})"},
      {R"(integrator.arrangement={"before":[{"polarizer":0,"axis":3}]})", "of elements"},
      {R"(integrator.arrangement={"beside":[]})", "`before` and `after`"},
      {R"(integrator.arrangement={"after":{"polarizer":0}})", "`before` and `after`"},
      {"integrator.arrangement=3", "`before` and `after`"},
      {"bending.rgb=[0.1,0.2,0.3]", "/bending/rgb`: the polariscope needs light with wavelengths"}};
  for (const auto& [setting, message] : wrong) expect_error(2, message, {setting});
}

TEST_F(Polariscope, ListsOfElementsAreAnArrangement) {
  const Image expected = render({});
  const Image found = render(
      {R"(integrator.arrangement={"before":[{"polarizer":0},{"quarter_wave":45}],"after":[{"quarter_wave":-45},{"polarizer":90}]})"});
  EXPECT_EQ(found.pixels, expected.pixels);
  // The same plate twice is as none, between parallel polarisers; without any polariser all light passes.
  const Image open = render(
      {R"(integrator.arrangement={"before":[{"polarizer":0},{"retarder":700,"axis":10}],"after":[{"retarder":700,"axis":100},{"polarizer":0}]})",
       "field.generate.tensor=[[0,0,0],[0,0,0],[0,0,0]]"});
  for (const Image& image : {open, render({R"(integrator.arrangement={"before":[]})"})})
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.pixel(0, 0)[c], 1, 1e-4);
}

/// Beside the field, dark field is black and light field is white; also where the field is an annotation's ground.
TEST_F(Polariscope, LightBesideTheFieldKeepsItsPolarisation) {
  for (const auto& [arrangement, expected] : {std::pair("circular", 0.0), std::pair("plane_light", 1.0)}) {
    const Image image = render({"receiver.size=[8,8]", std::string("integrator.arrangement=") + arrangement});
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.pixel(0, 0)[c], expected, 1e-4);
    EXPECT_EQ(channel(image, "length")[0], 0);
  }
  const Image shown =
      render({"receiver.size=[8,8]", "integrator.arrangement=plane_light", "light.aperture.size=[2,2]"});
  EXPECT_EQ(shown.pixel(0, 0)[0], 0);
}

TEST_F(Polariscope, StokesParametersAreChannelsOfTheSpectralPicture) {
  const Settings settings{"output.stokes=true", "integrator.samples=1", "integrator.analyzer=10"};
  const Render seen = render_all(settings, {"a.spectral.exr"});
  const Image file = read_image(in_folder("a.spectral.exr"));
  const auto value = [&](int s, double wavelength) {
    return channel(file, fmt::format("S{}.{:.0f},000000nm", s, wavelength))[0];
  };
  const auto& bands = seen.spectral->bands;
  for (const Band& band : bands) {
    const double nm = band.wavelength, S0 = value(0, nm);
    EXPECT_NEAR(S0 * S0, Vector3d(value(1, nm), value(2, nm), value(3, nm)).squaredNorm(), 1e-5 * S0 * S0);
    EXPECT_NEAR(S0 * band.width / band.power * pi, 1, 1e-5);
  }
  // The analyser shows half of S0 + n·S.
  const Render dark = render_all({"integrator.samples=1", "integrator.analyzer=10"}, {"b.spectral.exr"});
  const double angle = 2 * (90 + 45 + 10) * pi / 180;
  const double nm = bands[7].wavelength;
  EXPECT_NEAR(dark.spectral->image.pixel(0, 0)[3 + 7],
              (value(0, nm) + std::cos(angle) * value(1, nm) + std::sin(angle) * value(2, nm)) / 2, 1e-8);
  EXPECT_EQ(seen.spectral->metadata.at("polarisationHandedness"), "right");
}

TEST_F(Polariscope, ALegendHasTheInterferenceColours) {
  for (const std::string arrangement : {"circular", "tint", "plane"}) {
    const Render seen = render_all({"integrator.arrangement=" + arrangement, "receiver.resolution=[300,300]",
                                    "output.annotations=legend", "field.unit=Pa", "world.unit=m"});
    ASSERT_TRUE(seen.draw_legend);
    EXPECT_EQ(seen.legend_note, "1 order: 545 nm, 5.45e+06 Pa m") << arrangement;
    Image with = seen.linear;
    seen.draw_legend(with, 0);
    int changed = 0;
    for (std::size_t i = 0; i < with.pixels.size(); ++i) changed += with.pixels[i] != seen.linear.pixels[i];
    EXPECT_GT(changed, 2000) << arrangement;
    EXPECT_TRUE(seen.warnings.empty());
  }
}

/// What was traced serves other arrangements of the same light: the same bits as without.
TEST_F(Polariscope, TheAnalyserTurnsWithoutTracingAgain) {
  const auto kept = std::make_shared<KeptResults>();
  const auto render_with = [&](const Settings& settings, std::shared_ptr<KeptResults> results) {
    Scene scene = load_scene(read_scene(in_folder("scene.json"), {settings, {}}), Progress());
    scene.kept = std::move(results);
    return tensorray::render(scene, Progress()).linear.pixels;
  };
  for (const char* setting : {"integrator.analyzer=0", "integrator.analyzer=33", "integrator.angle=10",
                              "integrator.arrangement=tint", "integrator.samples=1", "integrator.stress_optic=2e-13",
                              "light.wavelengths.count=7", "receiver.size=[0.5,0.5]"})
    EXPECT_EQ(render_with({setting}, kept), render_with({setting}, nullptr)) << setting;
}

TEST_F(Polariscope, SignsOfStressesCount) {
  const std::string tensor = "field.generate.tensor=[[4e6,0,0],[0,-4e6,0],[0,0,0]]";
  EXPECT_NEAR(channel(render({tensor}), "integral")[0], channel(render({}), "integral")[0], 1e-3);
  render({tensor, "field.eigenvalues=absolute"});
  EXPECT_THAT(notes_, Contains(HasSubstr("/field/eigenvalues")));
  render({"field.scale=3"});
  EXPECT_THAT(notes_, Contains(HasSubstr("/field/scale")));
}

TEST_F(Polariscope, SaysWhichKeysHaveNoEffect) {
  const std::vector<std::pair<Settings, std::string>> cases{
      {{R"(integrator.arrangement={"before":[{"polarizer":0}]})", "integrator.analyzer=10"}, "`/integrator/analyzer`"},
      {{"integrator.type=lens", "output.stokes=true"}, "`/output/stokes`"},
      {{"output.stokes=true"}, "`/output/stokes`"}};
  for (const auto& [settings, key] : cases)
    EXPECT_THAT(read_scene(in_folder("scene.json"), {settings, {}}).warnings,
                Contains(HasSubstr(key + " has no effect")));
  EXPECT_THAT(read_scene(in_folder("scene.json"), {{"integrator.analyzer=10"}, {}}).warnings,
              Not(Contains(HasSubstr("analyzer"))));
}

}  // namespace
}  // namespace tensorray
