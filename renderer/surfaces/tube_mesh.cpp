#include "renderer/surfaces/tube_mesh.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "base/constants.h"
#include "base/geometry/box.h"
#include "renderer/surfaces/polyline.h"

namespace tensorray {
namespace {

constexpr double value_steps = 128;  // Steps in the range of all values: a smaller change needs no ring of its own.
constexpr int max_pieces = 64;       // Between two points.
constexpr std::size_t chunk = 1024;  // Number of tubes whose meshes are made before they are joined.

Eigen::Vector3d axis(const TubePoint& p) { return p.x.cross(p.y).normalized(); }
Eigen::Vector3d rim(const TubePoint& p, double angle) { return std::cos(angle) * p.x + std::sin(angle) * p.y; }
Eigen::Vector3d along_rim(const TubePoint& p, double angle) { return std::cos(angle) * p.y - std::sin(angle) * p.x; }

/// Normal to the rim, in the ellipse's plane.
Eigen::Vector3d rim_normal(const TubePoint& p, double angle) { return along_rim(p, angle).cross(axis(p)).normalized(); }

/// The greater semi-axis a. By the theorem of Apollonius, |x|² + |y|² = a² + b² and |x × y| = a b.
double max_radius(const TubePoint& p) {
  const double sum = p.x.squaredNorm() + p.y.squaredNorm(), product = p.x.cross(p.y).norm();
  return (std::sqrt(sum + 2 * product) + std::sqrt(std::max(0.0, sum - 2 * product))) / 2;
}

/// Number of segments of a polygon inscribed in a circle that is nowhere more than `tolerance` inside the circle.
int segments_for(double radius, double tolerance, const TubeSettings& settings) {
  const double half = std::acos(std::clamp(1 - tolerance / radius, -1.0, 1.0));
  const double wanted = half > 0 ? std::ceil(pi / half) : settings.max_segments;
  return static_cast<int>(std::clamp(wanted, double(settings.min_segments), double(settings.max_segments)));
}

/// A point, and how its x and y change per length, apart from their turn with the tube.
struct Knot {
  TubePoint point;
  Eigen::Vector3d x_slope = Eigen::Vector3d::Zero(), y_slope = Eigen::Vector3d::Zero();
};

/// The slope at a point between two others: that of the parabola; but so much less that no extremum comes between two
/// points (Fritsch and Carlson 1980, "Monotone Piecewise Cubic Interpolation").
/// @param before, behind  Slopes of the straight lines to the neighbours, whose lengths are `h` and `k`.
Eigen::Vector3d slope_between(const Eigen::Vector3d& before, double h, const Eigen::Vector3d& behind, double k) {
  if (!(before.dot(behind) > 0)) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d slope = (k * before + h * behind) / (h + k);
  const double greatest = 3 * std::min(before.norm(), behind.norm());
  return slope.norm() > greatest ? Eigen::Vector3d(greatest * slope.normalized()) : slope;
}

/// A tube's points with their slopes. Those at the ends are of parabolas.
std::vector<Knot> knots_of(const Tube& tube) {
  std::vector<Knot> knots;
  for (const TubePoint& point : tube) knots.push_back({point});
  // From point i − 1 to point i, in the plane of point k, which is one of them.
  const auto length = [&](std::size_t i) { return (tube[i].center - tube[i - 1].center).norm(); };
  const auto chord = [&](auto member, std::size_t i, std::size_t k) -> Eigen::Vector3d {
    const auto at = [&](std::size_t j) -> Eigen::Vector3d {
      return turn_between(axis(tube[j]), axis(tube[k])) * (tube[j].*member);
    };
    return length(i) > 0 ? Eigen::Vector3d((at(i) - at(i - 1)) / length(i)) : Eigen::Vector3d::Zero();
  };
  const auto set = [&](auto member, auto slope) {
    const std::size_t last = tube.size() - 1;
    for (std::size_t i = 1; i < last; ++i)
      knots[i].*slope = slope_between(chord(member, i, i), length(i), chord(member, i + 1, i), length(i + 1));
    const auto end_slope = [&](std::size_t i, std::size_t end, std::size_t other) -> Eigen::Vector3d {
      const Eigen::Vector3d mean = chord(member, i, end);
      if (last == 1) return mean;
      const Eigen::Quaterniond turn = turn_between(axis(tube[other]), axis(tube[end]));
      const Eigen::Vector3d there = 2 * mean - turn * (knots[other].*slope);
      return there.dot(mean) > 0 ? there : Eigen::Vector3d::Zero();
    };
    knots.front().*slope = end_slope(1, 0, 1);
    knots.back().*slope = end_slope(last, last, last - 1);
  };
  set(&TubePoint::x, &Knot::x_slope);
  set(&TubePoint::y, &Knot::y_slope);
  return knots;
}

/// A point between two points of a tube. The centre is on the cubic that has the tube's direction at both points, with
/// such a speed there that a circle's arc keeps its height. The ellipse turns with the direction; its x and y are on
/// the cubics with the slopes of both points.
TubePoint point_between(const Knot& start, const Knot& end, double t) {
  const TubePoint &a = start.point, &b = end.point;
  const Eigen::Vector3d from = axis(a), to = axis(b), chord = b.center - a.center;
  const double half_turn = std::sqrt(std::max(0.0, (1 + from.dot(to)) / 2));  // Its cosine.
  const double speed = chord.norm() * 2 / (1 + half_turn);
  const Eigen::Vector3d bulge = t * (1 - t) * (speed * ((1 - t) * from - t * to) - (1 - 2 * t) * chord);
  const Eigen::Quaterniond turn = turn_between(from, to);
  const Eigen::Quaterniond part = Eigen::Quaterniond::Identity().slerp(t, turn);
  const auto mixed = [&](auto member, auto slope) -> Eigen::Vector3d {
    const Eigen::Vector3d u = a.*member, change = turn.conjugate() * (b.*member) - u;
    const Eigen::Vector3d at_start = chord.norm() * (start.*slope) - change;
    const Eigen::Vector3d at_end = chord.norm() * (turn.conjugate() * (end.*slope)) - change;
    return part * (u + t * change + t * (1 - t) * ((1 - t) * at_start - t * at_end));
  };
  return {a.center + t * chord + bulge, mixed(&TubePoint::x, &Knot::x_slope), mixed(&TubePoint::y, &Knot::y_slope),
          (1 - t) * a.value + t * b.value, (1 - t) * a.shade + t * b.shade};
}

/// Distance between the straight surface that joins two rings and the tube. Of what the cubics of x and y add, half, so
/// that it may be all of the tolerance: by half of their second derivative, at the end where it is greater.
double deviation(const Knot& start, const Knot& end) {
  const TubePoint &a = start.point, &b = end.point;
  const double turn = (axis(b) - axis(a)).norm(), length = (b.center - a.center).norm();
  const Eigen::Quaterniond back = turn_between(axis(b), axis(a));
  const auto bend = [&](auto member, auto slope) {
    const Eigen::Vector3d change = back * (b.*member) - a.*member;
    const Eigen::Vector3d u = length * (start.*slope) - change;
    const Eigen::Vector3d v = length * (back * (end.*slope)) - change;
    return std::max((2 * u + v).norm(), (u + 2 * v).norm());
  };
  const double swelling = std::max(bend(&TubePoint::x, &Knot::x_slope), bend(&TubePoint::y, &Knot::y_slope));
  return ((length + turn * std::max(max_radius(a), max_radius(b))) * turn + swelling) / 8;
}

/// Leaves out rings that interpolation gives to half the tolerance, and adds rings where the curvature needs them, or
/// the change of the ellipses.
Tube adapted(const Tube& tube, double tolerance, double value_tolerance, double shade_tolerance) {
  const auto error = [&](std::size_t i, std::size_t j, std::size_t k) {
    const TubePoint &a = tube[i], &b = tube[j], &point = tube[k];
    const Eigen::Vector3d chord = b.center - a.center;
    const double squared = chord.squaredNorm();
    const double t = squared > 0 ? std::clamp(chord.dot(point.center - a.center) / squared, 0.0, 1.0) : 0;
    const auto unlike = [&](auto member) {
      return ((a.*member) + t * ((b.*member) - (a.*member)) - (point.*member)).norm();
    };
    const double apart = unlike(&TubePoint::center) + std::max(unlike(&TubePoint::x), unlike(&TubePoint::y));
    const auto off = [&](auto member, double allowed) {
      const double difference = std::abs(a.*member + t * (b.*member - a.*member) - point.*member);
      return difference > 0 ? difference / allowed : 0;
    };
    return std::max(
        {apart / (tolerance / 2), off(&TubePoint::value, value_tolerance), off(&TubePoint::shade, shade_tolerance)});
  };
  const auto worst = [&](std::size_t i, std::size_t j) {
    Worst found;
    // Where no error is allowed, the first one is enough.
    for (std::size_t k = i + 1; k < j && !std::isinf(found.error); ++k)
      if (const double each = error(i, j, k); !(each <= found.error)) found = {each, k};
    return found;
  };
  Tube kept;
  for (const std::size_t i : thinned(tube.size(), worst)) kept.push_back(tube[i]);
  const std::vector<Knot> knots = knots_of(kept);
  Tube result{kept[0]};
  for (std::size_t i = 1; i < kept.size(); ++i) {
    const double wanted = std::ceil(std::sqrt(deviation(knots[i - 1], knots[i]) / (tolerance / 2)));
    const int pieces = static_cast<int>(std::clamp(wanted, 1.0, double(max_pieces)));
    for (int piece = 1; piece < pieces; ++piece)
      result.push_back(point_between(knots[i - 1], knots[i], double(piece) / pieces));
    result.push_back(kept[i]);
  }
  return result;
}

/// Points at even distances of about `spacing`, including both ends.
Tube spaced(const Tube& tube, double spacing) {
  std::vector<double> lengths{0};
  for (std::size_t i = 1; i < tube.size(); ++i)
    lengths.push_back(lengths.back() + (tube[i].center - tube[i - 1].center).norm());
  const double pieces = std::max(1.0, std::round(lengths.back() / spacing));
  const std::vector<Knot> knots = knots_of(tube);
  Tube result;
  std::size_t next = 1;
  for (double piece = 0; piece <= pieces; ++piece) {
    const double at = piece / pieces * lengths.back();
    while (next + 1 < tube.size() && lengths[next] < at) ++next;
    const double gap = lengths[next] - lengths[next - 1];
    const double t = gap > 0 ? std::clamp((at - lengths[next - 1]) / gap, 0.0, 1.0) : 1;
    result.push_back(point_between(knots[next - 1], knots[next], t));
  }
  return result;
}

/// Joins rings with equal numbers of vertices into a surface.
class Loft {
 public:
  Loft(const Tube& rings, int segments, bool closed, TubeMesh& mesh)
      : rings_(rings), segments_(segments), closed_(closed), mesh_(mesh), first_(mesh.mesh.vertices.size()) {}

  void add_side() {
    for (std::size_t k = 0; k < rings_.size(); ++k)
      for (int j = 0; j < segments_; ++j) add_vertex(position(k, j), normal(k, j), rings_[k].value);
    const std::size_t strips = closed_ ? rings_.size() : rings_.size() - 1;
    for (std::size_t k = 0; k < strips; ++k)
      for (int j = 0; j < segments_; ++j) {
        const std::uint32_t a = index(k, j), b = index(k, j + 1), c = index(k + 1, j + 1), d = index(k + 1, j);
        mesh_.mesh.triangles.push_back({a, b, c});
        mesh_.mesh.triangles.push_back({a, c, d});
      }
  }

  /// Adds the polygon of ring `k` (the first or the last), with its own vertices.
  void add_flat_cap(std::size_t k) {
    const Eigen::Vector3d outwards = k == 0 ? Eigen::Vector3d(-axis(rings_[k])) : axis(rings_[k]);
    const auto center = static_cast<std::uint32_t>(mesh_.mesh.vertices.size());
    for (int j = 0; j < segments_; ++j) add_vertex(position(k, j), outwards, rings_[k].value);
    for (int j = 1; j + 1 < segments_; ++j) add_oriented(k, center, center + j, center + j + 1);
  }

  /// Adds the cone from ring `k` to a point beyond it, with the ring's vertices.
  void add_pole(std::size_t k, const Eigen::Vector3d& pole) {
    const Eigen::Vector3d outwards = k == 0 ? Eigen::Vector3d(-axis(rings_[k])) : axis(rings_[k]);
    const auto tip = static_cast<std::uint32_t>(mesh_.mesh.vertices.size());
    add_vertex(pole, outwards, rings_[k].value);
    for (int j = 0; j < segments_; ++j) add_oriented(k, tip, index(k, j), index(k, j + 1));
  }

 private:
  double angle(int j) const { return 2 * pi * j / segments_; }
  Eigen::Vector3d position(std::size_t k, int j) const { return rings_[k].center + rim(rings_[k], angle(j)); }
  std::uint32_t index(std::size_t k, int j) const {
    return static_cast<std::uint32_t>(first_ + k % rings_.size() * segments_ + j % segments_);
  }

  /// Normal to the surface: normal to the rim, and to the line from the ring before to the ring behind.
  Eigen::Vector3d normal(std::size_t k, int j) const {
    const std::size_t n = rings_.size();
    const std::size_t before = k > 0 ? k - 1 : closed_ ? n - 1 : 0, behind = k + 1 < n ? k + 1 : closed_ ? 0 : n - 1;
    const Eigen::Vector3d flat = rim_normal(rings_[k], angle(j));
    const Eigen::Vector3d steep = along_rim(rings_[k], angle(j)).cross(position(behind, j) - position(before, j));
    // On the inside of a bend that is tighter than the tube is thick, the surface runs backwards.
    return steep.dot(flat) > 0 ? Eigen::Vector3d(steep.normalized()) : flat;
  }

  void add_vertex(const Eigen::Vector3d& position, const Eigen::Vector3d& normal, double value) {
    mesh_.mesh.vertices.push_back(position);
    mesh_.normals.push_back(normal.cast<float>());
    mesh_.values.push_back(static_cast<float>(value));
  }

  /// Adds the triangle (a, b, c), counter-clockwise about the tube's direction; reversed at the tube's start.
  void add_oriented(std::size_t k, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (k == 0) std::swap(b, c);
    mesh_.mesh.triangles.push_back({a, b, c});
  }

  const Tube& rings_;
  int segments_;
  bool closed_;
  TubeMesh& mesh_;
  std::size_t first_;
};

/// The rings of half an ellipsoid from the pole to `end`, without both; `sense` is −1 at a tube's start, 1 at its end.
Tube dome(const TubePoint& end, double sense, double height, int segments) {
  Tube rings;
  const int count = std::max(2, segments / 4);
  for (int i = count - 1; i > 0; --i) {
    const double angle = pi / 2 * i / count;
    const Eigen::Vector3d center = end.center + sense * height * std::sin(angle) * axis(end);
    rings.push_back({center, std::cos(angle) * end.x, std::cos(angle) * end.y, end.value});
  }
  return rings;
}

/// About the lesser semi-axis; exactly the radius if the ellipse is a circle.
double dome_height(const TubePoint& end) {
  return std::sqrt(2) * end.x.cross(end.y).norm() / std::sqrt(end.x.squaredNorm() + end.y.squaredNorm());
}

void add_solid(const Tube& tube, int segments, TubeCaps caps, TubeMesh& mesh) {
  if (caps != TubeCaps::round) {
    Loft loft(tube, segments, false, mesh);
    loft.add_side();
    if (caps == TubeCaps::open) return;
    loft.add_flat_cap(0);
    loft.add_flat_cap(tube.size() - 1);
    return;
  }
  const TubePoint &start = tube.front(), &end = tube.back();
  Tube rings = dome(start, -1, dome_height(start), segments), last = dome(end, 1, dome_height(end), segments);
  rings.insert(rings.end(), tube.begin(), tube.end());
  rings.insert(rings.end(), last.rbegin(), last.rend());
  Loft loft(rings, segments, false, mesh);
  loft.add_side();
  loft.add_pole(0, start.center - dome_height(start) * axis(start));
  loft.add_pole(rings.size() - 1, end.center + dome_height(end) * axis(end));
}

/// The settings, with values in place of those that were automatic.
struct TubeJob {
  TubeSettings settings;
  double value_tolerance, shade_tolerance;
};

void add_hoop(const TubeJob& job, const TubePoint& point, TubeMesh& mesh) {
  const TubeSettings& s = job.settings;
  const int pieces = std::max(12, segments_for(max_radius(point), s.tolerance, s));
  Tube hoop;
  for (int j = 0; j < pieces; ++j) {
    const double angle = 2 * pi * j / pieces;
    hoop.push_back({point.center + rim(point, angle), s.wire_radius * axis(point),
                    s.wire_radius * rim_normal(point, angle), point.value});
  }
  Loft(hoop, segments_for(s.wire_radius, s.tolerance, s), true, mesh).add_side();
}

/// A round wire along the tube, at one angle.
void add_line(const TubeJob& job, const Tube& tube, double angle, TubeMesh& mesh) {
  const double radius = job.settings.wire_radius;
  const auto position = [&](std::size_t k) -> Eigen::Vector3d { return tube[k].center + rim(tube[k], angle); };
  Tube line;
  for (std::size_t k = 0; k < tube.size(); ++k) {
    const Eigen::Vector3d step = position(std::min(k + 1, tube.size() - 1)) - position(k > 0 ? k - 1 : 0);
    const Eigen::Vector3d tangent = step.dot(axis(tube[k])) > 0 ? Eigen::Vector3d(step.normalized()) : axis(tube[k]);
    const Eigen::Vector3d normal = rim_normal(tube[k], angle);
    const Eigen::Vector3d x = radius * (normal - normal.dot(tangent) * tangent).normalized();
    line.push_back({position(k), x, tangent.cross(x), tube[k].value});
  }
  add_solid(line, segments_for(radius, job.settings.tolerance, job.settings), job.settings.caps, mesh);
}

void add_disc(const TubeJob& job, const TubePoint& point, TubeMesh& mesh) {
  Tube disc{point, point};
  disc[0].center -= job.settings.thickness / 2 * axis(point);
  disc[1].center += job.settings.thickness / 2 * axis(point);
  add_solid(disc, segments_for(max_radius(point), job.settings.tolerance, job.settings), TubeCaps::flat, mesh);
}

TubeMesh make_tube(const TubeJob& job, const Tube& tube) {
  TubeMesh mesh;
  const TubeSettings& settings = job.settings;
  if (tube.size() >= 2 && settings.style == TubeStyle::discs) {
    for (const TubePoint& point : spaced(tube, settings.spacing)) add_disc(job, point, mesh);
  } else if (tube.size() >= 2) {
    const Tube rings = adapted(tube, settings.tolerance, job.value_tolerance, job.shade_tolerance);
    if (settings.style == TubeStyle::wire) {
      for (const TubePoint& point : spaced(tube, settings.spacing)) add_hoop(job, point, mesh);
      for (int j = 0; j < settings.lines; ++j) add_line(job, rings, 2 * pi * j / settings.lines, mesh);
    } else {
      double radius = 0;
      for (const TubePoint& ring : rings) radius = std::max(radius, max_radius(ring));
      add_solid(rings, segments_for(radius, settings.tolerance, settings), settings.caps, mesh);
    }
  }
  mesh.tube_ends.push_back(static_cast<std::uint32_t>(mesh.mesh.triangles.size()));
  return mesh;
}

[[noreturn]] void refuse_size(const TubeSettings& settings) {
  throw std::runtime_error("the tubes need more than " + std::to_string(settings.max_triangles) +
                           " triangles: draw fewer of them, lines instead, or a picture of fewer pixels");
}

void append(const TubeMesh& part, TubeMesh& whole) {
  const auto vertices = static_cast<std::uint32_t>(whole.mesh.vertices.size());
  const auto triangles = static_cast<std::uint32_t>(whole.mesh.triangles.size());
  whole.mesh.vertices.insert(whole.mesh.vertices.end(), part.mesh.vertices.begin(), part.mesh.vertices.end());
  whole.normals.insert(whole.normals.end(), part.normals.begin(), part.normals.end());
  whole.values.insert(whole.values.end(), part.values.begin(), part.values.end());
  for (const auto& [a, b, c] : part.mesh.triangles)
    whole.mesh.triangles.push_back({a + vertices, b + vertices, c + vertices});
  for (const std::uint32_t end : part.tube_ends) whole.tube_ends.push_back(end + triangles);
}

/// Joins many meshes into one that uses no more memory than it needs; frees each part after its copy.
TubeMesh joined(std::vector<TubeMesh>& parts) {
  std::size_t vertices = 0, triangles = 0, tubes = 0;
  for (const TubeMesh& part : parts) {
    vertices += part.mesh.vertices.size();
    triangles += part.mesh.triangles.size();
    tubes += part.tube_ends.size();
  }
  TubeMesh whole;
  whole.mesh.vertices.reserve(vertices);
  whole.normals.reserve(vertices);
  whole.values.reserve(vertices);
  whole.mesh.triangles.reserve(triangles);
  whole.tube_ends.reserve(tubes);
  for (TubeMesh& part : parts) {
    append(part, whole);
    part = TubeMesh();
  }
  return whole;
}

double range_of(const std::vector<Tube>& tubes, double TubePoint::*member) {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const Tube& tube : tubes)
    for (const TubePoint& point : tube) {
      least = std::min(least, point.*member);
      greatest = std::max(greatest, point.*member);
    }
  return std::max(0.0, greatest - least);
}

/// Checks the number of ellipses before any is made: a small spacing could give any number of them.
void require_few_ellipses(const std::vector<Tube>& tubes, const TubeSettings& settings) {
  if (settings.style == TubeStyle::solid) return;
  double ellipses = 0;
  for (const Tube& tube : tubes)
    for (std::size_t i = 1; i < tube.size(); ++i)
      ellipses += (tube[i].center - tube[i - 1].center).norm() / settings.spacing;
  const double triangles = ellipses * settings.min_segments * (settings.style == TubeStyle::wire ? 24 : 2);
  if (triangles > static_cast<double>(settings.max_triangles)) refuse_size(settings);
}

TubeJob make_job(const std::vector<Tube>& tubes, TubeSettings settings) {
  const double lengths[] = {settings.tolerance, settings.spacing, settings.wire_radius, settings.thickness};
  for (const double length : lengths)
    if (!(length >= 0) || !std::isfinite(length))
      throw std::invalid_argument("lengths of the tubes' style must be positive, or 0 (automatic)");
  if (settings.min_segments < 3 || settings.max_segments < settings.min_segments)
    throw std::invalid_argument("tubes need 3 segments around or more, and no fewer at most than at least");
  if (settings.max_triangles > std::uint64_t{1} << 31) throw std::invalid_argument("tubes have at most 2^31 triangles");
  if (settings.lines < 0) throw std::invalid_argument("the number of lines of wire tubes must not be negative");
  for (const Tube& tube : tubes)
    for (const TubePoint& point : tube)
      if (!point.center.allFinite() || !(point.x.cross(point.y).norm() > 0))
        throw std::invalid_argument("a tube has a point that is not finite, or an ellipse without an area");
  const double radius = typical_radius(tubes);
  const auto choose = [&](double& length, double factor) {
    if (length == 0) length = factor * radius;
  };
  choose(settings.tolerance, 1.0 / 50);
  choose(settings.spacing, 2);
  choose(settings.wire_radius, 1.0 / 20);
  choose(settings.thickness, 1.0 / 10);
  require_few_ellipses(tubes, settings);
  return {settings, range_of(tubes, &TubePoint::value) / value_steps, range_of(tubes, &TubePoint::shade) / value_steps};
}

}  // namespace

double typical_radius(const std::vector<Tube>& tubes) {
  std::vector<double> radii;
  for (const Tube& tube : tubes)
    for (const TubePoint& point : tube) radii.push_back(point.x.norm());
  if (radii.empty()) return 0;
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), middle, radii.end());
  return *middle;
}

TubeMesh make_tube_mesh(std::vector<Tube> tubes, const TubeSettings& settings) {
  const TubeJob job = make_job(tubes, settings);
  std::vector<TubeMesh> chunks;
  std::atomic<std::uint64_t> triangles{0};
  for (std::size_t first = 0; first < tubes.size(); first += chunk) {
    std::vector<TubeMesh> parts(std::min(chunk, tubes.size() - first));
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
      parts[i] = make_tube(job, std::exchange(tubes[first + i], {}));
      if ((triangles += parts[i].mesh.triangles.size()) > settings.max_triangles) refuse_size(settings);
    });
    chunks.push_back(joined(parts));
  }
  return chunks.size() == 1 ? std::move(chunks[0]) : joined(chunks);
}

}  // namespace tensorray
