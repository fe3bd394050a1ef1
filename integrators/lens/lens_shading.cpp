#include "integrators/lens/lens_shading.h"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double same_look = 0.25;  // Pixels: bands whose light sees points this near share a look at the image.
constexpr double swept_pixels = 2;  // Of the image, over which a pixel's light is spread, so that one sample is enough.
constexpr double joined_pixels = 32;  // Farther apart, the points that both ends of a band see are on different sheets.

/// The footprint of a sample whose point moves along `sweep`: each is a box whose variance adds to that of the other.
Matrix2d swept(const Matrix2d& footprint, const Vector2d& sweep) {
  const Matrix2d square = footprint * footprint.transpose() + sweep * sweep.transpose();
  return square.llt().matrixL();
}

/// What one sample sees of the image.
class SampleView {
 public:
  /// @param n  Samples per pixel along x and along y.
  SampleView(const LensView& view, const TileView& points, std::size_t sample, int n)
      : view_(view), points_(points), sample_(sample), n_(n) {}

  /// Adds the light of all bands. Spans whose light sees nearly the same points share a look at the image.
  void shade(const std::vector<Span>& spans, PixelLight& pixel) const {
    for (std::size_t i = 0; i < spans.size();) {
      const Span span = spans[i++];
      if (!lands(span.from)) {
        if (lands(span.to)) look(Glimpse(*this, span.to), span.to, 0.5, span.first, span.last, pixel);
        continue;
      }
      const Glimpse glimpse(*this, span.from);
      if (!lands(span.to) || glimpse.distance(st(span.to)) > joined_pixels * n_) {
        look(glimpse, span.from, 0.5, span.first, span.last, pixel);
        if (lands(span.to)) look(Glimpse(*this, span.to), span.to, 0.5, span.first, span.last, pixel);
        continue;
      }
      std::size_t last = i;
      while (last < spans.size() && lands(spans[last].to) && glimpse.distance(st(spans[last].to)) <= same_look * n_)
        ++last;
      look(glimpse, spans[last - 1].to, 1, span.first, spans[last - 1].last, pixel);
      i = last;
    }
  }

  /// The length, in pixels, of the line of the image that the light of all bands comes from; infinite if it is not one
  /// line.
  double sweep() const {
    double length = 0;
    for (const Span& span : view_.spans) {
      if (!lands(span.from) || !lands(span.to)) return std::numeric_limits<double>::infinity();
      const double distance = Glimpse(*this, span.from).distance(st(span.to)) / n_;
      if (!(distance <= joined_pixels)) return std::numeric_limits<double>::infinity();
      length += distance;
    }
    return length;
  }

 private:
  const FlowPoint& point(std::size_t node) const { return points_[node][sample_]; }
  bool lands(std::size_t node) const { return point(node).end == RayEnd::plate; }

  Vector2d st(std::size_t node) const { return texture_coordinates(view_.light, image_point(view_, point(node))); }

  /// A point of the image, and what a sample sees about it.
  struct Glimpse {
    Vector2d st;
    Matrix2d footprint;   // Change of (s, t) per sample along x and y.
    Matrix2d to_samples;  // Its inverse.

    Glimpse(const SampleView& sample, std::size_t node)
        : st(sample.st(node)),
          footprint(sample.view_.light.image.plane.size.cwiseInverse().asDiagonal() *
                    image_by_pixel(sample.view_, sample.point(node)) / sample.n_),
          to_samples(footprint.inverse()) {}

    /// In samples.
    double distance(const Vector2d& other) const { return (to_samples * (other - st)).norm(); }
  };

  /// Adds the light of the bands from `first` to `last`, which see the line to the point of node `to`.
  void look(const Glimpse& from, std::size_t to, double share, std::size_t first, std::size_t last,
            PixelLight& pixel) const {
    const Vector2d end = st(to), middle = (from.st + end) / 2;
    if (!sees_image(view_.light, middle)) return;
    const bool is_long = from.distance(end) > same_look * n_;
    const Eigen::Vector4d texel =
        view_.light.image.texture->lookup(middle, is_long ? swept(from.footprint, end - from.st) : from.footprint)
            .cast<double>();
    if (!(texel.w() > 0)) return;
    thread_local std::vector<double> radiances;
    radiances.resize(last - first);
    view_.radiance(texel.head<3>() / texel.w(), first, last, radiances.data());
    const double part = share * texel.w() / (n_ * n_);
    for (std::size_t i = first; i < last; ++i) {
      const LensBand& band = view_.bands[i];
      pixel.color += part * radiances[i - first] * band.color;
      pixel.channels[band.channel] += part * radiances[i - first] * band.weight;
      pixel.alpha[i] += part;
    }
  }

  const LensView& view_;
  const TileView& points_;
  const std::size_t sample_;
  const double n_;
};

}  // namespace

void TileShader::shade(int x, int y, PixelLight& light) {
  const int columns = view_.flow.pixels(tile_).sizes().x() + 1, n = view_.light.settings.samples;
  const SampleView pixel(view_, whole_, static_cast<std::size_t>(y * columns + x), 1);
  const double sweep = pixel.sweep();
  if (n == 1 || (sweep >= swept_pixels && std::isfinite(sweep))) return pixel.shade(view_.spans, light);
  const bool is_still = sweep < swept_pixels;
  const std::vector<Span>& spans = is_still ? view_.few : view_.spans;
  TileView& points = is_still ? few_ : all_;
  if (points.empty()) points = view_tile(view_, tile_, n, spans, counts_);
  for (int i = 0; i < n * n; ++i) {
    const int sample = (y * n + i / n) * columns * n + x * n + i % n;
    SampleView(view_, points, static_cast<std::size_t>(sample), n).shade(spans, light);
  }
}

}  // namespace tensorray
