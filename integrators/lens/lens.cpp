#include "integrators/lens/lens.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <tbb/parallel_for.h>

#include "integrators/flow/flow_view.h"
#include "renderer/surfaces/planar_mesh.h"

namespace tensorray {
namespace {

using Eigen::Affine2d;
using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double tolerance = 0.5;              // Wanted error of landings, pixels.
constexpr double finest_of_scatter = 0.25;     // Size of the smallest squares, pixels: gaps at tears are as wide.
constexpr double finest_of_gather = 1;         // There, samples in torn squares are traced on their own.
constexpr std::size_t most_starts = 1u << 14;  // The map has at most so many positions,
constexpr std::size_t starts_per_pixel = 2;    // plus so many for each pixel. A chaotic field could need any number.
constexpr double same_look = 0.25;    // Pixels: bands whose light sees points this near share a look at the image.
constexpr std::size_t few_spans = 4;  // Of light that is spread over less than this:
constexpr double swept_pixels = 2;  // Of the image, over which a pixel's light is spread, so that one sample is enough.
constexpr double joined_pixels = 32;  // Farther apart, the points that both ends of a band see are on different sheets.
constexpr double same_place = 1e-3;   // Pixels: sheets whose starts are nearer than this count as one.

bool gathers(const LensLight& light) { return light.settings.mode == LensMode::gather; }

/// From coordinates in a plate's plane to its pixels.
Affine2d to_pixels(const Plate& plate) {
  const Vector2d per_unit = plate.pixel_size().cwiseInverse();
  Affine2d map;
  map.linear() = Vector2d(per_unit.x(), -per_unit.y()).asDiagonal();
  map.translation() = plate.resolution.cast<double>() / 2;
  return map;
}

/// Maps pixels of the receiver along the light to coordinates in the image's plane.
Affine2d straight_map(const Plate& receiver, const Plate& image, const Eigen::Vector3d& direction) {
  const auto seen = [&](const Vector2d& pixel) {
    const Eigen::Vector3d point = receiver.to_world(pixel), normal = image.normal();
    return plane_coordinates(image, point + normal.dot(image.center - point) / normal.dot(direction) * direction);
  };
  Affine2d map;
  map.translation() = seen({0, 0});
  map.linear() << seen({1, 0}) - map.translation(), seen({0, 1}) - map.translation();
  return map;
}

/// The part of the image whose light may reach the receiver: the part in front of the volume, and the part that
/// straight light shows.
Eigen::AlignedBox2d useful_starts(const LensLight& light, const TriangleMesh& volume) {
  const Plate& plane = light.image.plane;
  Eigen::AlignedBox2d useful;
  for (const Eigen::Vector3d& vertex : volume.vertices) {
    const double ahead = plane.normal().dot(vertex - plane.center) / plane.normal().dot(light.direction);
    useful.extend(plane_coordinates(plane, vertex - ahead * light.direction));
  }
  const Vector2d size = light.receiver.resolution.cast<double>();
  for (const Vector2d& corner : {Vector2d(0, 0), Vector2d(size.x(), 0), Vector2d(0, size.y()), size})
    useful.extend(light.straight * corner);
  const Eigen::AlignedBox2d image(-plane.size / 2, plane.size / 2);
  const Eigen::AlignedBox2d part = useful.intersection(image);
  return part.isEmpty() ? image : part;
}

/// The plate of the map. In `gather` its pixels are those of the receiver, as straight light projects them.
Plate plate_of_landings(const LensLight& light) {
  if (!gathers(light)) return light.receiver;
  Plate plate = light.image.plane;
  const double pixel = std::sqrt(std::abs(light.straight.linear().determinant()));
  plate.resolution = (plate.size / pixel).array().ceil().max(1).min(1e6).cast<int>();
  plate.size = pixel * plate.resolution.cast<double>();
  return plate;
}

/// Parallel light that starts on a rectangle of a plane.
Beam beam_from(const Plate& plane, const Eigen::AlignedBox2d& starts, const Eigen::Vector3d& direction) {
  Beam beam;
  beam.direction = direction;
  beam.center = plane.center;
  beam.right = plane.right;
  beam.up = plane.up;
  using Box = Eigen::AlignedBox2d;
  for (const Box::CornerType corner : {Box::BottomLeft, Box::BottomRight, Box::TopRight, Box::TopLeft})
    beam.aperture.push_back(starts.corner(corner));
  return beam;
}

FlowSettings flow_settings(const LensLight& light) {
  FlowSettings settings;
  settings.flexibilities = light.settings.flexibilities;
  // Light that is traced back from its end obeys the rule with the opposite sign of s.
  if (gathers(light))
    for (double& flexibility : settings.flexibilities) flexibility = -flexibility;
  settings.range = light.settings.range;
  settings.tolerance = tolerance;
  settings.finest = gathers(light) ? finest_of_gather : finest_of_scatter;
  settings.silhouette = false;
  settings.beside = gathers(light) && light.image.wraps;
  settings.most_starts = most_starts + starts_per_pixel * static_cast<std::size_t>(light.receiver.resolution.prod());
  return settings;
}

/// Bands that follow each other, from `first` to `last`, without it. Their light sees what the nodes `from` and `to`
/// (indices) see, and what is between.
struct Span {
  std::size_t first, last, from, to;
};

/// What the threads share when the picture is drawn.
struct Drawing {
  const LensLight& light;
  const std::vector<LensBand>& bands;
  const LensRadiance& radiance;
  Affine2d starts;            // From the coordinates of the map's starts to pixels of the receiver, in `gather`.
  Affine2d landings;          // From coordinates to the map's landings.
  std::vector<Span> spans{};  // Each band.
  std::vector<Span> few{};    // Some bands together, for light that moves little from band to band.
  std::vector<double>
      nodes{};  // Places among the map's nodes that are drawn: the ends of bands; the last: the reference.
  FlowView view;
};

/// The view of a map whose `other` ends are pixels of the landings (gather) or coordinates of starts (scatter).
FlowPicture flow_picture(const LensLight& light) {
  FlowPicture picture;
  picture.resolution = light.receiver.resolution;
  picture.straight = light.straight;
  if (!gathers(light)) return picture;
  picture.side = FlowSide::starts;
  picture.to_pixel = to_pixels(light.receiver);
  picture.straight = to_pixels(light.landings) * light.straight;
  return picture;
}

/// A place between the first and the last flexibility, as one among the nodes of the map.
double node_at(const LensLight& light, double place) { return place * static_cast<double>(light.map.nodes - 1); }

/// Some spans, together all. In a range they end where others begin; other lights have nothing in common.
std::vector<Span> joined(const std::vector<Span>& spans) {
  std::vector<Span> few;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const bool is_new = few.size() * spans.size() <= i * few_spans || few.empty();
    if (is_new || spans[i].from != few.back().to || spans[i].from == spans[i].to) {
      few.push_back(spans[i]);
    } else {
      few.back().last = spans[i].last;
      few.back().to = spans[i].to;
    }
  }
  return few;
}

Drawing make_drawing(const LensLight& light, const std::vector<LensBand>& bands, const LensRadiance& radiance) {
  std::vector<double> nodes;
  std::vector<Span> spans;
  const auto index_of = [&](double place) {
    const double node = node_at(light, place);
    if (nodes.empty() || nodes.back() != node) nodes.push_back(node);
    return nodes.size() - 1;
  };
  for (std::size_t band = 0; band < bands.size(); ++band) {
    const std::size_t from = index_of(bands[band].begin);
    spans.push_back({band, band + 1, from, index_of(bands[band].end)});
  }
  nodes.push_back(node_at(light, light.settings.reference));
  FlowView view(light.map, flow_picture(light), nodes, light.settings.samples);
  std::vector<Span> few = joined(spans);
  return {light,
          bands,
          radiance,
          to_pixels(light.receiver),
          to_pixels(light.landings),
          std::move(spans),
          std::move(few),
          std::move(nodes),
          std::move(view)};
}

double flexibility_at(const LensLight& light, double node) {
  const std::vector<double>& s = light.settings.flexibilities;
  if (!light.settings.range) return s[static_cast<std::size_t>(node)];
  const double part = light.map.nodes > 1 ? node / static_cast<double>(light.map.nodes - 1) : 0;
  return (1 - part) * s[0] + part * s[1];
}

/// What the samples of a tile see, by node and sample; empty for nodes that are not drawn.
using TileView = std::vector<std::vector<FlowPoint>>;

/// Traces light that the map does not know, back from samples of a tile.
void trace_unknown(const Drawing& drawing, const Eigen::AlignedBox2i& pixels, int n, TileView& points,
                   TraceCounts& counts) {
  std::vector<std::vector<FlowPoint>*> drawn;
  std::vector<double> flexibilities;
  for (std::size_t node = 0; node < points.size(); ++node) {
    if (points[node].empty()) continue;
    drawn.push_back(&points[node]);
    flexibilities.push_back(-flexibility_at(drawing.light, drawing.nodes[node]));
  }
  std::vector<std::size_t> unknown;
  std::vector<Vector2d> starts;
  const int width = n * (pixels.sizes().x() + 1);
  for (std::size_t i = 0; i < drawn.front()->size(); ++i) {
    if (std::none_of(drawn.begin(), drawn.end(), [&](const auto* each) { return (*each)[i].is_unknown; })) continue;
    const auto sample = static_cast<int>(i);
    unknown.push_back(i);
    starts.push_back(drawing.starts.inverse() *
                     (pixels.min().cast<double>() + Vector2d(sample % width + 0.5, sample / width + 0.5) / n));
  }
  if (unknown.empty()) return;
  std::vector<LensLanding> landings(starts.size() * drawn.size());
  counts += drawing.light.planes.trace(starts, flexibilities, landings.data());
  for (std::size_t i = 0; i < landings.size(); ++i) {
    const LensLanding& landing = landings[i];
    FlowPoint& point = (*drawn[i % drawn.size()])[unknown[i / drawn.size()]];
    point = FlowPoint();
    point.end = landing.end;
    point.sheets = 1;
    point.other = (drawing.landings * landing.at).cast<float>();
    point.jacobian = (drawing.landings.linear() * landing.jacobian).cast<float>();
    point.length = static_cast<float>(landing.length);
  }
}

/// Coordinates, in the image's plane, of what a point sees; its light landed.
Vector2d image_point(const Drawing& drawing, const FlowPoint& point) {
  const Vector2d other = point.other.cast<double>();
  return gathers(drawing.light) ? Vector2d(drawing.landings.inverse() * other) : other;
}

/// The change of these coordinates per pixel, along x and y.
Matrix2d image_by_pixel(const Drawing& drawing, const FlowPoint& point) {
  const Matrix2d jacobian = point.jacobian.cast<double>();
  if (!gathers(drawing.light)) return jacobian.inverse();
  return drawing.landings.linear().inverse() * jacobian * drawing.starts.linear().inverse();
}

Vector2d texture_coordinates(const LensLight& light, const Vector2d& at) {
  return (at.array() / light.image.plane.size.array() + 0.5).matrix();
}

bool sees_image(const LensLight& light, const Vector2d& st) {
  const double rounding = 1e-6;  // Landings are single precision.
  return light.image.wraps || ((st.array() >= -rounding).all() && (st.array() <= 1 + rounding).all());
}

/// The footprint of a sample whose point moves along `sweep`: each is a box whose variance adds to that of the other.
Matrix2d swept(const Matrix2d& footprint, const Vector2d& sweep) {
  const Matrix2d square = footprint * footprint.transpose() + sweep * sweep.transpose();
  return square.llt().matrixL();
}

/// Light of a pixel while its samples are added.
struct PixelLight {
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  std::vector<double> channels, alpha;  // By channel, and by band.
};

/// What one sample sees of the image.
class SampleView {
 public:
  /// @param n  Samples per pixel along x and along y.
  SampleView(const Drawing& drawing, const TileView& points, std::size_t sample, int n)
      : drawing_(drawing), points_(points), sample_(sample), n_(n) {}

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
    for (const Span& span : drawing_.spans) {
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

  Vector2d st(std::size_t node) const {
    return texture_coordinates(drawing_.light, image_point(drawing_, point(node)));
  }

  /// A point of the image, and what a sample sees about it.
  struct Glimpse {
    Vector2d st;
    Matrix2d footprint;   // Change of (s, t) per sample along x and y.
    Matrix2d to_samples;  // Its inverse.

    Glimpse(const SampleView& sample, std::size_t node)
        : st(sample.st(node)),
          footprint(sample.drawing_.light.image.plane.size.cwiseInverse().asDiagonal() *
                    image_by_pixel(sample.drawing_, sample.point(node)) / sample.n_),
          to_samples(footprint.inverse()) {}

    /// In samples.
    double distance(const Vector2d& other) const { return (to_samples * (other - st)).norm(); }
  };

  /// Adds the light of the bands from `first` to `last`, which see the line to the point of node `to`.
  void look(const Glimpse& from, std::size_t to, double share, std::size_t first, std::size_t last,
            PixelLight& pixel) const {
    const Vector2d end = st(to), middle = (from.st + end) / 2;
    if (!sees_image(drawing_.light, middle)) return;
    const bool is_long = from.distance(end) > same_look * n_;
    const Eigen::Vector4d texel =
        drawing_.light.image.texture->lookup(middle, is_long ? swept(from.footprint, end - from.st) : from.footprint)
            .cast<double>();
    if (!(texel.w() > 0)) return;
    thread_local std::vector<double> radiances;
    radiances.resize(last - first);
    drawing_.radiance(texel.head<3>() / texel.w(), first, last, radiances.data());
    const double part = share * texel.w() / (n_ * n_);
    for (std::size_t i = first; i < last; ++i) {
      const LensBand& band = drawing_.bands[i];
      pixel.color += part * radiances[i - first] * band.color;
      pixel.channels[band.channel] += part * radiances[i - first] * band.weight;
      pixel.alpha[i] += part;
    }
  }

  const Drawing& drawing_;
  const TileView& points_;
  const std::size_t sample_;
  const double n_;
};

/// ln σ₁ >= ln σ₂ of a matrix; −∞ where it is singular, 0 where it is not finite.
Vector2d log_singular_values(const Matrix2d& m) {
  if (!m.allFinite()) return Vector2d::Zero();
  const double greater =
      (std::hypot(m(0, 0) + m(1, 1), m(0, 1) - m(1, 0)) + std::hypot(m(0, 0) - m(1, 1), m(0, 1) + m(1, 0))) / 2;
  return {std::log(greater), std::log(std::abs(m.determinant())) - std::log(greater)};
}

/// The LensPoint of a position (in pixels) of the receiver.
LensPoint make_point(const Drawing& drawing, const Vector2d& pixel, const FlowPoint& seen) {
  const LensLight& light = drawing.light;
  LensPoint point;
  point.end = static_cast<LensEnd>(seen.end);
  if (seen.end != RayEnd::plate) return point;
  const Vector2d at = image_point(drawing, seen);
  const Matrix2d by_pixel = image_by_pixel(drawing, seen);
  point.st = texture_coordinates(light, at);
  point.end = sees_image(light, point.st) ? LensEnd::image : LensEnd::outside;
  point.per_pixel = light.image.plane.size.cwiseInverse().asDiagonal() * by_pixel;
  point.displacement = plane_point(light.image.plane, at) - plane_point(light.image.plane, light.straight * pixel);
  point.log_stretch = -log_singular_values(by_pixel * to_pixels(light.receiver).linear()).reverse();
  point.log_magnification = point.log_stretch.sum();
  point.length = seen.length;
  point.folds = seen.sheets;
  return point;
}

/// Counts the places of the picture that show what each pixel sees, in `gather`. The map from the picture to the image
/// may fold; each sheet is one place.
class PlaceCounter {
 public:
  explicit PlaceCounter(const LensLight& light) : light_(light), mesh_(mesh_of(light)), search_(mesh_) {}

  /// @param landing  Pixels of the map.
  int count(const Vector2d& landing) const {
    thread_local std::vector<PlanarHit> hits;
    thread_local std::vector<Vector2d> starts;
    search_.find(landing, hits);
    starts.clear();
    const double least = same_place * light_.receiver.pixel_size().minCoeff();
    for (const PlanarHit& hit : hits) {
      Vector2d start(0, 0);
      for (int i = 0; i < 3; ++i) start += hit.weights[i] * light_.map.starts[mesh_.triangles[hit.triangle][i]];
      if (std::none_of(starts.begin(), starts.end(), [&](const Vector2d& s) { return (s - start).norm() < least; }))
        starts.push_back(start);
    }
    return std::max(1, static_cast<int>(starts.size()));  // At least the pixel itself.
  }

 private:
  static PlanarMesh mesh_of(const LensLight& light) {
    PlanarMesh mesh;
    const FlowMap& map = light.map;
    std::vector<bool> landed;
    for (std::size_t i = 0; i < map.starts.size(); ++i) {
      const FlowLanding landing = landing_at(map, i, node_at(light, light.settings.reference));
      mesh.vertices.push_back(landing.at);
      landed.push_back(landing.end == RayEnd::plate);
    }
    for (const FlowTriangle& triangle : map.triangles) {
      const auto& [a, b, c] = triangle.corners;
      if (!triangle.is_torn && landed[a] && landed[b] && landed[c]) mesh.triangles.push_back(triangle.corners);
    }
    return mesh;
  }

  const LensLight& light_;
  const PlanarMesh mesh_;
  const PlanarMeshSearch search_;
};

/// @param n  Samples of a pixel along x and along y.
TileView view_tile(const Drawing& drawing, int tile, int n, const std::vector<Span>& spans, TraceCounts& counts) {
  TileView points(drawing.nodes.size());
  for (const Span& span : spans)
    for (const std::size_t node : {span.from, span.to})
      if (points[node].empty()) drawing.view.draw(tile, n, node, points[node]);
  if (gathers(drawing.light)) trace_unknown(drawing, drawing.view.pixels(tile), n, points, counts);
  return points;
}

/// Shades the pixels of a tile.
class TileShader {
 public:
  TileShader(const Drawing& drawing, int tile, TraceCounts& counts)
      : drawing_(drawing), tile_(tile), counts_(counts), whole_(view_tile(drawing, tile, 1, drawing.spans, counts)) {}

  /// @param x,y  In the tile. Where the light of a pixel is spread over several pixels of the image, one sample shows
  /// as much as many; where it is hardly spread, few nodes show as much as all.
  void shade(int x, int y, PixelLight& light) {
    const int columns = drawing_.view.pixels(tile_).sizes().x() + 1, n = drawing_.light.settings.samples;
    const SampleView pixel(drawing_, whole_, static_cast<std::size_t>(y * columns + x), 1);
    const double sweep = pixel.sweep();
    if (n == 1 || (sweep >= swept_pixels && std::isfinite(sweep))) return pixel.shade(drawing_.spans, light);
    const bool is_still = sweep < swept_pixels;
    const std::vector<Span>& spans = is_still ? drawing_.few : drawing_.spans;
    TileView& view = is_still ? few_ : all_;
    if (view.empty()) view = view_tile(drawing_, tile_, n, spans, counts_);
    for (int i = 0; i < n * n; ++i) {
      const int sample = (y * n + i / n) * columns * n + x * n + i % n;
      SampleView(drawing_, view, static_cast<std::size_t>(sample), n).shade(spans, light);
    }
  }

 private:
  const Drawing& drawing_;
  const int tile_;
  TraceCounts& counts_;
  const TileView whole_;  // A sample for each pixel.
  TileView few_, all_;    // All samples, at few nodes and at all.
};

void draw_tile(const Drawing& drawing, int tile, LensPicture& picture, TraceCounts& counts) {
  const Eigen::AlignedBox2i box = drawing.view.pixels(tile);
  const int columns = box.sizes().x() + 1, rows = box.sizes().y() + 1;
  const std::size_t reference = drawing.nodes.size() - 1;
  const TileView centers = view_tile(drawing, tile, 1, {{0, 0, reference, reference}}, counts);
  TileShader shader(drawing, tile, counts);
  PixelLight light;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      light.color.setZero();
      light.channels.assign(picture.ends.size(), 0);
      light.alpha.assign(drawing.bands.size(), 0);
      shader.shade(x, y, light);
      const Eigen::Vector2i at = box.min() + Eigen::Vector2i(x, y);
      const auto pixel = static_cast<std::size_t>(at.y()) * picture.color.width + at.x();
      for (int c = 0; c < 3; ++c) picture.color.plane(c)[pixel] = light.color[c];
      for (int c = 0; c < picture.radiance.channels; ++c)
        picture.radiance.plane(c)[pixel] = light.channels[static_cast<std::size_t>(c)];
      picture.alpha[pixel] = *std::max_element(light.alpha.begin(), light.alpha.end());
      picture.points[pixel] = make_point(drawing, at.cast<double>() + Vector2d(0.5, 0.5),
                                         centers[reference][static_cast<std::size_t>(y * columns + x)]);
    }
}

void count_places(const Drawing& drawing, LensPicture& picture) {
  const PlaceCounter counter(drawing.light);
  const Plate& plane = drawing.light.image.plane;
  tbb::parallel_for(std::size_t{0}, picture.points.size(), [&](std::size_t i) {
    LensPoint& point = picture.points[i];
    if (point.end != LensEnd::image && point.end != LensEnd::outside) return;
    const Vector2d at = ((point.st.array() - 0.5) * plane.size.array()).matrix();
    point.folds = counter.count(drawing.landings * at);
  });
}

/// The number of positions by end, at the middle of each channel.
std::vector<EndCounts> count_ends(const LensLight& light, const std::vector<LensBand>& bands, std::size_t channels) {
  std::vector<EndCounts> ends(channels, EndCounts{});
  for (std::size_t channel = 0; channel < channels; ++channel) {
    double first = 1, last = 0;
    for (const LensBand& band : bands) {
      if (band.channel != channel) continue;
      first = std::min(first, band.begin);
      last = std::max(last, band.end);
    }
    const double node = node_at(light, (first + last) / 2);
    for (std::size_t i = 0; i < light.map.starts.size(); ++i)
      ++ends[channel][static_cast<int>(landing_at(light.map, i, node).end)];
  }
  return ends;
}

void check(const LensImage& image, const LensSettings& settings) {
  if (settings.flexibilities.empty()) throw std::invalid_argument("a lens needs at least one wavelength");
  if (!image.texture) throw std::invalid_argument("a lens needs an image");
  if (settings.samples < 1) throw std::invalid_argument("integrator.samples must be positive");
  if (!(settings.reference >= 0 && settings.reference <= 1))
    throw std::invalid_argument("the reference is out of range: it must be a place between two flexibilities, 0 to 1");
}

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

}  // namespace

const char* to_string(LensEnd end) {
  constexpr const char* names[lens_end_count] = {"image", "missed", "obstacle", "step_limit", "degenerate", "outside"};
  return names[static_cast<int>(end)];
}

LensLight trace_lens(const TensorField& field, const Surfaces& surfaces, const BendingSettings& bending,
                     const Eigen::Vector3d& direction, const Plate& receiver, const LensImage& image,
                     const LensSettings& settings, const Progress& progress) {
  check(image, settings);
  const auto start = Clock::now();
  const bool back = settings.mode == LensMode::gather;
  const Plate &from = back ? receiver : image.plane, &to = back ? image.plane : receiver;
  const Eigen::Vector3d along = back ? Eigen::Vector3d(-direction) : direction;
  LensLight light{settings,
                  direction,
                  receiver,
                  image,
                  straight_map(receiver, image.plane, direction),
                  LensMap(field, surfaces, bending, from, to, along),
                  {},
                  {}};
  light.landings = plate_of_landings(light);
  const Eigen::AlignedBox2d starts =
      back ? Eigen::AlignedBox2d(-receiver.size / 2, receiver.size / 2) : useful_starts(light, surfaces.bounds);
  light.map = trace_flow_map(field, light.planes.geometry(), light.landings, beam_from(from, starts, along), bending,
                             flow_settings(light), progress);
  light.seconds_tracing = seconds_since(start);
  return light;
}

LensPicture draw_lens(const LensLight& light, const std::vector<LensBand>& bands, const LensRadiance& radiance,
                      std::size_t channels, bool by_channel, const Progress& progress) {
  const auto start = Clock::now();
  const Eigen::Vector2i size = light.receiver.resolution;
  LensPicture picture;
  picture.color = Film(size.x(), size.y(), 3);
  if (by_channel) picture.radiance = Film(size.x(), size.y(), static_cast<int>(channels));
  picture.alpha.resize(picture.color.plane_size());
  picture.points.resize(picture.color.plane_size());
  picture.ends = count_ends(light, bands, channels);
  for (int i = 0; i < 2; ++i)
    picture.straight.linear().row(i) = light.straight.linear().row(i) / light.image.plane.size[i];
  picture.straight.translation() = texture_coordinates(light, light.straight.translation());

  const Drawing drawing = make_drawing(light, bands, radiance);
  std::vector<TraceCounts> counts(static_cast<std::size_t>(drawing.view.tiles()));
  std::atomic<std::uint64_t> done{0};
  const std::thread::id caller = std::this_thread::get_id();
  progress.update("drawing the picture", 0, counts.size());
  tbb::parallel_for(0, drawing.view.tiles(), [&](int tile) {
    if (progress.cancelled) throw Cancelled();
    draw_tile(drawing, tile, picture, counts[static_cast<std::size_t>(tile)]);
    const std::uint64_t drawn = ++done;
    if (std::this_thread::get_id() == caller) progress.update("drawing the picture", drawn, counts.size());
  });
  if (gathers(light)) count_places(drawing, picture);
  picture.counts = {light.map.ray_steps, light.map.tensor_samples};
  for (const TraceCounts& each : counts) picture.counts += each;
  picture.seconds_drawing = seconds_since(start);
  return picture;
}

}  // namespace tensorray
