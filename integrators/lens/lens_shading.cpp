#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/LU>

#include "integrators/lens/lens_view.h"

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double same_look = 0.25;     // Pixels: bands whose light sees points this near share a look at the image.
constexpr std::size_t few_spans = 4;   // Of light that is hardly spread.
constexpr double span_pixels = 0.5;    // Over which light moves within a span.
constexpr double smooth_pixels = 0.5;  // Three of five wavelengths give a parabola. If light of the others is no
                                       // farther from it, light between the wavelengths is interpolated.
constexpr double swept_pixels = 2;     // A pixel whose light is spread over so many of the image needs only one sample.
constexpr double bent_pixels = 0.125;  // One sample is enough only if the next pixels see what its slope predicts, to
                                       // within this.
constexpr double wide_pixels = 2;      // A sample that sees so many pixels of the image may be at a fold.
constexpr double fold_ratio = 0.95;    // A torn span ends at a fold if the determinant of the slope there is less than
                                       // this part of that beyond it.
constexpr double joined_pixels = 32;   // For each band of a span. Points that its ends see farther apart are on
                                       // different sheets.

/// The footprint of a sample whose point moves along `sweep`: each is a box whose variance adds to that of the other.
Matrix2d swept(const Matrix2d& footprint, const Vector2d& sweep) {
  const Matrix2d square = footprint * footprint.transpose() + sweep * sweep.transpose();
  // Its Cholesky factor.
  const double x = std::sqrt(square(0, 0)), shear = x > 0 ? square(1, 0) / x : 0;
  return (Matrix2d() << x, 0, shear, std::sqrt(std::max(0.0, square(1, 1) - shear * shear))).finished();
}

/// The weight of each of the places `at` in the polynomial through them, at x (Lagrange).
std::vector<double> polynomial_weights(const std::vector<double>& at, double x) {
  std::vector<double> weights(at.size(), 1);
  for (std::size_t i = 0; i < at.size(); ++i)
    for (std::size_t j = 0; j < at.size(); ++j)
      if (j != i) weights[i] *= (x - at[j]) / (at[i] - at[j]);
  return weights;
}

/// The wavelengths of spans of which each begins where the one before it ends; empty if one does not.
std::vector<std::size_t> chain(const std::vector<Span>& spans) {
  std::vector<std::size_t> wavelengths{spans.front().from};
  for (const Span& span : spans) {
    if (span.from != wavelengths.back() || span.to == span.from) return {};
    wavelengths.push_back(span.to);
  }
  return wavelengths;
}

/// What one sample sees of the image.
class SampleView {
 public:
  /// @param n      Samples per pixel along x and along y.
  /// @param width  Samples in a row of the tile.
  SampleView(const LensView& view, const TileView& points, std::size_t sample, int n, int width)
      : view_(view), points_(points), sample_(sample), n_(n), width_(static_cast<std::size_t>(width)) {}

  /// Adds the light of all bands. Spans whose light sees nearly the same points share a look at the image.
  void shade(const std::vector<Span>& spans, PixelLight& pixel) const {
    for (std::size_t i = 0; i < spans.size();) {
      const Span& span = spans[i++];
      if (!lands(span.from)) {
        if (lands(span.to)) look(Glimpse(*this, span.to), st(span.to), 0.5, &span, &span + 1, pixel);
        continue;
      }
      const Glimpse from(*this, span.from);
      if (!lands(span.to)) {
        look(from, from.st, 0.5, &span, &span + 1, pixel);
        continue;
      }
      const Glimpse to(*this, span.to);
      if (!is_joined(span, distance(from, to) / n_)) {
        shade_torn(span, i > 1 ? &spans[i - 2] : nullptr, i < spans.size() ? &spans[i] : nullptr, pixel);
        continue;
      }
      // At a fold, what a sample sees grows without limit: the other end tells how near points are.
      Glimpse finer = std::abs(from.to_samples.determinant()) < std::abs(to.to_samples.determinant()) ? to : from;
      finer.st = from.st;
      const std::size_t first = i - 1;
      while (i < spans.size() && lands(spans[i].to) && finer.distance(st(spans[i].to)) <= same_look * n_) ++i;
      look(finer, st(spans[i - 1].to), 1, &spans[first], &spans[i - 1] + 1, pixel);
    }
  }

  /// Pixels along the line of the image that the light of all bands comes from; infinite if it is not one line.
  double sweep(const std::vector<Span>& spans) const {
    double length = 0;
    for (const Span& span : spans) {
      if (!lands(span.from) || !lands(span.to)) return std::numeric_limits<double>::infinity();
      const double way = distance(Glimpse(*this, span.from), Glimpse(*this, span.to)) / n_;
      if (!is_joined(span, way)) return std::numeric_limits<double>::infinity();
      length += way;
    }
    return length;
  }

  /// Whether the light of a span sees two sheets of the image, or the image and nothing.
  bool is_torn(const Span& span) const {
    if (!lands(span.from) || !lands(span.to)) return lands(span.from) != lands(span.to);
    return !is_joined(span, distance(Glimpse(*this, span.from), Glimpse(*this, span.to)) / n_);
  }

  /// Whether what the next samples see is farther than `distance` (pixels) from what the slope predicts, or is nothing.
  bool is_bent(std::size_t wavelength, double distance) const {
    const Glimpse here(*this, wavelength);
    const Matrix2d by_sample = by_slope(wavelength);
    const auto differs = [&](bool exists, std::size_t neighbor, const Vector2d& change) {
      if (!exists) return false;
      if (points_[wavelength][neighbor].end != RayEnd::plate) return true;
      const Vector2d seen = texture_coordinates(view_.light, image_point(view_, points_[wavelength][neighbor]));
      return !(here.distance(seen - change) <= distance * n_);
    };
    return differs(sample_ % width_ > 0, sample_ - 1, -by_sample.col(0)) ||
           differs((sample_ + 1) % width_ > 0, sample_ + 1, by_sample.col(0)) ||
           differs(sample_ >= width_, sample_ - width_, -by_sample.col(1)) ||
           differs(sample_ + width_ < points_[wavelength].size(), sample_ + width_, by_sample.col(1));
  }

  /// The bands, those with torn light in parts.
  std::vector<Span> divided_bands() const {
    std::vector<Span> spans;
    for (std::size_t band = 0; band < view_.spans.size(); ++band) {
      const std::vector<Span>& parts = view_.parts[band];
      if (!parts.empty() && is_torn(view_.spans[band]))
        spans.insert(spans.end(), parts.begin(), parts.end());
      else
        spans.push_back(view_.spans[band]);
    }
    return spans;
  }

  /// Whether the points seen at `wavelengths` are within `distance` (pixels) of the parabola through every second one.
  bool is_smooth(const std::vector<std::size_t>& wavelengths, double distance) const {
    std::vector<double> places;
    for (std::size_t i = 0; i < wavelengths.size(); i += 2) places.push_back(view_.wavelengths[wavelengths[i]].place);
    for (std::size_t i = 1; i < wavelengths.size(); i += 2) {
      const std::vector<double> weights = polynomial_weights(places, view_.wavelengths[wavelengths[i]].place);
      Vector2d predicted(0, 0);
      for (std::size_t k = 0; k < weights.size(); ++k) predicted += weights[k] * st(wavelengths[2 * k]);
      if (!(Glimpse(*this, wavelengths[i]).distance(predicted) <= distance * n_)) return false;
    }
    return true;
  }

 private:
  const FlowPoint& point(std::size_t wavelength) const { return points_[wavelength][sample_]; }

  /// The change of (s, t) per sample along x and y, as the map's slope says.
  Matrix2d by_slope(std::size_t wavelength) const {
    return view_.light.setup.image.plane.size.cwiseInverse().asDiagonal() * image_by_pixel(view_, point(wavelength)) /
           n_;
  }

  /// The same, but for a fold, where the slope has no limit: no more than what is between a sample and the next ones.
  Matrix2d footprint(std::size_t wavelength) const {
    Matrix2d by_sample = by_slope(wavelength);
    const auto limit = [&](int axis, bool exists, std::size_t neighbor) {
      if (!exists || points_[wavelength][neighbor].end != RayEnd::plate) return;
      const Vector2d change =
          texture_coordinates(view_.light, image_point(view_, points_[wavelength][neighbor])) - st(wavelength);
      if (change.squaredNorm() < by_sample.col(axis).squaredNorm()) by_sample.col(axis) = change;
    };
    const double wide = wide_pixels * view_.straight_pixel / n_;
    if (by_sample.col(0).norm() > wide) {
      limit(0, sample_ % width_ > 0, sample_ - 1);
      limit(0, (sample_ + 1) % width_ > 0, sample_ + 1);
    }
    if (by_sample.col(1).norm() > wide) {
      limit(1, sample_ >= width_, sample_ - width_);
      limit(1, sample_ + width_ < points_[wavelength].size(), sample_ + width_);
    }
    return by_sample;
  }

  bool lands(std::size_t wavelength) const { return point(wavelength).end == RayEnd::plate; }

  /// Whether the points that both ends of a span see, so many pixels apart, are on one sheet.
  static bool is_joined(const Span& span, double distance) { return distance <= joined_pixels * span.width(); }

  Vector2d st(std::size_t wavelength) const {
    return texture_coordinates(view_.light, image_point(view_, point(wavelength)));
  }

  /// A point of the image, and what a sample sees about it.
  struct Glimpse {
    std::size_t wavelength;
    Vector2d st;
    Matrix2d to_samples;  // The change of the sample per (s, t), as the map's slope says.

    Glimpse(const SampleView& sample, std::size_t at)
        : wavelength(at), st(sample.st(at)), to_samples(sample.by_slope(at).inverse()) {}

    /// In samples.
    double distance(const Vector2d& other) const { return (to_samples * (other - st)).norm(); }
  };

  /// In samples, as the end sees it where it is greater.
  static double distance(const Glimpse& a, const Glimpse& b) { return std::max(a.distance(b.st), b.distance(a.st)); }

  /// The part of a torn span that sees the sheet of one of its ends, and where on this sheet it begins.
  struct Part {
    double share;
    Vector2d beginning;
  };

  /// This part if the sheet begins at a fold. Light sees points whose distance from the fold's grows as the root of the
  /// light's own distance, and so does the determinant of the map's slope.
  /// @param next  The span beside `span`, from `end` to `beyond`, on the same sheet.
  std::optional<Part> part_at_fold(const Span& span, const Span& next, std::size_t end, std::size_t beyond) const {
    if (!lands(beyond)) return std::nullopt;
    const Glimpse at(*this, end), after(*this, beyond);
    const double ratio = std::abs(at.to_samples.determinant() / after.to_samples.determinant());
    if (!(ratio < fold_ratio) || !is_joined(next, distance(at, after) / n_)) return std::nullopt;
    const double part = ratio * ratio / (1 - ratio * ratio), widths = span.width() / next.width();
    const double way = std::min(part, widths);  // From the end to the fold, in widths of `next`.
    return Part{way / widths, at.st - std::sqrt(way) / (std::sqrt(way + 1) - std::sqrt(way)) * (after.st - at.st)};
  }

  /// Adds the light of a span whose ends see two sheets. @param before,after  The spans beside it, or null.
  void shade_torn(const Span& span, const Span* before, const Span* after, PixelLight& pixel) const {
    const Glimpse from(*this, span.from), to(*this, span.to);
    const auto at_from =
        before && before->to == span.from ? part_at_fold(span, *before, span.from, before->from) : std::nullopt;
    const auto at_to = after && after->from == span.to ? part_at_fold(span, *after, span.to, after->to) : std::nullopt;
    double share = 0.5;  // Of the first sheet.
    if (at_from || at_to)
      share = at_from && at_to ? (1 + at_from->share - at_to->share) / 2 : at_from ? at_from->share : 1 - at_to->share;
    look(from, at_from ? at_from->beginning : from.st, share, &span, &span + 1, pixel);
    look(to, at_to ? at_to->beginning : to.st, 1 - share, &span, &span + 1, pixel);
  }

  /// Adds a share of the light of spans that follow each other, which see the line from a point to `end`.
  void look(const Glimpse& from, const Vector2d& end, double share, const Span* first, const Span* last,
            PixelLight& pixel) const {
    if (share == 0) return;
    const Vector2d middle = (from.st + end) / 2;
    if (!sees_image(view_.light, middle)) return;
    const bool is_long = from.distance(end) > same_look * n_;
    const Matrix2d box = footprint(from.wavelength);
    const Eigen::Vector4d texel =
        view_.light.setup.image.texture->lookup(middle, is_long ? swept(box, end - from.st) : box).cast<double>();
    const bool glows = !(texel.w() > 0);  // Light of a flame, say, that covers nothing.
    if (glows && texel.head<3>().isZero(0)) return;
    const double covered = glows ? 0 : texel.w(), amount = glows ? 1 : texel.w();
    thread_local std::vector<double> radiances;
    const std::size_t first_band = first->first, last_band = (last - 1)->last;
    radiances.resize(last_band - first_band);
    view_.radiance(texel.head<3>() / amount, first_band, last_band, radiances.data());
    for (const Span* span = first; span != last; ++span) {
      const double part = span->part * share * amount / (n_ * n_);
      for (std::size_t i = span->first; i < span->last; ++i) {
        const LensBand& band = view_.bands[i];
        pixel.color += part * radiances[i - first_band] * band.color;
        pixel.channels[band.channel] += part * radiances[i - first_band] * band.weight;
        pixel.alpha[i] += span->part * share * covered / (n_ * n_);
      }
    }
  }

  const LensView& view_;
  const TileView& points_;
  const std::size_t sample_;
  const double n_;
  const std::size_t width_;
};

}  // namespace

TileShader::TileShader(const LensView& view, int tile, TraceCounts& counts)
    : view_(view),
      tile_(tile),
      columns_(view.flow.pixels(tile).sizes().x() + 1),
      counts_(counts),
      few_(joined(view.spans, few_spans)),
      spans_(few_),
      whole_(view_tile(view, tile, 1, few_, {}, counts)) {
  find_sweeps();
  double greatest = 0;
  for (const double sweep : sweeps_)
    if (std::isfinite(sweep)) greatest = std::max(greatest, sweep);
  if (greatest <= same_look) few_ = spans_ = joined(view.spans, 1);
  const double wanted = std::min(std::ceil(greatest / span_pixels), static_cast<double>(view.spans.size()));
  if (wanted > static_cast<double>(few_.size())) {
    spans_ = joined(view.spans, static_cast<std::size_t>(wanted));
    if (moves_smoothly()) {
      interpolate();
    } else {
      whole_ = view_tile(view, tile, 1, spans_, {}, counts);
      find_sweeps();
    }
  }
  if (view.light.settings.samples == 1) return;
  for (std::size_t i = 0; i < sweeps_.size(); ++i)
    if (std::isfinite(sweeps_[i]) && sweeps_[i] >= swept_pixels && is_bent(i))
      sweeps_[i] = std::numeric_limits<double>::infinity();
}

void TileShader::find_sweeps() {
  sweeps_.resize(whole_[spans_.front().from].size());
  for (std::size_t i = 0; i < sweeps_.size(); ++i) sweeps_[i] = SampleView(view_, whole_, i, 1, columns_).sweep(spans_);
}

/// Whether the map bends within a pixel, or ends near it.
bool TileShader::is_bent(std::size_t pixel) const {
  const SampleView seen(view_, whole_, pixel, 1, columns_);
  for (const std::size_t wavelength : {spans_.front().from, spans_[spans_.size() / 2].from, spans_.back().to})
    if (seen.is_bent(wavelength, bent_pixels)) return true;
  return false;
}

bool TileShader::moves_smoothly() const {
  const std::vector<std::size_t> wavelengths = chain(few_);
  if (wavelengths.size() != few_spans + 1) return false;
  for (std::size_t i = 0; i < sweeps_.size(); ++i)
    if (std::isfinite(sweeps_[i]) && !SampleView(view_, whole_, i, 1, columns_).is_smooth(wavelengths, smooth_pixels))
      return false;
  return true;
}

/// Sets what pixels see at the wavelengths of `spans_` that are not drawn. It is valid where the sweep is finite.
void TileShader::interpolate() {
  const std::vector<std::size_t> known = chain(few_);
  std::vector<double> places;
  for (const std::size_t wavelength : known) places.push_back(view_.wavelengths[wavelength].place);
  for (const std::size_t wavelength : chain(spans_)) {
    if (!whole_[wavelength].empty()) continue;
    const std::vector<double> weights = polynomial_weights(places, view_.wavelengths[wavelength].place);
    whole_[wavelength] = whole_[known.front()];
    for (std::size_t i = 0; i < sweeps_.size(); ++i) {
      FlowPoint& point = whole_[wavelength][i];
      point.other.setZero();
      point.jacobian.setZero();
      for (std::size_t k = 0; k < known.size(); ++k) {
        point.other += static_cast<float>(weights[k]) * whole_[known[k]][i].other;
        point.jacobian += static_cast<float>(weights[k]) * whole_[known[k]][i].jacobian;
      }
    }
  }
}

/// All samples of the pixels whose light is still, or of those whose light is torn.
TileView TileShader::view_samples(const std::vector<Span>& spans, bool still) {
  std::vector<char> wanted(sweeps_.size());
  for (std::size_t i = 0; i < wanted.size(); ++i)
    wanted[i] = still ? sweeps_[i] < swept_pixels : !std::isfinite(sweeps_[i]);
  return view_tile(view_, tile_, view_.light.settings.samples, spans, wanted, counts_);
}

/// Adds, to all samples of the pixels whose light is torn, those at wavelengths within the torn bands.
void TileShader::view_torn_bands() {
  const int n = view_.light.settings.samples, width = columns_ * n;
  for (std::size_t band = 0; band < view_.spans.size(); ++band) {
    if (view_.parts[band].empty()) continue;
    std::vector<char> torn(sweeps_.size());
    for (std::size_t i = 0; i < samples_[view_.spans[band].from].size(); ++i)
      if (SampleView(view_, samples_, i, n, width).is_torn(view_.spans[band])) {
        const int sample = static_cast<int>(i);
        torn[static_cast<std::size_t>(sample / width / n * columns_ + sample % width / n)] = 1;
      }
    if (std::find(torn.begin(), torn.end(), 1) == torn.end()) continue;
    TileView within = view_tile(view_, tile_, n, view_.parts[band], torn, counts_);
    for (std::size_t i = view_.spans[band].from + 1; i < view_.spans[band].to; ++i) samples_[i] = std::move(within[i]);
  }
}

void TileShader::shade(int x, int y, PixelLight& light) {
  const int n = view_.light.settings.samples;
  const auto pixel = static_cast<std::size_t>(y * columns_ + x);
  const bool is_still = sweeps_[pixel] < swept_pixels;
  if (std::isfinite(sweeps_[pixel]) && (n == 1 || !is_still))
    return SampleView(view_, whole_, pixel, 1, columns_).shade(spans_, light);
  TileView& points = is_still ? few_samples_ : samples_;
  if (points.empty()) {
    points = view_samples(is_still ? few_ : view_.spans, is_still);
    if (!is_still) view_torn_bands();
  }
  for (int i = 0; i < n * n; ++i) {
    const int sample = (y * n + i / n) * columns_ * n + x * n + i % n;
    const SampleView seen(view_, points, static_cast<std::size_t>(sample), n, columns_ * n);
    seen.shade(is_still ? few_ : seen.divided_bands(), light);
  }
}

}  // namespace tensorray
