#include "renderer/textures/texture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "renderer/textures/image_pyramid.h"

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector4f;

/// The ellipse of the picture that a pixel sees, in texels.
struct Ellipse {
  double major = 1;                       ///< Length of the longer axis (for a circular pixel, its diameter).
  double minor = 1;                       ///< Length of the shorter axis.
  Vector2d direction = Vector2d::Zero();  ///< Direction of the longer axis, unit.
};

/// The image of the unit circle under `footprint`, by its singular values.
Ellipse make_ellipse(const Matrix2d& footprint) {
  const Matrix2d square = footprint * footprint.transpose();
  const double middle = 0.5 * (square(0, 0) + square(1, 1)), difference = 0.5 * (square(0, 0) - square(1, 1));
  const double radius = std::sqrt(difference * difference + square(0, 1) * square(0, 1));
  Vector2d direction(1, 0);
  if (radius > 0)
    direction = difference > 0 ? Vector2d(radius + difference, square(0, 1)).normalized()
                               : Vector2d(square(0, 1), radius - difference).normalized();
  return {std::sqrt(middle + radius), std::sqrt(std::max(0.0, middle - radius)), direction};
}

/// Whether a footprint is finite and small enough for a filter; a larger one gives the mean of the picture.
bool is_resolved(const Matrix2d& footprint) { return (footprint.array().abs() < 1e6).all(); }

/// Limits the ellipse: no axis is shorter than a texel, and the ratio of the axes does not need too many probes.
Ellipse limit(Ellipse ellipse, double longest) {
  constexpr double largest_ratio = 32;
  ellipse.minor = std::max({ellipse.minor, 1.0, ellipse.major / largest_ratio});
  ellipse.major = std::clamp(ellipse.major, ellipse.minor, std::max(longest, ellipse.minor));
  return ellipse;
}

/// The equivalent coordinate near the picture, where single precision resolves it.
double bring_near(double coordinate, Wrap wrap) {
  if (wrap == Wrap::repeat) return coordinate - std::floor(coordinate);
  if (wrap == Wrap::mirror) return coordinate - 2 * std::floor(coordinate / 2);
  return std::clamp(coordinate, -1.0, 2.0);
}

/// The texel at an index along an axis of `size` texels, as the picture continues; -1: nothing.
int wrapped(int index, int size, Wrap wrap) {
  if (index >= 0 && index < size) return index;
  if (wrap == Wrap::none) return -1;
  if (wrap == Wrap::clamp) return index < 0 ? 0 : size - 1;
  const int period = wrap == Wrap::mirror ? 2 * size : size, within = (index % period + period) % period;
  return within < size ? within : 2 * size - 1 - within;
}

/// Linear between the texels of a level. @param st  Here t goes from the top downwards.
Vector4f interpolate(const ImagePyramid& pyramid, int level, const Vector2d& st, Wrap wrap) {
  const int width = pyramid.width(level), height = pyramid.height(level);
  const double x = st.x() * width - 0.5, y = st.y() * height - 0.5;
  const double left = std::floor(x), top = std::floor(y);
  const auto right_part = static_cast<float>(x - left), lower_part = static_cast<float>(y - top);
  const auto texel = [&](int column, int row) -> Vector4f {
    column = wrapped(column, width, wrap);
    row = wrapped(row, height, wrap);
    if (column < 0 || row < 0) return Vector4f::Zero();
    return pyramid.texel(level, column, row);
  };
  const auto column = static_cast<int>(left), row = static_cast<int>(top);
  const Vector4f upper = (1 - right_part) * texel(column, row) + right_part * texel(column + 1, row);
  const Vector4f lower = (1 - right_part) * texel(column, row + 1) + right_part * texel(column + 1, row + 1);
  return (1 - lower_part) * upper + lower_part * lower;
}

/// The levels to mix: `blend` is the weight of level + 1.
struct LevelChoice {
  int level;
  float blend;
};

/// Texels of level L are 2^L texels large. Between two levels the weight is linear in the size.
LevelChoice choose_level(double size, int levels) {
  constexpr double rounding = 1e-3;  // Tolerance for a footprint of one texel that was computed with errors.
  if (size <= 1 + rounding) return {0, 0.0f};
  const int level = std::ilogb(size);
  if (level >= levels - 1) return {levels - 1, 0.0f};
  return {level, static_cast<float>(std::ldexp(size, -level) - 1)};
}

}  // namespace

struct Texture::State {
  State(NativeImage image, ColorConversion conversion, Wrap wrap_)
      : pyramid(std::move(image), std::move(conversion)), wrap(wrap_) {}

  Vector4f mean(const Vector2d& st) const;
  Vector4f probe(const Vector2d& st, LevelChoice choice) const;

  ImagePyramid pyramid;
  Wrap wrap;
};

Vector4f Texture::State::probe(const Vector2d& st, LevelChoice choice) const {
  const Vector2d place(bring_near(st.x(), wrap), bring_near(1 - st.y(), wrap));
  Vector4f result = interpolate(pyramid, choice.level, place, wrap);
  if (choice.blend > 0) result += choice.blend * (interpolate(pyramid, choice.level + 1, place, wrap) - result);
  return result;
}

Texture::Texture(Image image, Wrap wrap)
    : state_(std::make_unique<State>(native_image(std::move(image)), ColorConversion(), wrap)) {}

Texture::Texture(const std::filesystem::path& file, const ColorManagement& color, const std::string& color_space,
                 Wrap wrap, const std::string& layer, std::vector<std::string>* notes) {
  std::vector<std::string> unread;
  NativeImage image = read_native_image(file, layer);
  add_notes(file, image, notes ? *notes : unread);
  ColorConversion conversion = color.picture_conversion(file, image, color_space, notes ? *notes : unread);
  state_ = std::make_unique<State>(std::move(image), std::move(conversion), wrap);
}

Texture::~Texture() = default;
Texture::Texture(Texture&&) noexcept = default;
Texture& Texture::operator=(Texture&&) noexcept = default;

int Texture::width() const { return state_->pyramid.width(0); }
int Texture::height() const { return state_->pyramid.height(0); }

/// The mean of the picture, or transparent black outside a picture that does not continue beyond its edges.
Vector4f Texture::State::mean(const Vector2d& st) const {
  const bool outside = (st.array() < 0).any() || (st.array() > 1).any();
  return outside && wrap == Wrap::none ? Vector4f::Zero() : pyramid.mean();
}

/// Probes lie along the longer axis, at distances of at most the length of the shorter axis. Each probe is a bilinear
/// tent in the level whose texels are as large as the shorter axis. Together the probes form a box as long as the
/// longer axis.
Vector4f Texture::lookup(const Vector2d& st, const Matrix2d& footprint) const {
  if (!st.allFinite()) return Vector4f::Zero();
  if (!is_resolved(footprint)) return state_->mean(st);
  const Vector2d size(width(), height());
  const Ellipse ellipse = limit(make_ellipse(size.asDiagonal() * footprint), size.maxCoeff());
  if (ellipse.minor >= size.maxCoeff()) return state_->mean(st);
  const LevelChoice choice = choose_level(ellipse.minor, state_->pyramid.levels());
  const int probes = std::max(1, static_cast<int>(std::ceil(ellipse.major / ellipse.minor - 1e-3)));
  const Vector2d line = (ellipse.major - ellipse.minor) * ellipse.direction.cwiseQuotient(size);
  Vector4f sum = Vector4f::Zero();
  for (int i = 0; i < probes; ++i) sum += state_->probe(st + ((i + 0.5) / probes - 0.5) * line, choice);
  return sum / static_cast<float>(probes);
}

}  // namespace tensorray
