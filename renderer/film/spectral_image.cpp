#include "renderer/film/spectral_image.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

void check_channels(const Film& film, const std::vector<Band>& bands) {
  if (film.channels != static_cast<int>(bands.size()))
    throw std::invalid_argument("a film of " + std::to_string(film.channels) + " channels cannot have " +
                                std::to_string(bands.size()) + " bands");
}

/// Fills the channels R, G, B, which are the first channels of `image`.
void fill_colors(const Film& film, const std::vector<Band>& bands, const Eigen::Matrix3d& xyz_to_rgb, Image& image) {
  std::vector<Eigen::Vector3d> colors;
  for (const Band& band : bands) colors.push_back(xyz_to_rgb * band.xyz);
  tbb::parallel_for(0, film.height, [&](int y) {
    for (int x = 0; x < film.width; ++x) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      const std::size_t pixel = static_cast<std::size_t>(y) * film.width + x;
      for (std::size_t k = 0; k < colors.size(); ++k) sum += film.plane(static_cast<int>(k))[pixel] * colors[k];
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = static_cast<float>(sum[c]);
    }
  });
}

/// For example "S0.550,000000nm": the layout requires a comma as decimal sign, because a point separates layers in EXR.
std::string channel_name(double wavelength) {
  const long long millionths = std::llround(wavelength * 1e6);
  const std::string fraction = std::to_string(1000000 + millionths % 1000000).substr(1);
  return "S0." + std::to_string(millionths / 1000000) + "," + fraction + "nm";
}

}  // namespace

Image linear_image(const Film& film, const std::vector<Band>& bands, const Eigen::Matrix3d& xyz_to_rgb) {
  check_channels(film, bands);
  Image image(film.width, film.height, {"R", "G", "B"});
  fill_colors(film, bands, xyz_to_rgb, image);
  return image;
}

Image color_image(const Film& color) {
  std::vector<Band> primaries(3);
  for (int c = 0; c < 3; ++c) primaries[static_cast<std::size_t>(c)].xyz = Eigen::Vector3d::Unit(c);
  return linear_image(color, primaries, Eigen::Matrix3d::Identity());
}

SpectralImage spectral_image(const Film& film, const std::vector<Band>& bands, SpectralQuantity quantity, double beam,
                             const Eigen::Matrix3d& xyz_to_rgb) {
  check_channels(film, bands);
  std::vector<std::string> channels{"R", "G", "B"};
  for (const Band& band : bands) channels.push_back(channel_name(band.wavelength));
  const char* const unit = quantity == SpectralQuantity::radiance ? "W.m^-2.sr^-1.nm^-1" : "W.m^-2.nm^-1";
  SpectralImage result{Image(film.width, film.height, channels),
                       {{"spectralLayoutVersion", "1.0"}, {"emissiveUnits", unit}},
                       bands,
                       quantity};
  fill_colors(film, bands, xyz_to_rgb, result.image);
  tbb::parallel_for(0, film.height, [&](int y) {
    for (std::size_t k = 0; k < bands.size(); ++k) {
      const double scale = beam * bands[k].power / bands[k].width;
      const double* const row = film.plane(static_cast<int>(k)) + static_cast<std::size_t>(y) * film.width;
      for (int x = 0; x < film.width; ++x) result.image.pixel(x, y)[3 + k] = static_cast<float>(scale * row[x]);
    }
  });
  return result;
}

double relative_distance(const Image& image, const Image& exact) {
  const std::size_t colors = std::min<std::size_t>(exact.channels.size(), 3);
  if (image.width != exact.width || image.height != exact.height ||
      std::min<std::size_t>(image.channels.size(), 3) != colors)
    throw std::invalid_argument("pictures of different sizes or numbers of colours have no distance");
  double squares = 0, all = 0;
  for (int y = 0; y < exact.height; ++y)
    for (int x = 0; x < exact.width; ++x)
      for (std::size_t c = 0; c < colors; ++c) {
        const double value = exact.pixel(x, y)[c], difference = image.pixel(x, y)[c] - value;
        squares += difference * difference;
        all += value * value;
      }
  return all > 0 ? std::sqrt(squares / all) : 0;
}

}  // namespace tensorray
