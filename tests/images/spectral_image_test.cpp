#include "renderer/film/spectral_image.h"

#include <clocale>
#include <stdexcept>

#include <gtest/gtest.h>

namespace tensorray {
namespace {

Film counting_film(int width, int height, int channels) {
  Film film(width, height, channels);
  for (std::size_t i = 0; i < film.values.size(); ++i) film.values[i] = 0.25 * static_cast<double>(i);
  return film;
}

TEST(LinearImageTest, EqualsTheSumOverBands) {
  const Film film = counting_film(4, 3, 2);
  std::vector<Band> bands(2);
  bands[0].xyz = {1, 2, 3};
  bands[1].xyz = {0, 0.5, 0};
  Eigen::Matrix3d matrix;
  matrix << 1, 0, 0, 0, 0, 1, 0, 2, 0;
  const Image image = linear_image(film, bands, matrix);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 4; ++x) {
      const double first = 0.25 * (y * 4 + x), second = 0.25 * (12 + y * 4 + x);
      EXPECT_FLOAT_EQ(image.pixel(x, y)[0], static_cast<float>(first));
      EXPECT_FLOAT_EQ(image.pixel(x, y)[1], static_cast<float>(3 * first));
      EXPECT_FLOAT_EQ(image.pixel(x, y)[2], static_cast<float>(2 * (2 * first + 0.5 * second)));
    }
}

TEST(SpectralImageTest, FollowsTheLayout) {
  const std::vector<Band> bands = make_bands(illuminant("D65"), 380, 730, 4);
  const Film film = counting_film(4, 3, 4);
  const SpectralImage spectral =
      spectral_image(film, bands, SpectralQuantity::irradiance, 10, Eigen::Matrix3d::Identity());
  EXPECT_EQ(spectral.image.channels, (std::vector<std::string>{"R", "G", "B", "S0.423,750000nm", "S0.511,250000nm",
                                                               "S0.598,750000nm", "S0.686,250000nm"}));
  EXPECT_EQ(spectral.metadata.at("spectralLayoutVersion"), "1.0");
  EXPECT_EQ(spectral.metadata.at("emissiveUnits"), "W.m^-2.nm^-1");
  const SpectralImage radiance =
      spectral_image(film, bands, SpectralQuantity::radiance, 10, Eigen::Matrix3d::Identity());
  EXPECT_EQ(radiance.metadata.at("emissiveUnits"), "W.m^-2.sr^-1.nm^-1");
  EXPECT_EQ(radiance.image.pixels, spectral.image.pixels);
  const Image rgb = linear_image(film, bands, Eigen::Matrix3d::Identity());
  for (int k = 0; k < 4; ++k) {
    const double expected = film.plane(k)[6] * 10 * bands[k].power / bands[k].width;
    EXPECT_FLOAT_EQ(spectral.image.pixel(2, 1)[3 + k], static_cast<float>(expected));
  }
  for (int c = 0; c < 3; ++c) EXPECT_EQ(spectral.image.pixel(2, 1)[c], rgb.pixel(2, 1)[c]);
}

TEST(SpectralImageTest, NamesHaveSixDecimalsInEveryLocale) {
  std::vector<Band> bands(3);
  bands[0].wavelength = 380;
  bands[1].wavelength = 1000 / 3.0;
  bands[2].wavelength = 1250.0000004;
  const char* const changed = std::setlocale(LC_NUMERIC, "de_DE.UTF-8");  // Null if the locale is not installed.
  for (Band& band : bands) band.width = 1;
  const Image image =
      spectral_image(Film(1, 1, 3), bands, SpectralQuantity::irradiance, 1, Eigen::Matrix3d::Identity()).image;
  std::setlocale(LC_NUMERIC, "C");
  EXPECT_EQ(image.channels[3], "S0.380,000000nm") << (changed ? changed : "C");
  EXPECT_EQ(image.channels[4], "S0.333,333333nm");
  EXPECT_EQ(image.channels[5], "S0.1250,000000nm");
}

}  // namespace
}  // namespace tensorray
