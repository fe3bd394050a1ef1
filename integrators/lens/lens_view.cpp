#include "integrators/lens/lens_view.h"

#include <algorithm>
#include <utility>

#include <Eigen/LU>

namespace tensorray {
namespace {

using Eigen::Affine2d;
using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int band_parts = 8;  // In which light that is torn within a band is looked at.

/// The view of a map whose `other` ends are pixels of the landings (gather) or coordinates of starts (scatter).
FlowPicture flow_picture(const LensLight& light) {
  FlowPicture picture;
  picture.resolution = light.setup.receiver.resolution;
  picture.straight = light.straight;
  if (!gathers(light)) return picture;
  picture.side = FlowSide::starts;
  picture.to_pixel = to_pixels(light.setup.receiver);
  picture.straight = to_pixels(light.landings) * light.straight;
  return picture;
}

double flexibility_at(const LensLight& light, double place) {
  const std::vector<double>& s = light.settings.flexibilities;
  if (!light.settings.range) return s[static_cast<std::size_t>(place)];
  const double part = light.map.wavelengths > 1 ? place / static_cast<double>(light.map.wavelengths - 1) : 0;
  return (1 - part) * s[0] + part * s[1];
}

/// Traces light that the map does not know, back from samples of a tile.
void trace_unknown(const LensView& view, const Eigen::AlignedBox2i& pixels, int n, TileView& points,
                   TraceCounts& counts) {
  std::vector<std::vector<FlowPoint>*> drawn;
  std::vector<double> flexibilities;
  for (std::size_t wavelength = 0; wavelength < points.size(); ++wavelength) {
    if (points[wavelength].empty()) continue;
    drawn.push_back(&points[wavelength]);
    flexibilities.push_back(-flexibility_at(view.light, view.wavelengths[wavelength].place));
  }
  std::vector<std::size_t> unknown;
  std::vector<Vector2d> starts;
  const int width = n * (pixels.sizes().x() + 1);
  for (std::size_t i = 0; i < drawn.front()->size(); ++i) {
    if (std::none_of(drawn.begin(), drawn.end(), [&](const auto* each) { return (*each)[i].is_unknown; })) continue;
    const auto sample = static_cast<int>(i);
    unknown.push_back(i);
    starts.push_back(view.starts.inverse() *
                     (pixels.min().cast<double>() + Vector2d(sample % width + 0.5, sample / width + 0.5) / n));
  }
  if (unknown.empty()) return;
  std::vector<LensLanding> landings(starts.size() * drawn.size());
  counts += view.light.planes.trace(starts, flexibilities, landings.data());
  for (std::size_t i = 0; i < landings.size(); ++i) {
    const LensLanding& landing = landings[i];
    FlowPoint& point = (*drawn[i % drawn.size()])[unknown[i / drawn.size()]];
    point = FlowPoint();
    point.end = landing.end;
    point.sheets = 1;
    point.other = (view.landings * landing.at).cast<float>();
    point.jacobian = (view.landings.linear() * landing.jacobian).cast<float>();
    point.length = static_cast<float>(landing.length);
  }
}

}  // namespace

bool gathers(const LensLight& light) { return light.settings.mode == LensMode::gather; }

Affine2d to_pixels(const Plate& plate) {
  const Vector2d per_unit = plate.pixel_size().cwiseInverse();
  Affine2d map;
  map.linear() = Vector2d(per_unit.x(), -per_unit.y()).asDiagonal();
  map.translation() = plate.resolution.cast<double>() / 2;
  return map;
}

double sample_place(const LensLight& light, double place) {
  return place * static_cast<double>(light.map.wavelengths - 1);
}

LensView make_lens_view(const LensLight& light, const std::vector<LensBand>& bands, const LensRadiance& radiance) {
  std::vector<LensWavelength> wavelengths;
  std::vector<FlowRange> ranges;
  std::vector<Span> spans;
  std::vector<std::vector<Span>> parts(bands.size());
  const auto index_of = [&](double place) {
    if (wavelengths.empty() || wavelengths.back().place != place) wavelengths.push_back({place, ranges.size() - 1});
    return wavelengths.size() - 1;
  };
  for (std::size_t band = 0; band < bands.size(); ++band) {
    const double begin = sample_place(light, bands[band].begin), end = sample_place(light, bands[band].end);
    ranges.push_back({begin, end});
    std::size_t from = index_of(begin);
    spans.push_back({band, band + 1, from, from});
    for (int i = 1; i <= band_parts && end != begin; ++i) {
      const double part = static_cast<double>(i) / band_parts;
      const std::size_t to = index_of(i == band_parts ? end : begin + part * (end - begin));
      parts[band].push_back({band, band + 1, from, to, 1.0 / band_parts});
      spans.back().to = from = to;
    }
  }
  const double reference = sample_place(light, light.settings.reference);
  ranges.push_back({reference, reference});
  wavelengths.push_back({reference, ranges.size() - 1});
  FlowView flow(light.map, flow_picture(light), std::move(ranges), light.settings.samples);
  const Eigen::Matrix2d st_by_pixel =
      light.setup.image.plane.size.cwiseInverse().asDiagonal() * light.straight.linear();
  return {light,
          bands,
          radiance,
          to_pixels(light.setup.receiver),
          to_pixels(light.landings),
          std::move(spans),
          wavelengths,
          std::move(parts),
          wavelengths.size() - 1,
          st_by_pixel.colwise().norm().maxCoeff(),
          std::move(flow)};
}

std::vector<Span> joined(const std::vector<Span>& spans, std::size_t count) {
  std::vector<Span> result;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const bool is_new = result.empty() || result.size() * spans.size() <= i * count;
    if (is_new || spans[i].from != result.back().to || spans[i].from == spans[i].to) {
      result.push_back(spans[i]);
    } else {
      result.back().last = spans[i].last;
      result.back().to = spans[i].to;
    }
  }
  return result;
}

TileView view_tile(const LensView& view, int tile, int n, const std::vector<Span>& spans,
                   const std::vector<char>& wanted, TraceCounts& counts) {
  TileView points(view.wavelengths.size());
  for (const Span& span : spans)
    for (const std::size_t wavelength : {span.from, span.to})
      if (const auto& [place, range] = view.wavelengths[wavelength]; points[wavelength].empty())
        view.flow.draw(tile, n, range, place, wanted, points[wavelength]);
  if (gathers(view.light)) trace_unknown(view, view.flow.pixels(tile), n, points, counts);
  return points;
}

Vector2d image_point(const LensView& view, const FlowPoint& point) {
  const Vector2d other = point.other.cast<double>();
  return gathers(view.light) ? Vector2d(view.landings.inverse() * other) : other;
}

Matrix2d image_by_pixel(const LensView& view, const FlowPoint& point) {
  const Matrix2d jacobian = point.jacobian.cast<double>();
  if (!gathers(view.light)) return jacobian.inverse();
  return view.landings.linear().inverse() * jacobian * view.starts.linear().inverse();
}

Vector2d texture_coordinates(const LensLight& light, const Vector2d& at) {
  return (at.array() / light.setup.image.plane.size.array() + 0.5).matrix();
}

bool sees_image(const LensLight& light, const Vector2d& st) {
  const double rounding = 1e-6;  // Landings are single precision.
  return light.setup.image.wraps || ((st.array() >= -rounding).all() && (st.array() <= 1 + rounding).all());
}

}  // namespace tensorray
