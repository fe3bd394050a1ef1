#include "renderer/textures/texture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector4f;

/// Pictures of up to so many pixels are stored at all sizes: 340 MiB.
constexpr std::size_t small_picture = std::size_t{1} << 24;

int halved(int size, int level) { return std::max(1, size >> level); }

/// The part of a larger level that one pixel of a smaller level covers, along one axis.
struct Cover {
  int begin;     ///< The first pixel that it touches.
  int end;       ///< One after the last pixel.
  double first;  ///< How much of the first pixel is covered, from 0 to 1.
  double last;   ///< How much of the last pixel is covered, if it is not the first one.

  double weight(int i) const { return i == begin ? first : i + 1 == end ? last : 1.0; }
};

/// Pixel `i` of `small` covers the range [i, i + 1) * large / small. Integer arithmetic makes the bounds exact.
Cover cover(int i, int small, int large) {
  const std::int64_t from = static_cast<std::int64_t>(i) * large, to = from + large;
  const int begin = static_cast<int>(from / small), end = static_cast<int>((to + small - 1) / small);
  const auto part = [small](std::int64_t numerator) { return static_cast<double>(numerator) / small; };
  const std::int64_t first_end = std::min((static_cast<std::int64_t>(begin) + 1) * small, to);
  return {begin, end, part(first_end - from), part(to - (static_cast<std::int64_t>(end) - 1) * small)};
}

/// Converts colours to scene-linear and multiplies them by alpha. If they are already multiplied, divides by alpha
/// before the conversion, because its curves need plain colours. Those of alpha 0 (a glow) are not divided.
void convert(const NativeImage& image, const ColorConversion& conversion, int count, float* rgba) {
  const auto scale = [&](bool out) {
    for (float* pixel = rgba; pixel != rgba + static_cast<std::size_t>(count) * 4; pixel += 4)
      if (pixel[3] != 1 && (pixel[3] > 0 || !image.is_premultiplied))
        for (int c = 0; c < 3; ++c) pixel[c] = out ? pixel[c] / pixel[3] : pixel[c] * pixel[3];
  };
  const bool take_out = image.is_premultiplied && conversion;
  if (take_out) scale(true);
  if (conversion) conversion(rgba, static_cast<std::size_t>(count));
  if (take_out || !image.is_premultiplied) scale(false);
}

/// A picture in scene-linear light at its full size and at smaller sizes (a MIP map).
///
/// Levels of R, G, B, A with the colours multiplied by alpha. Level 0 is the picture. Each further level has half the
/// width and height (rounded down, at least 1); the last level is a single pixel. A pixel of a level is the exact mean
/// over its area for any size of the picture. Memory: 21 bytes for each pixel of a picture of up to 16 million pixels,
/// of which all levels are stored. Of a larger one, the picture as its file stores it, whose pixels are converted when
/// they are read, and 5 bytes for each pixel, which its other levels take. Levels are made on all threads. Immutable.
class ImagePyramid {
 public:
  /// @param conversion  From the colours of the picture to scene-linear colours.
  ImagePyramid(NativeImage image, ColorConversion conversion)
      : image_(std::move(image)),
        conversion_(std::move(conversion)),
        first_stored_(static_cast<std::size_t>(image_.width) * image_.height <= small_picture ? 0 : 1) {
    for (int level = first_stored_; level < levels(); ++level) {
      std::vector<float> pixels(static_cast<std::size_t>(width(level)) * height(level) * 4);
      tbb::parallel_for(0, height(level), [&](int y) {
        float* const row = &pixels[static_cast<std::size_t>(y) * width(level) * 4];
        if (level == 0)
          read_picture(0, y, width(0), row);
        else
          reduce_row(level, y, row);
      });
      stored_.push_back(std::move(pixels));
    }
    if (first_stored_ == 0) image_.samples.reset();
  }

  int levels() const {
    int count = 1;
    for (int size = std::max(image_.width, image_.height); size > 1; size /= 2) ++count;
    return count;
  }
  int width(int level) const { return halved(image_.width, level); }
  int height(int level) const { return halved(image_.height, level); }
  Vector4f mean() const { return texel(levels() - 1, 0, 0); }  ///< Of all pixels.

  /// A pixel of a level: R, G, B, A. x and y count from the upper left one.
  Vector4f texel(int level, int x, int y) const {
    Vector4f rgba;
    read_row(level, x, y, 1, rgba.data());
    return rgba;
  }

 private:
  void read_row(int level, int x, int y, int count, float* rgba) const {
    if (level < first_stored_) return read_picture(x, y, count, rgba);
    const std::size_t first = static_cast<std::size_t>(y) * width(level) + x;
    std::copy_n(stored_[static_cast<std::size_t>(level - first_stored_)].data() + first * 4,
                static_cast<std::size_t>(count) * 4, rgba);
  }

  void read_picture(int x, int y, int count, float* rgba) const {
    read_pixels(image_, x, y, count, rgba);
    convert(image_, conversion_, count, rgba);
  }

  /// Averages the pixels of the level before that each pixel of a row covers.
  void reduce_row(int level, int y, float* rgba) const {
    const int from = level - 1, count = width(level);
    const Cover rows = cover(y, height(level), height(from));
    std::vector<float> line(static_cast<std::size_t>(width(from)) * 4);
    std::vector<Eigen::Vector4d> sums(count, Eigen::Vector4d::Zero());
    for (int row = rows.begin; row < rows.end; ++row) {
      read_row(from, 0, row, width(from), line.data());
      for (int i = 0; i < count; ++i) {
        const Cover columns = cover(i, count, width(from));
        for (int column = columns.begin; column < columns.end; ++column)
          sums[i] += rows.weight(row) * columns.weight(column) *
                     Eigen::Map<const Eigen::Vector4f>(&line[static_cast<std::size_t>(column) * 4]).cast<double>();
      }
    }
    const double area = static_cast<double>(width(from)) / count * height(from) / height(level);
    for (int i = 0; i < count; ++i)
      Eigen::Map<Eigen::Vector4f>(rgba + static_cast<std::size_t>(i) * 4) = (sums[i] / area).cast<float>();
  }

  NativeImage image_;
  ColorConversion conversion_;
  int first_stored_;
  std::vector<std::vector<float>> stored_;  ///< Levels from first_stored_ on.
};

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

  /// The mean of the picture, or transparent black outside a picture that does not continue beyond its edges.
  Vector4f mean(const Vector2d& st) const {
    const bool outside = (st.array() < 0).any() || (st.array() > 1).any();
    return outside && wrap == Wrap::none ? Vector4f::Zero() : pyramid.mean();
  }

  Vector4f probe(const Vector2d& st, LevelChoice choice) const {
    const Vector2d place(bring_near(st.x(), wrap), bring_near(1 - st.y(), wrap));
    Vector4f result = interpolate(pyramid, choice.level, place, wrap);
    if (choice.blend > 0) result += choice.blend * (interpolate(pyramid, choice.level + 1, place, wrap) - result);
    return result;
  }

  ImagePyramid pyramid;
  Wrap wrap;
};

Texture::Texture(Image image, Wrap wrap)
    : state_(std::make_shared<State>(native_image(std::move(image)), ColorConversion(), wrap)) {}

Texture::Texture(const std::filesystem::path& file, const ColorManagement& color, const std::string& color_space,
                 Wrap wrap, const std::string& layer, std::vector<std::string>* notes) {
  std::vector<std::string> unread;
  NativeImage image = read_native_image(file, layer);
  add_notes(file, image, notes ? *notes : unread);
  ColorConversion conversion = color.picture_conversion(file, image, color_space, notes ? *notes : unread);
  state_ = std::make_shared<State>(std::move(image), std::move(conversion), wrap);
}

int Texture::width() const { return state_->pyramid.width(0); }
int Texture::height() const { return state_->pyramid.height(0); }

/// Probes lie along the longer axis, at distances of at most the length of the shorter axis. Each probe is a bilinear
/// tent in the level whose texels are as large as the shorter axis. Together they form a box as long as it.
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
