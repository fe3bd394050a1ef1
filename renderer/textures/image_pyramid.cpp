#include "renderer/textures/image_pyramid.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

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
/// before the conversion, because its curves need plain colours. Colours with alpha 0 (a glow) are converted without
/// division.
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

}  // namespace

ImagePyramid::ImagePyramid(NativeImage image, ColorConversion conversion)
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

int ImagePyramid::levels() const {
  int count = 1;
  for (int size = std::max(image_.width, image_.height); size > 1; size /= 2) ++count;
  return count;
}

int ImagePyramid::width(int level) const { return halved(image_.width, level); }
int ImagePyramid::height(int level) const { return halved(image_.height, level); }

Eigen::Vector4f ImagePyramid::mean() const { return texel(levels() - 1, 0, 0); }

Eigen::Vector4f ImagePyramid::texel(int level, int x, int y) const {
  Eigen::Vector4f rgba;
  read_row(level, x, y, 1, rgba.data());
  return rgba;
}

void ImagePyramid::read_row(int level, int x, int y, int count, float* rgba) const {
  if (level < first_stored_) return read_picture(x, y, count, rgba);
  const std::size_t first = static_cast<std::size_t>(y) * width(level) + x;
  std::copy_n(stored_[static_cast<std::size_t>(level - first_stored_)].data() + first * 4,
              static_cast<std::size_t>(count) * 4, rgba);
}

void ImagePyramid::read_picture(int x, int y, int count, float* rgba) const {
  read_pixels(image_, x, y, count, rgba);
  convert(image_, conversion_, count, rgba);
}

/// Averages the pixels of the level before that each pixel of a row covers.
void ImagePyramid::reduce_row(int level, int y, float* rgba) const {
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

}  // namespace tensorray
