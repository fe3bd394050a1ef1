#include "integrators/seeds/seeds.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "base/constants.h"
#include "base/geometry/box.h"
#include "renderer/sampling/random.h"

namespace tensorray {
namespace {

constexpr double disk_distance = 0.75;  // In units of √(area / count); random packing reaches 0.83.
constexpr std::uint64_t max_disks = 10'000'000;

void require_some(std::uint64_t count) {
  if (count == 0) throw std::invalid_argument("the count of seeds must be 1 or more");
}

/// Points in a grid whose cells are too small for two points. It finds whether a point lies within a distance of
/// another one.
class NeighbourGrid {
 public:
  NeighbourGrid(const Eigen::Vector2d& corner, const Eigen::Vector2d& extent, double distance)
      : corner_(corner),
        distance_(distance),
        cell_(distance / std::sqrt(2.0)),
        columns_(static_cast<int>(extent.x() / cell_) + 1),
        rows_(static_cast<int>(extent.y() / cell_) + 1),
        cells_(static_cast<std::size_t>(columns_) * rows_, empty) {}

  /// Adds `point` if no other point is nearer than the distance. @return whether it was added.
  bool add(const Eigen::Vector2d& point) {
    const Eigen::Vector2i at = ((point - corner_) / cell_).cast<int>();
    for (int y = std::max(at.y() - 2, 0); y <= std::min(at.y() + 2, rows_ - 1); ++y)
      for (int x = std::max(at.x() - 2, 0); x <= std::min(at.x() + 2, columns_ - 1); ++x)
        if (const std::uint32_t other = cell(x, y); other != empty && (points_[other] - point).norm() < distance_)
          return false;
    cell(at.x(), at.y()) = static_cast<std::uint32_t>(points_.size());
    points_.push_back(point);
    return true;
  }

  const std::vector<Eigen::Vector2d>& points() const { return points_; }

 private:
  static constexpr std::uint32_t empty = 0xffffffffu;
  std::uint32_t& cell(int x, int y) { return cells_[static_cast<std::size_t>(y) * columns_ + x]; }

  Eigen::Vector2d corner_;
  double distance_, cell_;
  int columns_, rows_;
  std::vector<std::uint32_t> cells_;
  std::vector<Eigen::Vector2d> points_;
};

}  // namespace

std::vector<Eigen::Vector3d> grid_seeds(const Beam& beam, std::uint64_t count) {
  require_some(count);
  const BeamSampler sampler(beam, BeamPattern::grid, count, 0);
  std::vector<Eigen::Vector3d> seeds;
  Emission emission;
  for (std::uint64_t i = 0; i < sampler.candidates(); ++i)
    if (sampler.sample(i, emission)) seeds.push_back(emission.origin);
  return seeds;
}

/// Dart throwing. The discs, which do not overlap, cover a fraction of 0.44 of the area. Random darts reach 0.547
/// before no room is left, so that the loop ends.
std::vector<Eigen::Vector3d> poisson_disk_seeds(const Beam& beam, std::uint64_t count, std::uint64_t seed) {
  require_some(count);
  if (count > max_disks) throw std::invalid_argument("there are at most 10,000,000 Poisson disk seeds: use the grid");
  const double distance = disk_distance * std::sqrt(area(beam.aperture) / static_cast<double>(count));
  const Eigen::AlignedBox2d box = box_of(beam.aperture);
  NeighbourGrid grid(box.min(), box.sizes(), distance);
  const BeamSampler sampler(beam, BeamPattern::random, count, seed);
  Emission emission;
  for (std::uint64_t dart = 0; grid.points().size() < count; ++dart) {
    if (!sampler.sample(dart, emission)) continue;
    const Eigen::Vector3d from_center = emission.origin - beam.center;
    grid.add({from_center.dot(beam.right), from_center.dot(beam.up)});
  }
  std::vector<Eigen::Vector3d> seeds;
  for (const Eigen::Vector2d& at : grid.points()) seeds.push_back(beam.start(at));
  return seeds;
}

std::vector<Eigen::Vector3d> line_seeds(const Eigen::Vector3d& from, const Eigen::Vector3d& to, std::uint64_t count) {
  require_some(count);
  if (count == 1) return {(from + to) / 2};
  std::vector<Eigen::Vector3d> seeds;
  for (std::uint64_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(count - 1);
    seeds.push_back((1 - t) * from + t * to);
  }
  return seeds;
}

std::vector<Eigen::Vector3d> sphere_seeds(const Eigen::Vector3d& center, double radius, std::uint64_t count,
                                          std::uint64_t seed) {
  require_some(count);
  if (count > (std::uint64_t{1} << 32)) throw std::invalid_argument("there are at most 2^32 seeds in a sphere");
  if (!(radius > 0)) throw std::invalid_argument("the radius of a sphere of seeds must be positive");
  std::vector<Eigen::Vector3d> seeds;
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto u = [&](std::uint32_t dimension) { return sobol(seed, static_cast<std::uint32_t>(i), dimension); };
    const double r = radius * std::cbrt(u(0)), z = 1 - 2 * u(1), across = std::sqrt(1 - z * z), turn = 2 * pi * u(2);
    seeds.push_back(center + r * Eigen::Vector3d(across * std::cos(turn), across * std::sin(turn), z));
  }
  return seeds;
}

}  // namespace tensorray
