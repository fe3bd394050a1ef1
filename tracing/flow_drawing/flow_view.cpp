#include "tracing/flow_drawing/flow_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <Eigen/LU>
#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix2f;
using Eigen::Vector2d;
using Eigen::Vector2f;

constexpr float max_curvature = 0.25f;  // The quadratic part is at most so much of a triangle's size.

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// ∂landing/∂start of a triangle at a wavelength sample.
Matrix2d slope_of(const FlowMap& map, const FlowTriangle& triangle, std::size_t wavelength) {
  const auto& [a, b, c] = triangle.corners;
  const auto landing = [&](std::uint32_t i) -> Vector2d { return map.landing(i, wavelength).cast<double>(); };
  Matrix2d starts, landings;
  starts << map.starts[b] - map.starts[a], map.starts[c] - map.starts[a];
  landings << landing(b) - landing(a), landing(c) - landing(a);
  return landings * starts.inverse();
}

/// A corner of a triangle at a wavelength sample.
struct Corner {
  std::uint32_t vertex;
  RayEnd end;
  Vector2d start, landing;
  Vector2d sample;  // In the picture, in samples.
  Matrix2f jacobian = Matrix2f::Identity();
  float length = 0;
};

/// A side of a triangle, for points: positive on its left. Both triangles of a side compute the same number, but for
/// its sign, and one of them has the points on the side.
class Side {
 public:
  Side(const Corner& from, const Corner& to)
      : origin_(from.vertex < to.vertex ? from.sample : to.sample),
        along_((from.vertex < to.vertex ? to.sample : from.sample) - origin_),
        sign_(from.vertex < to.vertex ? 1 : -1) {
    const Vector2d sense = sign_ * along_;
    has_points_ = sense.y() > 0 || (sense.y() == 0 && sense.x() < 0);
  }

  double at(const Vector2d& point) const { return sign_ * cross(along_, point - origin_); }
  double along_x() const { return -sign_ * along_.y(); }  ///< Its change for a step along x.
  bool contains(double value) const { return value > 0 || (value == 0 && has_points_); }

 private:
  Vector2d origin_, along_;
  double sign_;
  bool has_points_;
};

/// Whether a box, in pixels, contains the middle of one of n × n samples of a pixel.
bool has_samples(const Eigen::AlignedBox2d& box, int n) {
  return ((n * box.min().array() - 0.5).ceil() <= (n * box.max().array() - 0.5).floor()).all();
}

/// The sides of a triangle of either orientation; side i is opposite corner i.
struct Sides {
  std::array<Side, 3> sides;
  double area;  // Twice.

  explicit Sides(const std::array<Corner, 3>& c)
      : sides{Side(c[1], c[2]), Side(c[2], c[0]), Side(c[0], c[1])},
        area(cross(c[1].sample - c[0].sample, c[2].sample - c[0].sample)) {
    if (area < 0) sides = {Side(c[2], c[1]), Side(c[0], c[2]), Side(c[1], c[0])};
    area = std::abs(area);
  }

  /// Narrows the points of a row that the triangle may contain: from (first, y) to (last, y).
  void narrow(double y, double& first, double& last) const {
    for (const Side& side : sides) {
      const double slope = side.along_x();
      const double zero = slope == 0 ? 0 : -side.at({0, y}) / slope;
      constexpr double rounding = 1e-6;
      if (slope > 0) first = std::max(first, zero - rounding);
      if (slope < 0) last = std::min(last, zero + rounding);
    }
  }

  /// Sets the weights of the corners at a point. @return whether the triangle contains it.
  bool contains(const Vector2d& point, std::array<float, 3>& weights) const {
    for (int i = 0; i < 3; ++i) {
      const double value = sides[i].at(point);
      if (!sides[i].contains(value)) return false;
      weights[i] = static_cast<float>(value / area);
    }
    return true;
  }
};

/// The landings within a triangle.
class Facet {
 public:
  explicit Facet(const std::array<Corner, 3>& corners) : corners_(corners) {
    float reach = 0, bent = 0;
    for (int i = 0; i < 3; ++i) {
      const Corner &a = corners[(i + 1) % 3], &b = corners[(i + 2) % 3];
      // A cubic through both ends, with their slopes, has this distance from the straight line in its middle.
      bends_[i] = (a.jacobian - b.jacobian) * (b.start - a.start).cast<float>() / 8;
      reach = std::max(reach, (b.landing - a.landing).cast<float>().norm());
      bent = std::max(bent, bends_[i].norm());
    }
    is_curved_ = bent <= max_curvature * reach;  // False for NaN.
  }

  Matrix2f jacobian(const std::array<float, 3>& w) const {
    return w[0] * corners_[0].jacobian + w[1] * corners_[1].jacobian + w[2] * corners_[2].jacobian;
  }

  float length(const std::array<float, 3>& w) const {
    return w[0] * corners_[0].length + w[1] * corners_[1].length + w[2] * corners_[2].length;
  }

  /// What the quadratic landing adds to the linear one.
  Vector2f curve(const std::array<float, 3>& w) const {
    if (!is_curved_) return {0, 0};
    return 4 * (w[1] * w[2] * bends_[0] + w[2] * w[0] * bends_[1] + w[0] * w[1] * bends_[2]);
  }

  Vector2d landing(const std::array<float, 3>& w) const {
    const Vector2d linear = corners_[0].landing + double{w[1]} * (corners_[1].landing - corners_[0].landing) +
                            double{w[2]} * (corners_[2].landing - corners_[0].landing);
    return linear + curve(w).cast<double>();
  }

  /// The start of the light that lands where the weights are those of the landing.
  Vector2d start(const std::array<float, 3>& w) const {
    const Vector2d b = corners_[1].start - corners_[0].start, c = corners_[2].start - corners_[0].start;
    Vector2d start = corners_[0].start + double{w[1]} * b + double{w[2]} * c;
    if (!is_curved_) return start;
    const Vector2d back = jacobian(w).cast<double>().inverse() * curve(w).cast<double>();  // Its determinant: any size.
    if (back.squaredNorm() <= double{max_curvature * max_curvature} * std::abs(cross(b, c))) start -= back;
    return start;
  }

 private:
  const std::array<Corner, 3>& corners_;
  std::array<Vector2f, 3> bends_;
  bool is_curved_ = false;
};

/// A triangle's corners at a wavelength, without slopes; samples are pixels.
struct Corners {
  std::array<Corner, 3> corners;
  bool is_mapped = true;  // Whether all light of the triangle is mapped to landings between those of the corners.

  /// @param landing_of  The FlowLanding of a vertex at the wavelength.
  template <typename LandingOf>
  Corners(const FlowMap& map, const FlowPicture& picture, const FlowTriangle& triangle, const LandingOf& landing_of) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t vertex = triangle.corners[i];
      const FlowLanding& landing = landing_of(vertex);
      const Vector2d start = map.starts[vertex];
      const Vector2d pixel = picture.to_pixel * (picture.side == FlowSide::starts ? start : landing.at);
      corners[i] = {vertex, landing.end, start, landing.at, pixel};
      is_mapped = is_mapped && landing.end == RayEnd::plate;
    }
    is_mapped = is_mapped && !jumps(triangle.is_torn, corners[0].landing, corners[1].landing, corners[2].landing);
  }

  Eigen::AlignedBox2d box() const {
    Eigen::AlignedBox2d result;
    for (const Corner& corner : corners) result.extend(corner.sample);
    return result;
  }
};

/// The ends of a range, and the map's wavelength samples between them: light moves straight from each to the next.
std::vector<double> knots_of(const FlowRange& range) {
  std::vector<double> knots{range.first};
  for (double sample = std::floor(range.first) + 1; sample < range.last; ++sample) knots.push_back(sample);
  if (range.last > range.first) knots.push_back(range.last);
  return knots;
}

/// The part of the picture, in pixels, that a triangle may cover between some wavelengths; empty: it covers none.
/// @param landings  Of all vertices, by wavelength.
Eigen::AlignedBox2d reach_of(const FlowMap& map, const FlowPicture& picture, const FlowTriangle& triangle,
                             const std::vector<std::vector<FlowLanding>>& landings) {
  Eigen::AlignedBox2d reach;
  bool is_mapped = picture.side == FlowSide::starts;
  for (const std::vector<FlowLanding>& each : landings) {
    const Corners corners(
        map, picture, triangle, [&](auto i) -> const auto& { return each[i]; });
    is_mapped = is_mapped || corners.is_mapped;
    for (const Corner& corner : corners.corners)
      if (picture.side == FlowSide::starts || corner.end == RayEnd::plate) reach.extend(corner.sample);
  }
  return is_mapped ? reach : Eigen::AlignedBox2d();
}

}  // namespace

PrincipalStretch principal_stretch(const Matrix2d& m) {
  if (!m.allFinite()) return {};
  const double greater =
      (std::hypot(m(0, 0) + m(1, 1), m(0, 1) - m(1, 0)) + std::hypot(m(0, 0) - m(1, 1), m(0, 1) + m(1, 0))) / 2;
  const Matrix2d square = m * m.transpose();
  return {{std::log(greater), std::log(std::abs(m.determinant())) - std::log(greater)},
          std::atan2(2 * square(0, 1), square(0, 0) - square(1, 1)) / 2};
}

FlowView::FlowView(const FlowMap& map, const FlowPicture& picture, std::vector<FlowRange> ranges, int samples)
    : map_(map),
      picture_(picture),
      ranges_(std::move(ranges)),
      samples_(samples),
      columns_((picture.resolution.x() + tile_size - 1) / tile_size),
      rows_((picture.resolution.y() + tile_size - 1) / tile_size),
      checks_(map.checks()),
      sorted_(ranges_.size()) {
  find_jacobians();
  tbb::parallel_for(std::size_t{0}, ranges_.size(), [&](std::size_t range) { sort_triangles(range); });
}

Eigen::AlignedBox2i FlowView::pixels(int tile) const {
  const Eigen::Vector2i first(tile % columns_ * tile_size, tile / columns_ * tile_size);
  return {first, (first + Eigen::Vector2i(tile_size, tile_size)).cwiseMin(picture_.resolution) - Eigen::Vector2i(1, 1)};
}

/// The mean of the triangles about each vertex, by area.
void FlowView::find_jacobians() {
  jacobians_.assign(map_.starts.size() * checks_, Matrix2f::Zero());
  tbb::parallel_for(std::size_t{0}, checks_, [&](std::size_t check) {
    const std::size_t wavelength = check * map_.check_step;
    std::vector<double> areas(map_.starts.size());
    std::vector<Matrix2d> sums(map_.starts.size(), Matrix2d::Zero());
    for (const FlowTriangle& triangle : map_.triangles) {
      const auto landed = [&](std::uint32_t i) { return map_.landed(i, wavelength); };
      if (triangle.is_torn || !std::all_of(triangle.corners.begin(), triangle.corners.end(), landed)) continue;
      const Matrix2d slope = triangle.area * slope_of(map_, triangle, wavelength);
      for (const std::uint32_t corner : triangle.corners) {
        sums[corner] += slope;
        areas[corner] += triangle.area;
      }
    }
    for (std::size_t i = 0; i < areas.size(); ++i)
      jacobians_[i * checks_ + check] = (sums[i] / areas[i]).cast<float>();  // NaN where there is none.
  });
}

void FlowView::sort_triangles(std::size_t range) {
  struct Tiles {
    std::uint32_t triangle;
    int left, top, right, bottom;
  };
  std::vector<Tiles> touched;
  const std::vector<double> places = knots_of(ranges_[range]);
  std::vector<std::vector<FlowLanding>> landings(places.size(), std::vector<FlowLanding>(map_.starts.size()));
  for (std::size_t k = 0; k < places.size(); ++k)
    for (std::size_t i = 0; i < landings[k].size(); ++i) landings[k][i] = landing_at(map_, i, places[k]);
  const Eigen::Array2d last = picture_.resolution.cast<double>().array() - 1;
  for (std::uint32_t t = 0; t < map_.triangles.size(); ++t) {
    const Eigen::AlignedBox2d box = reach_of(map_, picture_, map_.triangles[t], landings);
    if (box.isEmpty()) continue;
    if (!has_samples(box, 1) && !has_samples(box, samples_)) continue;
    if ((box.min().array() > last + 1).any() || (box.max().array() < 0).any()) continue;
    const Eigen::Array2i first = (box.min().array().max(0.0).min(last) / tile_size).cast<int>(),
                         end = (box.max().array().max(0.0).min(last) / tile_size).cast<int>();
    touched.push_back({t, first.x(), first.y(), end.x(), end.y()});
  }
  const auto for_each_tile = [&](const auto& call) {
    for (const Tiles& tiles : touched)
      for (int y = tiles.top; y <= tiles.bottom; ++y)
        for (int x = tiles.left; x <= tiles.right; ++x)
          call(static_cast<std::size_t>(y * columns_ + x), tiles.triangle);
  };
  Sorted& sorted = sorted_[range];
  sorted.first_of_tile.assign(static_cast<std::size_t>(tiles()) + 1, 0);
  for_each_tile([&](std::size_t tile, std::uint32_t) { ++sorted.first_of_tile[tile + 1]; });
  std::partial_sum(sorted.first_of_tile.begin(), sorted.first_of_tile.end(), sorted.first_of_tile.begin());
  sorted.triangles.resize(sorted.first_of_tile.back());
  std::vector<std::uint32_t> next = sorted.first_of_tile;
  for_each_tile([&](std::size_t tile, std::uint32_t t) { sorted.triangles[next[tile]++] = t; });
}

/// The samples of a tile, while triangles are drawn on them.
struct FlowView::TileSamples {
  Eigen::AlignedBox2i box;  // Of the samples, in samples of the picture.
  int n;                    // Samples of a pixel along x and along y.
  const std::vector<char>& wanted;
  std::vector<FlowPoint>& points;
  std::vector<double> distances;  // The squares of distances from straight light, of what the points show; of any size.

  bool is_wanted(int x, int y) const {
    if (wanted.empty()) return true;
    const int column = (x - box.min().x()) / n, row = (y - box.min().y()) / n;
    return wanted[static_cast<std::size_t>(row * ((box.sizes().x() + 1) / n) + column)] != 0;
  }
};

void FlowView::draw(int tile, int n, std::size_t range, double place, const std::vector<char>& wanted,
                    std::vector<FlowPoint>& points) const {
  const Eigen::AlignedBox2i box = pixels(tile);
  const Eigen::AlignedBox2i samples(n * box.min(), n * (box.max() + Eigen::Vector2i(1, 1)) - Eigen::Vector2i(1, 1));
  const auto count = static_cast<std::size_t>((samples.sizes() + Eigen::Vector2i(1, 1)).prod());
  points.assign(count, FlowPoint());
  TileSamples drawn{samples, n, wanted, points, std::vector<double>(count, std::numeric_limits<double>::infinity())};
  const Sorted& sorted = sorted_[range];
  for (std::uint32_t i = sorted.first_of_tile[tile]; i < sorted.first_of_tile[tile + 1]; ++i)
    draw_triangle(map_.triangles[sorted.triangles[i]], place, drawn);
}

/// Sets the slope and the length of a corner: linear between the wavelength samples that have them.
void FlowView::set_slope(double place, std::uint32_t vertex, Matrix2f& jacobian, float& length) const {
  const double check = place / static_cast<double>(map_.check_step);
  const std::size_t before = std::min(static_cast<std::size_t>(check), checks_ - 1),
                    after = std::min(before + 1, checks_ - 1);
  const auto part = static_cast<float>(check - static_cast<double>(before));
  const std::size_t a = vertex * checks_ + before, b = vertex * checks_ + after;
  jacobian = (1 - part) * jacobians_[a] + part * jacobians_[b];
  length = (1 - part) * map_.lengths[a] + part * map_.lengths[b];
}

void FlowView::draw_triangle(const FlowTriangle& triangle, double place, TileSamples& tile) const {
  Corners found(map_, picture_, triangle, [&](std::uint32_t i) { return landing_at(map_, i, place); });
  std::array<Corner, 3>& corners = found.corners;
  for (Corner& corner : corners) corner.sample *= tile.n;
  // The middles of samples are at ½, 1½, ...
  const Eigen::AlignedBox2d box = found.box();
  const Eigen::Array2d begin = (box.min().array() - 0.5).ceil().max(tile.box.min().array().cast<double>()),
                       end = (box.max().array() - 0.5).floor().min(tile.box.max().array().cast<double>());
  const Sides sides(corners);
  if ((begin > end).any() || sides.area == 0) return;
  for (Corner& corner : corners) {
    set_slope(place, corner.vertex, corner.jacobian, corner.length);
    if (!corner.jacobian.allFinite())
      corner.jacobian = slope_of(map_, triangle, static_cast<std::size_t>(place)).cast<float>();
  }
  const Facet facet(corners);

  const auto show = [&](const Vector2d& sample, const std::array<float, 3>& weights, std::size_t index) {
    FlowPoint& point = tile.points[index];
    if (!found.is_mapped) {
      point.end = corners[0].end;
      point.is_unknown = triangle.is_torn || corners[1].end != point.end || corners[2].end != point.end;
      return;
    }
    const Vector2d other = picture_.side == FlowSide::starts ? facet.landing(weights) : facet.start(weights);
    ++point.sheets;
    const double distance = (other - picture_.straight * Vector2d(sample / tile.n)).squaredNorm();
    if (!(distance < tile.distances[index])) return;
    tile.distances[index] = distance;
    point.end = RayEnd::plate;
    point.other = other.cast<float>();
    point.jacobian = facet.jacobian(weights);
    point.length = facet.length(weights);
    point.error = triangle.error;
  };
  const int width = tile.box.sizes().x() + 1;
  std::array<float, 3> weights{};
  for (int y = static_cast<int>(begin.y()); y <= static_cast<int>(end.y()); ++y) {
    double first = begin.x() + 0.5, last = end.x() + 0.5;
    sides.narrow(y + 0.5, first, last);
    for (int x = static_cast<int>(std::ceil(first - 0.5)); x + 0.5 <= last; ++x)
      if (const Vector2d sample(x + 0.5, y + 0.5); tile.is_wanted(x, y) && sides.contains(sample, weights))
        show(sample, weights, static_cast<std::size_t>((y - tile.box.min().y()) * width + x - tile.box.min().x()));
  }
}

}  // namespace tensorray
