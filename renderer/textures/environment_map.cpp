#include "renderer/textures/environment_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <Eigen/LU>

#include "base/constants.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;

EnvironmentLight checked(EnvironmentLight light) {
  Image& picture = light.picture;
  if (picture.width < 1 || picture.height < 1 || picture.channels.empty() ||
      picture.pixels.size() != static_cast<std::size_t>(picture.width) * picture.height * picture.channels.size())
    throw std::invalid_argument("the environment's picture has no pixels, or not all of them");
  if (light.channel_spectra.rows() < 1 ||
      light.channel_spectra.cols() != static_cast<Eigen::Index>(picture.channels.size()))
    throw std::invalid_argument("the environment's picture needs a spectrum for each of its channels");
  if (!light.channel_spectra.allFinite() || light.channel_spectra.minCoeff() < 0)
    throw std::invalid_argument("the spectra of the environment's channels must be finite and not negative");
  const Eigen::Matrix3d& rotation = light.to_world;
  if (!((rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).norm() < 1e-6 && rotation.determinant() > 0))
    throw std::invalid_argument("the environment's to_world must be a rotation");
  for (float& value : picture.pixels) value = std::isfinite(value) ? std::max(value, 0.0f) : 0;
  return light;
}

/// Continuous pixel coordinates of a direction in the picture's frame.
Vector2d to_pixel(const Image& picture, const Vector3d& d) {
  const double turn = 0.5 - std::atan2(d.y(), d.x()) / (2 * pi);
  const double fall = std::atan2(std::hypot(d.x(), d.y()), d.z()) / pi;
  return {turn * picture.width, fall * picture.height};
}

/// The texel at a position. The left and right edges are joined; positions beyond a pole are clamped.
Vector2i texel_at(const Image& picture, const Vector2d& pixel) {
  const int x = static_cast<int>(std::floor(pixel.x())) % picture.width;
  return {x < 0 ? x + picture.width : x, std::clamp(static_cast<int>(std::floor(pixel.y())), 0, picture.height - 1)};
}

/// One of the four texels about a position, and its weight in the interpolation.
struct Neighbour {
  const float* texel;
  float weight;
};
std::array<Neighbour, 4> neighbours(const Image& picture, const Vector2d& pixel) {
  const Vector2d corner = pixel - Vector2d(0.5, 0.5);
  const double x = corner.x() - std::floor(corner.x()), y = corner.y() - std::floor(corner.y());
  const Vector2i first = texel_at(picture, corner), last = texel_at(picture, corner + Vector2d::Ones());
  return {{{picture.pixel(first.x(), first.y()), static_cast<float>((1 - x) * (1 - y))},
           {picture.pixel(last.x(), first.y()), static_cast<float>(x * (1 - y))},
           {picture.pixel(first.x(), last.y()), static_cast<float>((1 - x) * y)},
           {picture.pixel(last.x(), last.y()), static_cast<float>(x * y)}}};
}

/// 1 − cos of the angle from +z to the upper edge of a row, in a form that keeps small differences near +z accurate.
double height_above(int row, int rows) { return 2 * std::pow(std::sin(pi / 2 * row / rows), 2); }

/// A texel's part of importance(): its solid angle times the mean of the interpolated importance over the texel. The
/// mean is a sum over the neighbours with the weights (1, 6, 1) / 8 along x and along y.
std::vector<double> cell_importance(const EnvironmentLight& light, const std::vector<float>& band_importance) {
  const auto bands = static_cast<Eigen::Index>(band_importance.size());
  if (bands != light.channel_spectra.rows())
    throw std::invalid_argument("the environment's spectra need as many bands as there are importances");
  const Eigen::VectorXf weights =
      light.channel_spectra.transpose() * Eigen::Map<const Eigen::VectorXf>(band_importance.data(), bands);

  const Image& picture = light.picture;
  const int width = picture.width, height = picture.height;
  std::vector<double> across(static_cast<std::size_t>(width) * height), cells(across.size());
  for (int y = 0; y < height; ++y) {
    const auto value = [&](int x) {
      const Eigen::Map<const Eigen::VectorXf> texel(picture.pixel((x + width) % width, y), weights.size());
      return static_cast<double>(weights.dot(texel));
    };
    for (int x = 0; x < width; ++x)
      across[static_cast<std::size_t>(y) * width + x] = (value(x - 1) + 6 * value(x) + value(x + 1)) / 8;
  }
  for (int y = 0; y < height; ++y) {
    const double solid_angle = 2 * pi / width * (height_above(y + 1, height) - height_above(y, height));
    for (int x = 0; x < width; ++x) {
      const auto value = [&](int row) {
        return across[static_cast<std::size_t>(std::clamp(row, 0, height - 1)) * width + x];
      };
      cells[static_cast<std::size_t>(y) * width + x] = solid_angle * (value(y - 1) + 6 * value(y) + value(y + 1)) / 8;
    }
  }
  return cells;
}

}  // namespace

EnvironmentMap::EnvironmentMap(EnvironmentLight light, const std::vector<float>& importance)
    : light_(checked(std::move(light))),
      cells_(cell_importance(light_, importance), light_.picture.width, light_.picture.height) {}

void EnvironmentMap::add_radiance(const Vector3d& direction, std::vector<float>& radiance,
                                  std::ptrdiff_t first_band) const {
  const auto about = neighbours(light_.picture, to_pixel(light_.picture, light_.to_world.transpose() * direction));
  Eigen::Map<Eigen::VectorXf> sum(radiance.data(), static_cast<Eigen::Index>(radiance.size()));
  for (Eigen::Index channel = 0; channel < light_.channel_spectra.cols(); ++channel) {
    float value = 0;
    for (const Neighbour& neighbour : about) value += neighbour.weight * neighbour.texel[channel];
    sum += value * light_.channel_spectra.col(channel).segment(first_band, sum.size());
  }
}

double EnvironmentMap::row_height(int row) const {
  const int rows = light_.picture.height;
  return height_above(row + 1, rows) - height_above(row, rows);
}

Vector3d EnvironmentMap::sample(const Vector2d& u) const {
  const Distribution2D::Sample chosen = cells_.sample(u);
  const double height =
      height_above(chosen.cell.y(), light_.picture.height) + chosen.within.y() * row_height(chosen.cell.y());
  const double across = std::sqrt(std::max(0.0, height * (2 - height)));
  const double angle = pi - 2 * pi * (chosen.cell.x() + chosen.within.x()) / light_.picture.width;
  return light_.to_world * Vector3d(across * std::cos(angle), across * std::sin(angle), 1 - height);
}

double EnvironmentMap::pdf(const Vector3d& direction) const {
  const Vector2i texel = texel_at(light_.picture, to_pixel(light_.picture, light_.to_world.transpose() * direction));
  return cells_.probability(texel) * light_.picture.width / (2 * pi * row_height(texel.y()));
}

}  // namespace tensorray
