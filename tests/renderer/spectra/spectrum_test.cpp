#include "renderer/spectra/spectrum.h"

#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "renderer/color/color.h"
#include "renderer/spectra/reflectance.h"
#include "tests/data_folder.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

/// Of a light over the whole range of the observer.
void expect_chromaticity(const Spectrum& light, double x, double y, double tolerance) {
  const Vector3d xyz = make_bands(light, observer_min, observer_max, 1).front().xyz;
  EXPECT_NEAR(xyz.x() / xyz.sum(), x, tolerance);
  EXPECT_NEAR(xyz.y() / xyz.sum(), y, tolerance);
}

TEST(SpectrumTest, IsLinearBetweenSamplesAndZeroOutside) {
  const Spectrum spectrum{{400, 500, 520}, {1, 3, 0}}, line{{589}, {2}};
  for (const auto& [wavelength, value] : std::vector<std::pair<double, double>>{
           {399.999, 0}, {400, 1}, {450, 2}, {500, 3}, {510, 1.5}, {520, 0}, {521, 0}})
    EXPECT_DOUBLE_EQ(spectrum.at(wavelength), value) << wavelength;
  EXPECT_EQ(line.at(589), 2);
  EXPECT_EQ(line.at(589.1), 0);
}

TEST(ObserverTest, EqualsTheReferenceTable) {
  const std::filesystem::path folder = test::data_folder();
  std::ifstream file(folder / "../reference/cie1931_2deg_1nm.csv");
  if (!file) GTEST_SKIP() << "no reference table beside " << folder;
  std::string heading;
  std::getline(file, heading);
  double wavelength = 0, x = 0, y = 0, z = 0;
  char comma = 0;
  int rows = 0;
  for (; file >> wavelength >> comma >> x >> comma >> y >> comma >> z; ++rows)
    EXPECT_EQ(observer(wavelength), Vector3d(x, y, z)) << wavelength;
  EXPECT_EQ(rows, 471);
}

TEST(SpectrumTest, LightsHaveTheirChromaticities) {
  expect_chromaticity(illuminant("D65"), 0.3127, 0.3290, 1e-4);
  expect_chromaticity(illuminant("A"), 0.4476, 0.4074, 1e-4);
  expect_chromaticity(illuminant("E"), 1 / 3.0, 1 / 3.0, 1e-4);
  // Of the Planckian locus (CIE 1931).
  expect_chromaticity(blackbody(6500), 0.3135, 0.3237, 2e-4);
  expect_chromaticity(blackbody(5000), 0.3451, 0.3516, 2e-4);
  expect_chromaticity(blackbody(2856), 0.4476, 0.4074, 2e-4);
  expect_chromaticity(blackbody(2000), 0.5267, 0.4133, 2e-4);
}

TEST(IlluminantTest, KnowsItsNames) {
  for (const std::string& name : illuminant_names()) EXPECT_DOUBLE_EQ(illuminant(name).at(560), 100) << name;
  EXPECT_THAT(message([] { illuminant("D50"); }), HasSubstr("\"D50\"; known: D65, E, A"));
}

TEST(BlackbodyTest, FollowsPlanckAtAllTemperatures) {
  EXPECT_DOUBLE_EQ(blackbody(6500).at(560), 1);
  // Wien's displacement: 2.897771955e6 nm K / 5000 K = 579.55 nm.
  const Spectrum light = blackbody(5000);
  const std::size_t peak = std::max_element(light.values.begin(), light.values.end()) - light.values.begin();
  EXPECT_NEAR(light.wavelengths[peak], 579.55, 0.6);
  for (const double kelvin : {100.0, 1000.0, 1e9})
    for (const double value : blackbody(kelvin).values) ASSERT_TRUE(std::isfinite(value) && value >= 0) << kelvin;
  EXPECT_NEAR(blackbody(1e9).at(400), std::pow(560 / 400.0, 4), 1e-4);  // Rayleigh and Jeans.
  for (const double kelvin : {0.0, -1.0, std::nan("")}) EXPECT_THROW(blackbody(kelvin), std::invalid_argument);
}

TEST(BandsTest, SumsHoldForEveryCount) {
  for (const auto& [low, high] : {std::pair(380.0, 730.0), std::pair(200.0, 1200.0)})  // Also beyond the observer.
    for (const std::string& name : illuminant_names())
      for (const int count : {1, 2, 3, 7, 32, 89, 470, 1000}) {
        double power = 0, luminance = 0, width = 0;
        for (const Band& band : make_bands(illuminant(name), low, high, count)) {
          power += band.power;
          luminance += band.xyz.y();
          width += band.width;
          EXPECT_TRUE(band.wavelength > low && band.wavelength < high) << band.wavelength;
        }
        EXPECT_NEAR(power, 1, 1e-12);
        EXPECT_NEAR(luminance, 1, 1e-12);
        EXPECT_NEAR(width, high - low, 1e-9);
      }
}

TEST(BandsTest, EqualsAFineSum) {
  // Midpoint rule with steps of 1e-3 nm; its error is second order, and first order only at jumps of the light.
  const Spectrum light{{450.25, 500, 612.5}, {1, 4, 2}};
  const std::vector<Band> bands = make_bands(light, 430, 650, 3);
  Vector3d power(0, 0, 0);
  Matrix3d xyz = Matrix3d::Zero();
  for (int i = 0; i < 220000; ++i) {
    const double wavelength = 430 + (i + 0.5) * 1e-3;
    const int band = i * 3 / 220000;
    power[band] += light.at(wavelength);
    xyz.col(band) += light.at(wavelength) * observer(wavelength);
  }
  for (int band = 0; band < 3; ++band) {
    EXPECT_NEAR(bands[band].power, power[band] / power.sum(), 1e-5);
    EXPECT_TRUE(((bands[band].xyz - xyz.col(band) / xyz.row(1).sum()).array().abs() < 1e-5).all());
  }
}

TEST(BandsTest, MonochromaticLight) {
  const std::vector<Band> bands = make_bands(Spectrum{{550}, {5}}, 550, 550, 1);
  ASSERT_EQ(bands.size(), 1u);
  EXPECT_EQ(bands[0].wavelength, 550);
  EXPECT_EQ(bands[0].width, 1);
  EXPECT_EQ(bands[0].power, 1);
  EXPECT_TRUE(bands[0].xyz.isApprox(observer(550) / observer(550).y(), 1e-14));
}

TEST(ReadSpectrumTest, ReadsColumns) {
  for (const std::string content :
       {"400 1\n500 2.5e0\n600 0\n", "# a lamp\nwavelength_nm,power\n400,1\n\n500, +2.5 # peak\r\n600,0",
        "\xEF\xBB\xBFnm;value\r\n400;1\r\n500;2.5\r\n600;0\r\n", "  400\t1\n\t500\t2.50\n600 0\n"}) {
    const Temporary file("good.csv", content);
    const Spectrum spectrum = read_spectrum(file);
    EXPECT_THAT(spectrum.wavelengths, ElementsAre(400, 500, 600)) << content;
    EXPECT_THAT(spectrum.values, ElementsAre(1, 2.5, 0)) << content;
  }
}

TEST(ReadSpectrumTest, ErrorsNameFileLineAndMend) {
  for (const auto& [content, error] : std::vector<std::pair<std::string, std::string>>{
           {"", "empty"},
           {"# nothing\n", "no samples"},
           {"nm,value\n", "no samples"},
           {"400 1\n500\n", "line 2: expected two columns"},
           {"400 1 2\n", "line 1: expected two columns"},
           {"nm value\nmore words\n400 1\n", "line 2: expected two numbers"},
           {"400 1\n500 2x\n", "line 2: expected two numbers"},
           {"400 1\n400 2\n", "line 2: wavelengths must increase"},
           {"500 1\n400 2\n", "line 2: wavelengths must increase"},
           {"400 -1\n", "line 1: the value must be finite and not negative"},
           {"400 inf\n", "line 1: the value must be finite and not negative"},
           {"400 nan\n", "line 1: the value must be finite and not negative"},
           {"-400 1\n", "line 1: the wavelength must be above 0"}}) {
    const Temporary file("bad.csv", content);
    EXPECT_THAT(message([&] { read_spectrum(file); }), AllOf(HasSubstr(file.string()), HasSubstr(error)));
  }
  EXPECT_THAT(message([] { read_spectrum("/no/such.csv"); }), HasSubstr("/no/such.csv: no such file"));
  EXPECT_THAT(message([] { read_spectrum(::testing::TempDir()); }), HasSubstr("folder"));
}

/// A light in bands, the colours of the bands in the working space, and the model made from them.
struct Scene {
  std::vector<Band> bands;
  Matrix3d xyz_to_rgb;
  ReflectanceModel model;

  /// The colour of a spectrum (any type with at()) in this light.
  template <class Reflectance>
  Vector3d color(const Reflectance& reflectance) const {
    Vector3d xyz = Vector3d::Zero();
    for (const Band& band : bands) xyz += reflectance.at(band.wavelength) * band.xyz;
    return xyz_to_rgb * xyz;
  }
};

/// The built-in config; its working space has the primaries of Rec.709.
ColorManagement rec709() {
  unsetenv("OCIO");
  return ColorManagement({});
}

Scene make_scene(const Spectrum& light, int count, const Matrix3d& from_rec709 = Matrix3d::Identity()) {
  const std::vector<Band> bands = make_bands(light, 380, 730, count);
  Vector3d white = Vector3d::Zero();
  for (const Band& band : bands) white += band.xyz;
  const Matrix3d xyz_to_rgb = from_rec709 * rec709().xyz_to_working_adapted(white);
  return {bands, xyz_to_rgb, ReflectanceModel(bands, xyz_to_rgb)};
}

/// The matrix from linear Rec.709 to ACEScg that maps white to white (Bradford).
Matrix3d rec709_to_acescg() {
  Matrix3d matrix;
  matrix << 0.613097, 0.339523, 0.047379, 0.070194, 0.916354, 0.013452, 0.020616, 0.109570, 0.869815;
  return matrix;
}

/// The cube [least, most]³, corners and edges included.
std::vector<Vector3d> cube(int steps, double least = 0, double most = 1) {
  std::vector<Vector3d> colors;
  for (int r = 0; r <= steps; ++r)
    for (int g = 0; g <= steps; ++g)
      for (int b = 0; b <= steps; ++b)
        colors.push_back(Vector3d::Constant(least) + (most - least) / steps * Vector3d(r, g, b));
  return colors;
}

/// The smallest distance to a colour that any reflectances of the bands within [0, 1], smooth or not, can reach. A
/// convex problem, solved by optimising one band after the other.
double min_distance(const Scene& scene, const Vector3d& rgb) {
  std::vector<double> reflectances(scene.bands.size(), 0);
  Vector3d residual = -rgb;
  for (double before = INFINITY; residual.norm() < before - 1e-7;) {
    before = residual.norm();
    for (int sweep = 0; sweep < 100; ++sweep)
      for (std::size_t k = 0; k < scene.bands.size(); ++k) {
        const Vector3d color = scene.xyz_to_rgb * scene.bands[k].xyz;
        const double last = reflectances[k];
        reflectances[k] = std::clamp(last - color.dot(residual) / color.squaredNorm(), 0.0, 1.0);
        residual += (reflectances[k] - last) * color;
      }
  }
  return residual.norm();
}

TEST(ReflectanceTest, ColorsComeBack) {
  for (const Spectrum& light : {illuminant("D65"), illuminant("A"), illuminant("E"), blackbody(5500)})
    for (const int count : {10, 16, 32, 70}) {
      const Scene scene = make_scene(light, count);
      for (const Vector3d& rgb : cube(14)) {
        const Vector3d result = scene.color(scene.model.spectrum(rgb));
        // OpenColorIO's matrices, and therefore the white, are in single precision.
        ASSERT_LT((result - rgb).norm(), 3e-7) << light.at(400) << ", " << count << " bands: " << rgb.transpose();
      }
    }
}

TEST(ReflectanceTest, WideGamutComesAsNearAsAnyReflectance) {
  int out_of_reach = 0;
  const Scene scene = make_scene(illuminant("D65"), 16, rec709_to_acescg());
  for (const Vector3d& rgb : cube(6)) {
    const double least = min_distance(scene, rgb);
    out_of_reach += least > 1e-3;
    EXPECT_LT((scene.color(scene.model.spectrum(rgb)) - rgb).norm(), least + 0.01) << rgb.transpose();
  }
  EXPECT_GT(out_of_reach, 10);
}

TEST(ReflectanceTest, SpectraOfTheModelAreFoundAgain) {
  const Scene scene = make_scene(illuminant("D65"), 32);
  for (const Vector3d& c : cube(6, -3, 3)) {
    const ReflectanceSpectrum wanted{{c[0], c[1], c[2]}, 1};
    const Vector3d rgb = scene.color(wanted);
    if (rgb.minCoeff() < 0 || rgb.maxCoeff() > 1 || rgb.maxCoeff() < 0.05) continue;
    const ReflectanceSpectrum found = scene.model.spectrum(rgb);
    for (double wavelength = 380; wavelength <= 730; wavelength += 10)
      ASSERT_NEAR(found.at(wavelength), wanted.at(wavelength), 1e-5) << c.transpose() << " at " << wavelength;
  }
}

TEST(ReflectanceTest, IsWithinZeroAndOneAndDeterministic) {
  for (const Matrix3d& space : {Matrix3d(Matrix3d::Identity()), rec709_to_acescg()})
    for (const int count : {1, 2, 3, 4, 5, 16}) {
      const Scene scene = make_scene(illuminant("D65"), count, space),
                  other = make_scene(illuminant("D65"), count, space);
      for (const Vector3d& rgb : cube(5)) {
        const ReflectanceSpectrum spectrum = scene.model.spectrum(rgb);
        EXPECT_EQ(spectrum.coefficients, other.model.spectrum(rgb).coefficients);
        for (double wavelength = 360; wavelength <= 830; wavelength += 5)
          ASSERT_TRUE(spectrum.at(wavelength) >= 0 && spectrum.at(wavelength) <= 1)
              << count << ": " << rgb.transpose() << " at " << wavelength;
      }
    }
}

TEST(ReflectanceTest, GreyIsConstant) {
  for (const int count : {1, 2, 16}) {
    const Scene scene = make_scene(illuminant("A"), count);
    for (const double grey : {0.0, 1e-30, 0.01, 0.18, 0.5, 1.0, 7.3})
      for (const double wavelength : {380.0, 555.0, 730.0})
        EXPECT_DOUBLE_EQ(scene.model.spectrum(Vector3d::Constant(grey)).at(wavelength), grey);
  }
}

TEST(ReflectanceTest, NegativeIsZeroAndWhatIsNotFiniteIsBlack) {
  const Scene scene = make_scene(illuminant("D65"), 16);
  EXPECT_EQ(scene.model.spectrum({-1, 0.5, 0.2}).coefficients, scene.model.spectrum({0, 0.5, 0.2}).coefficients);
  for (const Vector3d& black : {Vector3d(0, -1, -2), Vector3d(NAN, 1, 1), Vector3d(0.2, INFINITY, 0),
                                Vector3d(0.2, 0.1, NAN), Vector3d(-INFINITY, 1, 1)})
    EXPECT_EQ(scene.model.spectrum(black).at(555), 0) << black.transpose();
}

TEST(ReflectanceTest, ScalesAboveOneAndNearBlack) {
  const Scene scene = make_scene(illuminant("D65"), 16);
  for (const Vector3d& rgb : {Vector3d(1, 0.2, 0.1), Vector3d(0.3, 1, 0.9), Vector3d(0, 0, 1)})
    for (const double factor : {1e-300, 1e-9, 0.01, 2.5, 1e9}) {
      const Vector3d wanted = factor * rgb;
      const ReflectanceSpectrum spectrum = scene.model.spectrum(wanted);
      EXPECT_LT((scene.color(spectrum) - wanted).norm(), 1e-7 * factor) << wanted.transpose();
      if (factor < 1) continue;
      for (const double wavelength : {400.0, 500.0, 600.0, 700.0})
        EXPECT_NEAR(spectrum.at(wavelength) / factor, scene.model.spectrum(rgb).at(wavelength), 1e-5);
    }
}

TEST(ReflectanceTest, LightOfOneWavelength) {
  const std::vector<Band> bands = make_bands(illuminant("D65"), 550, 550, 1);
  const ReflectanceModel model(bands, rec709().xyz_to_working_adapted(bands.front().xyz));
  // All colours of this model are neutral: the nearest one to a colour is the mean of its components.
  EXPECT_NEAR(model.spectrum({0.9, 0.3, 0.6}).at(550), 0.6, 1e-5);
  EXPECT_NEAR(model.spectrum({0, 0, 0.3}).at(550), 0.1, 1e-5);
}

}  // namespace
}  // namespace tensorray
