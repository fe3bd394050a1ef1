#include "renderer/color/color.h"

#include <cstdlib>
#include <stdexcept>

#include "renderer/color/file_colors.h"
#include "renderer/spectra/spectrum.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

/// $OCIO is unset before and after each test; a test may set it.
class ColorTest : public ::testing::Test {
 protected:
  ColorTest() { unsetenv("OCIO"); }
  ~ColorTest() override { unsetenv("OCIO"); }
};

double srgb(double v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }

/// The value that a display shows for scene-linear grey.
double displayed_grey(const ColorManagement& color, float value) {
  Image image(1, 1, {"R", "G", "B"});
  image.pixels = {value, value, value};
  color.to_display(image);
  EXPECT_NEAR(image.pixels[0], image.pixels[1], 2e-3);
  EXPECT_NEAR(image.pixels[0], image.pixels[2], 2e-3);
  return image.pixels[1];
}

std::string error_of(const ColorSettings& settings) {
  return message([&] { ColorManagement color(settings); });
}

/// A config with the given roles. Its working space resembles ACEScg.
std::string config_text(const std::string& roles) {
  return "ocio_profile_version: 2\nenvironment: {}\nsearch_path: \"\"\nstrictparsing: true\nroles:\n"
         "  default: linear\n" +
         roles + R"(file_rules:
  - !<Rule> {name: Default, colorspace: default}
displays:
  Screen:
    - !<View> {name: Curve, colorspace: curve}
    - !<View> {name: Plain, colorspace: linear}
    - !<View> {name: Grey, view_transform: Plain, display_colorspace: grey}
view_transforms:
  - !<ViewTransform>
    name: Plain
    from_scene_reference: !<BuiltinTransform> {style: UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD}
display_colorspaces:
  - !<ColorSpace> {name: xyz}
  - !<ColorSpace>
    name: grey
    from_display_reference: !<MatrixTransform> {matrix: [0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1]}
colorspaces:
  - !<ColorSpace> {name: aces}
  - !<ColorSpace> {name: linear, to_scene_reference: !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}}
  - !<ColorSpace>
    name: curve
    to_scene_reference: !<ExponentTransform> {value: 2}
)";
}

/// That of a config with this text.
ColorManagement color_of(const std::string& config, const std::string& display = "", const std::string& view = "") {
  const Temporary file("config.ocio", config);
  return ColorManagement({file.path(), display, view});
}

const std::string linear_role = "  scene_linear: linear\n";
const std::string aces_role = "  aces_interchange: aces\n";
const std::string xyz_role = "  cie_xyz_d65_interchange: xyz\n";

TEST_F(ColorTest, HighlightsAreSoftUnlessAViewIsNamed) {
  const ColorManagement color({}), rec1886({"", "Rec.1886", soft_highlights_view});
  for (const char* display : {"sRGB", "Rec.1886"})
    EXPECT_EQ(ColorManagement({"", display, ""}).view(), soft_highlights_view);
  EXPECT_EQ(ColorManagement({"", "", "Raw"}).view(), "Raw");
  for (const float value : {-30.0f, -1.0f, 0.0f, 1e-3f, 0.18f, 1.0f, 3.0f, 20.0f, 1e4f}) {
    const double shown = 1 - std::exp(-std::max(value, 0.0f));
    EXPECT_NEAR(displayed_grey(color, value), srgb(shown), 1e-3) << value;
    EXPECT_NEAR(displayed_grey(rec1886, value), std::pow(shown, 1 / 2.4), 1e-3) << value;
  }
}

/// Oklab's a and b of linear Rec.709 (Ottosson 2020), which may be out of gamut.
Vector2d oklab(const Vector3d& rgb) {
  Matrix3d to_lms;
  to_lms << 0.4122214708, 0.5363325363, 0.0514459929, 0.2119034982, 0.6806995451, 0.1073969566, 0.0883024619,
      0.2817188376, 0.6299787005;
  const Vector3d root = (to_lms * rgb).unaryExpr([](double x) { return std::cbrt(x); });
  return {Vector3d(1.9779984951, -2.4285922050, 0.4505937099).dot(root),
          Vector3d(0.0259040371, 0.7827717662, -0.8086757660).dot(root)};
}

/// From black over light of a wavelength, whose greatest component is `peak`, to white of the same.
Image ramp_over(double wavelength, double peak, int size) {
  const Vector3d rgb = rec709_to_xyz().inverse() * observer(wavelength), pure = peak * rgb / rgb.maxCoeff();
  Image image(size, 1, {"R", "G", "B"});
  for (int i = 0; i < size; ++i) {
    const double at = 2.0 * i / (size - 1), white = std::max(0.0, at - 1);
    const double part = at < 1 ? at * at : 1 - white;
    Eigen::Map<Vector3f>(image.pixel(i, 0)) = (part * pure + Vector3d::Constant(white * peak)).cast<float>();
  }
  return image;
}

TEST_F(ColorTest, SoftHighlightsKeepSpectralLightInTheDisplayWithoutSteps) {
  const ColorManagement color({});
  constexpr int size = 1001;
  double turned = 0, chroma = 0, clipped_chroma = 0;
  int lit = 0, at_limit = 0;
  for (double wavelength = 390; wavelength <= 700; wavelength += 2)
    for (const double peak : {0.3, 1.0, 3.0}) {
      const Image light = ramp_over(wavelength, peak, size);
      Image shown = light;
      color.to_display(shown);
      const Eigen::Map<const Eigen::Array3Xf> values(shown.pixels.data(), 3, size);
      ASSERT_TRUE(((values.rightCols(size - 1) - values.leftCols(size - 1)).abs() < 0.01f).all()) << wavelength;
      for (int i = size / 4; i < 3 * size / 4; ++i) {
        const Vector3d in = Eigen::Map<const Vector3f>(light.pixel(i, 0)).cast<double>();
        const Vector3d out = values.col(i).cast<double>().unaryExpr([](double v) { return srgb_light(v); });
        const Vector3d clipped = in.unaryExpr([](double v) { return 1 - std::exp(-std::max(v, 0.0)); });
        const Vector2d a = oklab(in), b = oklab(out);
        at_limit += out.minCoeff() <= 1e-4 || out.maxCoeff() >= 0.9999;
        turned += std::acos(std::clamp(a.dot(b) / (a.norm() * b.norm()), -1.0, 1.0));
        chroma += b.norm();
        clipped_chroma += oklab(clipped).norm();
        ++lit;
      }
    }
  EXPECT_LT(at_limit, 0.03 * lit);
  EXPECT_LT(turned / lit * 180 / EIGEN_PI, 6);
  EXPECT_GT(chroma, 0.7 * clipped_chroma);
}

TEST_F(ColorTest, AdaptationIsBradfords) {
  // The adaptation from A to D65 as published with the CIE's whites (Lindbloom); XYZ to linear sRGB by IEC 61966-2-1.
  Matrix3d adaptation, to_rgb;
  adaptation << 0.8446965, -0.1179225, 0.3948108, -0.1366303, 1.1041226, 0.1291718, 0.0798489, -0.1348999, 3.1924009;
  to_rgb << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434, -0.2040259, 1.0572252;
  const Matrix3d actual = ColorManagement({}).xyz_to_working_adapted({1.09850, 1, 0.35585});
  EXPECT_TRUE(actual.isApprox(to_rgb * adaptation, 1e-3)) << actual << "\n\n" << to_rgb * adaptation;
}

TEST_F(ColorTest, SaturatedWhitesStayFiniteAndNeutral) {
  const ColorManagement color({});
  for (int wavelength = 380; wavelength <= 780; wavelength += 5) {
    const Vector3d white = observer(wavelength) / observer(wavelength).y();
    const Matrix3d matrix = color.xyz_to_working_adapted(white);
    EXPECT_TRUE((matrix * white).isApprox(Vector3d::Ones(), 1e-4)) << wavelength;
    EXPECT_LT(matrix.norm(), 1e3) << wavelength;
  }
  EXPECT_THROW(color.xyz_to_working_adapted({1, 0, 1}), std::invalid_argument);
  EXPECT_THROW(color.xyz_to_working_adapted({1, std::nan(""), 1}), std::invalid_argument);
}

TEST_F(ColorTest, DisplayCurves) {
  const std::string plain = "Un-tone-mapped";
  const ColorManagement color({"", "", plain}), rec1886({"", "Rec.1886", plain}), raw({"", "", "Raw"});
  for (const float value : {0.0f, 0.001f, 0.18f, 0.5f, 1.0f}) {
    EXPECT_NEAR(displayed_grey(color, value), srgb(value), 1e-4);
    EXPECT_NEAR(displayed_grey(rec1886, value), std::pow(value, 1 / 2.4), 1e-4);
    EXPECT_NEAR(displayed_grey(raw, value), value, 1e-6);
  }
  EXPECT_NEAR(displayed_grey(color, 0.18f), 0.4613, 1e-4);
}

TEST_F(ColorTest, OtherChannelsAreLeftAlone) {
  Image image(33, 17, {"R", "G", "B", "A", "Z"});
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i % 101) / 100;
  const Image before = image;
  const ColorManagement color({});
  color.to_display(image);
  for (int y = 0; y < 17; ++y)
    for (int x = 0; x < 33; ++x) {
      EXPECT_EQ(image.pixel(x, y)[3], before.pixel(x, y)[3]);
      EXPECT_EQ(image.pixel(x, y)[4], before.pixel(x, y)[4]);
      Image one(1, 1, {"R", "G", "B"});
      std::copy_n(before.pixel(x, y), 3, one.pixels.begin());
      color.to_display(one);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.pixel(x, y)[c], one.pixels[c], 1e-6);
    }
  Image grey(2, 2, {"Y"}), swapped(2, 2, {"B", "G", "R"});
  EXPECT_THROW(color.to_display(grey), std::invalid_argument);
  EXPECT_THROW(color.to_display(swapped), std::invalid_argument);
}

TEST_F(ColorTest, ConfigsAreFoundByPathAndByEnvironment) {
  const Temporary file("config.ocio", config_text(linear_role + aces_role + xyz_role));
  const ColorManagement by_path({file.path(), "", ""});
  EXPECT_EQ(by_path.config_name(), file.path().string());
  EXPECT_EQ(by_path.working_space(), "linear");
  EXPECT_EQ(by_path.display(), "Screen");
  EXPECT_EQ(by_path.view(), "Curve");
  setenv("OCIO", file.path().c_str(), 1);
  const ColorManagement by_environment({"", "Screen", "Plain"});
  EXPECT_EQ(by_environment.config_name(), file.path().string());
  EXPECT_EQ(by_environment.view(), "Plain");
  setenv("OCIO", "", 1);
  EXPECT_EQ(ColorManagement({}).config_name(), "built-in");
  setenv("OCIO", "/no/such.ocio", 1);
  EXPECT_EQ(ColorManagement({file.path(), "", ""}).config_name(), file.path().string());
  EXPECT_EQ(ColorManagement({"built-in", "", ""}).config_name(), "built-in");
}

/// ACEScg's white (D60) is adapted to D65 by Bradford's method. Without interchange roles, primaries are Rec.709's.
TEST_F(ColorTest, EitherInterchangeRoleLeadsToTheWorkingSpace) {
  Matrix3d rec709_to_acescg;  // As published.
  rec709_to_acescg << 0.613097, 0.339523, 0.047379, 0.070194, 0.916354, 0.013452, 0.020616, 0.109570, 0.869815;
  const Matrix3d xyz_to_rec709 = ColorManagement({}).xyz_to_working();
  for (const std::string& roles : {aces_role, xyz_role, aces_role + xyz_role, std::string()}) {
    const Matrix3d matrix = color_of(config_text(linear_role + roles)).xyz_to_working();
    const Matrix3d expected = roles.empty() ? xyz_to_rec709 : Matrix3d(rec709_to_acescg * xyz_to_rec709);
    EXPECT_TRUE(matrix.isApprox(expected, 1e-4)) << roles << matrix << "\n\n" << expected;
    EXPECT_TRUE((matrix * Vector3d(0.3127, 0.3290, 0.3583) / 0.3290).isApprox(Vector3d::Ones(), 1e-4)) << roles;
  }
}

TEST_F(ColorTest, UnknownNamesListTheKnownOnes) {
  EXPECT_THAT(error_of({"", "CRT", ""}),
              AllOf(HasSubstr("built-in"), HasSubstr("\"CRT\""), HasSubstr("\"sRGB\", \"Rec.1886\"")));
  EXPECT_THAT(
      error_of({"", "sRGB", "Filmic"}),
      AllOf(HasSubstr("\"Filmic\""), HasSubstr("\"Soft highlights\", \"Un-tone-mapped\", \"ACES SDR\", \"Raw\"")));
}

TEST_F(ColorTest, DisplaysWithoutAnInverseAreShownButNotStated) {
  const ColorManagement color = color_of(config_text(linear_role + aces_role + xyz_role), "Screen", "Grey");
  EXPECT_NEAR(displayed_grey(color, 0.5f), 0.5, 1e-3);
  EXPECT_FALSE(color.display_encoding().is_srgb);
  EXPECT_EQ(color.display_encoding().icc_profile, "");
}

TEST_F(ColorTest, BadConfigsAreOneClearLine) {
  for (const auto& [content, error] : std::vector<std::pair<std::string, std::string>>{
           {"this: [is not\n a config", ""},
           {config_text(""), "scene_linear"},
           {config_text("  scene_linear: curve\n" + aces_role), "not linear"},
           {config_text("  scene_linear: nowhere\n"), "nowhere"},
           {"ocio_profile_version: 2.9\nroles:\n  default: raw\n", "for a newer library than OpenColorIO"},
           {"ocio_profile_version: 2.9\nroles:\n  default: raw\n", "\"built-in\""}}) {
    const Temporary file("bad.ocio", content);
    EXPECT_THAT(error_of({file.path(), "", ""}), AllOf(HasSubstr(file.path().string()), HasSubstr(error)));
  }
  EXPECT_THAT(error_of({"/no/such.ocio", "", ""}), HasSubstr("/no/such.ocio: no such file"));
  EXPECT_THAT(error_of({::testing::TempDir(), "", ""}), HasSubstr("folder"));
  EXPECT_THAT(error_of({"ocio://no-such-config", "", ""}), HasSubstr("OCIO config ocio://no-such-config"));
  setenv("OCIO", "/no/such.ocio", 1);
  EXPECT_THAT(error_of({}), AllOf(HasSubstr("/no/such.ocio: no such file"), HasSubstr("$OCIO")));
}

TEST_F(ColorTest, ConversionsOutliveTheirConfig) {
  const ColorConversion conversion = ColorManagement({}).to_working("ACEScg");
  float white[4] = {1, 1, 1, 0.5f};
  conversion(white, 1);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(white[c], 1, 1e-5);
  for (const char* same : {"scene_linear", "lin_rec709", "Raw"})
    EXPECT_FALSE(ColorManagement({}).to_working(same)) << same;
  EXPECT_THAT(message([] { ColorManagement({}).to_working("nowhere"); }), HasSubstr("nowhere"));
}

TEST_F(ColorTest, TextureSpaces) {
  const ColorManagement color({});
  EXPECT_EQ(color.texture_space("a.png", true, ""), "srgb_texture");
  EXPECT_EQ(color.texture_space("a.exr", false, ""), "scene_linear");
  for (const char* given : {"ACEScg", "scene_linear"}) EXPECT_EQ(color.texture_space("a.png", true, given), given);
  EXPECT_THAT(message([&] { color.texture_space("a.png", true, "Technicolor"); }),
              AllOf(HasSubstr("\"Technicolor\""), HasSubstr("\"ACEScg\""), HasSubstr("\"srgb_texture\"")));
}

TEST_F(ColorTest, TextureSpacesOfConfigs) {
  const std::string text = config_text(linear_role + aces_role);
  const ColorManagement without = color_of(text);
  EXPECT_EQ(without.texture_space("a.exr", false, ""), "scene_linear");
  EXPECT_THAT(message([&] { without.texture_space("a.png", true, ""); }),
              AllOf(HasSubstr(without.config_name()), HasSubstr("a.png"), HasSubstr("integrator.image_color_space")));
  EXPECT_EQ(color_of(text + "    aliases: [srgb_tx]\n").texture_space("a.png", true, ""), "srgb_tx");
  const std::string scans = "  - !<Rule> {name: scans, colorspace: curve, pattern: \"*scan*\", extension: \"*\"}\n";
  std::string ruled = text;
  const ColorManagement with = color_of(ruled.insert(ruled.find("  - !<Rule>"), scans));
  EXPECT_EQ(with.texture_space("/x/my_scan_1.png", true, ""), "curve");
  EXPECT_EQ(with.texture_space("/x/my_scan_1.exr", false, ""), "curve");
  EXPECT_EQ(with.texture_space("/x/my_scan_1.png", true, "aces"), "aces");
  EXPECT_EQ(with.texture_space("/x/other.exr", false, ""), "scene_linear");
}

}  // namespace
}  // namespace tensorray
