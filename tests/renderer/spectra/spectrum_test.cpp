#include "renderer/spectra/spectrum.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/data_folder.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

using ::testing::HasSubstr;

/// The chromaticity of a light over the whole range of the observer.
Eigen::Vector2d chromaticity(const Spectrum& light, int count = 1) {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
  for (const Band& band : make_bands(light, observer_min, observer_max, count)) xyz += band.xyz;
  return xyz.head<2>() / xyz.sum();
}

void expect_near(const Eigen::Vector2d& actual, double x, double y, double tolerance) {
  EXPECT_NEAR(actual.x(), x, tolerance);
  EXPECT_NEAR(actual.y(), y, tolerance);
}

TEST(SpectrumTest, IsLinearBetweenSamplesAndZeroOutside) {
  const Spectrum spectrum{{400, 500, 520}, {1, 3, 0}};
  EXPECT_EQ(spectrum.at(399.999), 0);
  EXPECT_EQ(spectrum.at(400), 1);
  EXPECT_DOUBLE_EQ(spectrum.at(450), 2);
  EXPECT_EQ(spectrum.at(500), 3);
  EXPECT_DOUBLE_EQ(spectrum.at(510), 1.5);
  EXPECT_EQ(spectrum.at(520), 0);
  EXPECT_EQ(spectrum.at(521), 0);
  const Spectrum line{{589}, {2}};
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
    EXPECT_EQ(observer(wavelength), Eigen::Vector3d(x, y, z)) << wavelength;
  EXPECT_EQ(rows, 471);
}

TEST(IlluminantTest, WhitePoints) {
  expect_near(chromaticity(illuminant("D65")), 0.3127, 0.3290, 1e-4);
  expect_near(chromaticity(illuminant("A")), 0.4476, 0.4074, 1e-4);
  expect_near(chromaticity(illuminant("E")), 1 / 3.0, 1 / 3.0, 1e-4);
}

TEST(IlluminantTest, KnowsItsNames) {
  for (const std::string& name : illuminant_names()) EXPECT_DOUBLE_EQ(illuminant(name).at(560), 100) << name;
  EXPECT_THAT(message([] { illuminant("D50"); }), HasSubstr("\"D50\"; known: D65, E, A"));
}

TEST(BlackbodyTest, Chromaticities) {
  // Points of the Planckian locus (CIE 1931).
  expect_near(chromaticity(blackbody(6500)), 0.3135, 0.3237, 2e-4);
  expect_near(chromaticity(blackbody(5000)), 0.3451, 0.3516, 2e-4);
  expect_near(chromaticity(blackbody(2856)), 0.4476, 0.4074, 2e-4);
  expect_near(chromaticity(blackbody(2000)), 0.5267, 0.4133, 2e-4);
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
  EXPECT_THROW(blackbody(0), std::invalid_argument);
  EXPECT_THROW(blackbody(-1), std::invalid_argument);
  EXPECT_THROW(blackbody(std::nan("")), std::invalid_argument);
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
          EXPECT_GT(band.wavelength, low);
          EXPECT_LT(band.wavelength, high);
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
  double total = 0, total_y = 0;
  std::vector<double> power(3), z(3);
  for (int i = 0; i < 220000; ++i) {
    const double wavelength = 430 + (i + 0.5) * 1e-3;
    const int band = i * 3 / 220000;
    power[band] += light.at(wavelength);
    z[band] += light.at(wavelength) * observer(wavelength).z();
    total += light.at(wavelength);
    total_y += light.at(wavelength) * observer(wavelength).y();
  }
  for (int band = 0; band < 3; ++band) {
    EXPECT_NEAR(bands[band].power, power[band] / total, 1e-5);
    EXPECT_NEAR(bands[band].xyz.z(), z[band] / total_y, 1e-5);
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
  const std::vector<std::string> contents{
      "400 1\n500 2.5e0\n600 0\n",
      "# a lamp\nwavelength_nm,power\n400,1\n\n500, +2.5 # peak\r\n600,0",
      "\xEF\xBB\xBFnm;value\r\n400;1\r\n500;2.5\r\n600;0\r\n",
      "  400\t1\n\t500\t2.50\n600 0\n",
  };
  for (const std::string& content : contents) {
    const Temporary file("good.csv", content);
    const Spectrum spectrum = read_spectrum(file.path());
    EXPECT_EQ(spectrum.wavelengths, (std::vector<double>{400, 500, 600})) << content;
    EXPECT_EQ(spectrum.values, (std::vector<double>{1, 2.5, 0})) << content;
  }
}

TEST(ReadSpectrumTest, ErrorsNameFileLineAndMend) {
  const auto error = [](const std::string& content) {
    const Temporary file("bad.csv", content);
    const std::string text = message([&] { read_spectrum(file.path()); });
    EXPECT_THAT(text, HasSubstr(file.path().string()));
    return text;
  };
  EXPECT_THAT(error(""), HasSubstr("empty"));
  EXPECT_THAT(error("# nothing\n"), HasSubstr("no samples"));
  EXPECT_THAT(error("nm,value\n"), HasSubstr("no samples"));
  EXPECT_THAT(error("400 1\n500\n"), HasSubstr("line 2: expected two columns"));
  EXPECT_THAT(error("400 1 2\n"), HasSubstr("line 1: expected two columns"));
  EXPECT_THAT(error("nm value\nmore words\n400 1\n"), HasSubstr("line 2: expected two numbers"));
  EXPECT_THAT(error("400 1\n500 2x\n"), HasSubstr("line 2: expected two numbers"));
  EXPECT_THAT(error("400 1\n400 2\n"), HasSubstr("line 2: wavelengths must increase"));
  EXPECT_THAT(error("500 1\n400 2\n"), HasSubstr("line 2: wavelengths must increase"));
  EXPECT_THAT(error("400 -1\n"), HasSubstr("line 1: the value must be finite and not negative"));
  EXPECT_THAT(error("400 inf\n"), HasSubstr("line 1: the value must be finite and not negative"));
  EXPECT_THAT(error("400 nan\n"), HasSubstr("line 1: the value must be finite and not negative"));
  EXPECT_THAT(error("-400 1\n"), HasSubstr("line 1: the wavelength must be above 0"));
  EXPECT_THAT(message([] { read_spectrum("/no/such.csv"); }), HasSubstr("/no/such.csv: no such file"));
  EXPECT_THAT(message([] { read_spectrum(::testing::TempDir()); }), HasSubstr("folder"));
}

}  // namespace
}  // namespace tensorray
