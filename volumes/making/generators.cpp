#include "volumes/making/generators.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "base/constants.h"
#include "base/errors.h"
#include "base/process/process_limits.h"
#include "base/text/text.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// The shortest text that reads back as the same number.
std::string text(double value) {
  std::array<char, 32> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return std::string(buffer.data(), end);
}

/// Components separated by commas, a matrix row by row.
template <class Derived>
std::string text(const Eigen::MatrixBase<Derived>& values) {
  std::string result;
  for (Eigen::Index row = 0; row < values.rows(); ++row)
    for (Eigen::Index column = 0; column < values.cols(); ++column)
      result += (result.empty() ? "" : ",") + text(static_cast<double>(values(row, column)));
  return result;
}

bool all_finite(double value) { return std::isfinite(value); }

template <class Derived>
bool all_finite(const Eigen::MatrixBase<Derived>& values) {
  return values.allFinite();
}

/// v vᵀ. It is symmetric, bit for bit; a scalar times v vᵀ, in one expression, need not be.
template <int size>
Eigen::Matrix<double, size, size> outer_square(const Eigen::Matrix<double, size, 1>& v) {
  return v * v.transpose();
}

template <class Load>
void check_load(const Load& g) {
  require(g.poisson_ratio >= -1 && g.poisson_ratio <= 0.5, "poisson_ratio must be between -1 and 0.5");
  require(g.radius >= 0, "radius must not be negative; 0 is a load on a point");
}

// Checks the ranges of the parameters, which `describe` does not contain.
void check(const PointLoad& g) { check_load(g); }
void check(const TwoPointLoad& g) { check_load(g); }
void check(const Constant&) {}
void check(const Rotation& g) { require(g.axis.norm() > 0, "axis must not be zero"); }
void check(const Shear& g) {
  require(g.flow.norm() > 0, "flow must not be zero");
  require(g.gradient.norm() > 0, "gradient must not be zero");
}
void check(const Vortex& g) { require(g.core > 0, "core must be positive"); }
void check(const Helix& g) {
  require(g.radius > 0, "radius must be positive");
  require(g.pitch != 0, "pitch must not be zero");
  require(g.thickness > 0, "thickness must be positive");
}

void check_generator(Generator& generator) {
  std::visit(
      [](auto& g) {
        describe(g, [](const char* key, const auto& member, const char*) {
          if (!all_finite(member)) throw std::invalid_argument(std::string(key) + " must be finite");
        });
        check(g);
      },
      generator);
}

/// Distance between voxels along each axis. An axis with one voxel has the thickness of the box or, if that is zero,
/// the smallest distance along the other axes.
Vector3d voxel_sizes(const GridSettings& grid) {
  require((grid.resolution.array() >= 1).all(), "resolution must be at least 1 along each axis");
  require(grid.min.allFinite() && grid.max.allFinite() && (grid.max.array() >= grid.min.array()).all(),
          "the box must be finite, with max >= min along each axis");
  const Vector3d extent = grid.max - grid.min;
  Vector3d sizes = extent.cwiseQuotient((grid.resolution.array() - 1).max(1).matrix().cast<double>());
  require(((sizes.array() > 0) || (grid.resolution.array() == 1)).all(),
          "the box must have max > min along each axis with a resolution above 1");
  const double least = (sizes.array() > 0).select(sizes, INFINITY).minCoeff();
  return (sizes.array() > 0).select(sizes, std::isfinite(least) ? least : 1.0);
}

Eigen::Affine3d grid_to_world(const GridSettings& grid, const Vector3d& sizes) {
  // A single voxel is in the middle of the box.
  const Vector3d middle = 0.5 * (grid.min + grid.max);
  const Vector3d origin = (grid.resolution.array() == 1).select(middle, grid.min);
  return Eigen::Translation3d(origin) * Eigen::Scaling(sizes);
}

/// The position of a single load: one voxel above the middle of the box's top face.
Vector3d load_position(const GridSettings& grid) {
  const double top = grid.resolution.z() == 1 ? 0.5 * (grid.min.z() + grid.max.z()) : grid.max.z();
  return {0.5 * (grid.min.x() + grid.max.x()), 0.5 * (grid.min.y() + grid.max.y()), top + voxel_sizes(grid).z()};
}

// `sample(generator, position)` is the tensor at a world position; for loads, relative to the load.

Matrix3d load_stress(const Vector3d& position, double load, double radius, double poisson_ratio) {
  return radius > 0 ? disc_load_stress(position, load, radius, poisson_ratio)
                    : point_load_stress(position, load, poisson_ratio);
}

Matrix3d sample(const PointLoad& g, const Vector3d& position) {
  return load_stress(position, g.load, g.radius, g.poisson_ratio);
}

Matrix3d sample(const TwoPointLoad& g, const Vector3d& from_middle) {
  const Vector3d half = 0.5 * g.separation * Vector3d::UnitX();
  return load_stress(from_middle + half, g.load, g.radius, g.poisson_ratio) +
         load_stress(from_middle - half, g.second_load, g.radius, g.poisson_ratio);
}

Matrix3d sample(const Constant& g, const Vector3d&) { return g.tensor; }

Matrix3d sample(const Rotation& g, const Vector3d&) {
  const Vector3d w = g.rate * g.axis.normalized();
  Matrix3d tensor;
  tensor << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return tensor;
}

Matrix3d sample(const Shear& g, const Vector3d& position) {
  const Vector3d gradient = g.gradient.normalized();
  const double rate = g.rate * (1 + g.profile * position.dot(gradient));
  return rate * g.flow.normalized() * gradient.transpose();
}

/// The velocity is (−½ strain x − Ω y, −½ strain y + Ω x, strain z), Ω = Γ/(2π core²) · (1 − e^{−q})/q, q = r²/core².
Matrix3d sample(const Vortex& g, const Vector3d& position) {
  const double x = position.x(), y = position.y();
  const double q = (x * x + y * y) / (g.core * g.core);
  const double rate = g.circulation / (2 * pi * g.core * g.core);
  // Near the axis the closed forms lose accuracy, so that series are used.
  const double omega = rate * (q < 1e-8 ? 1 - q / 2 : -std::expm1(-q) / q);
  const double slope = q < 1e-2 ? -1.0 / 2 + q / 3 - q * q / 8 + q * q * q / 30 - q * q * q * q / 144
                                : (std::exp(-q) * (1 + q) - 1) / (q * q);
  const double k = 2 * rate * slope / (g.core * g.core);  // ∂Ω/∂x = k x, ∂Ω/∂y = k y.
  Matrix3d tensor = Matrix3d::Zero();
  tensor(0, 0) = -g.strain / 2 - k * x * y;
  tensor(0, 1) = -omega - k * y * y;
  tensor(1, 0) = omega + k * x * x;
  tensor(1, 1) = -g.strain / 2 + k * x * y;
  tensor(2, 2) = g.strain;
  return tensor;
}

/// 1 on the helix, falling as a Gaussian of the distance to each turn. The turns are combined as 1 − Π(1 − Gaussian),
/// which is smooth and at most 1. Towards the axis the distances to all turns become equal, whatever the angle.
double helix_profile(const Helix& g, const Vector3d& position) {
  const double radial = std::hypot(position.x(), position.y());
  const double rise = g.pitch / (2 * pi);
  const double angle = std::atan2(position.y(), position.x());
  const double height = std::remainder(position.z() - rise * angle, g.pitch);
  const double slope = radial * g.radius / (g.radius * g.radius + rise * rise);  // (ρ/R) cos² of the helix's slope.
  const int turns = 2 + static_cast<int>(std::ceil(4 * g.thickness / std::abs(g.pitch)));
  double outside = 1;
  for (int turn = -turns; turn <= turns; ++turn) {
    const double along_axis = height + turn * g.pitch;
    const double across_tube = radial - g.radius;
    const double squared = across_tube * across_tube + slope * along_axis * along_axis;
    outside *= -std::expm1(-squared / (2 * g.thickness * g.thickness));
  }
  return 1 - outside;
}

Matrix3d sample(const Helix& g, const Vector3d& position) {
  // The direction of a screw motion's velocity: the helix's tangent at the helix's radius, the axis in the middle,
  // smooth between.
  const Vector3d tangent = Vector3d(-position.y(), position.x(), g.pitch / (2 * pi)).normalized();
  const double profile = helix_profile(g, position);
  return (g.background + profile * (g.across - g.background)) * Matrix3d::Identity() +
         profile * (g.along - g.across) * outer_square(tangent);
}

std::string source_of(Generator generator, const GridSettings& grid) {
  std::string source = kind_of(generator);
  const auto add = [&](const char* key, const auto& member, const char*) {
    source += std::string(" ") + key + "=" + text(member);
  };
  std::visit([&](auto& g) { describe(g, add); }, generator);
  source += " resolution=" + text(grid.resolution) + " min=" + text(grid.min) + " max=" + text(grid.max);
  return grid.levels == 1 ? source : source + " levels=" + std::to_string(grid.levels);
}

bool is_point_load(const Generator& generator) {
  return std::holds_alternative<PointLoad>(generator) || std::holds_alternative<TwoPointLoad>(generator);
}

/// The tensor of a generator by world position.
template <class Kind>
auto sampler_of(const Kind& g, const GridSettings& grid) {
  constexpr bool is_load = std::is_same_v<Kind, PointLoad> || std::is_same_v<Kind, TwoPointLoad>;
  const Vector3d origin = is_load ? load_position(grid) : Vector3d(0, 0, 0);
  return [g, origin](const Vector3d& position) { return sample(g, Vector3d(position - origin)); };
}

/// Where the loads of a generator are, index space.
std::vector<Vector3d> loads_of(const Generator& generator, const GridSettings& grid, const Eigen::Affine3d& to_index) {
  const Vector3d middle = load_position(grid);
  if (std::holds_alternative<PointLoad>(generator)) return {to_index * middle};
  const auto* two = std::get_if<TwoPointLoad>(&generator);
  require(two, "levels: only point_load and two_point_load are refined, towards the load");
  const Vector3d half = two->separation / 2 * Vector3d::UnitX();
  return {to_index * Vector3d(middle - half), to_index * Vector3d(middle + half)};
}

/// The bricks within a box of voxels that are nearer to a load than their edge. @param loads  In voxels of the level.
std::vector<Eigen::Vector3i> bricks_near(const std::vector<Vector3d>& loads, const Eigen::AlignedBox3i& box) {
  constexpr int edge = TensorBlock::size;
  std::vector<Eigen::Vector3i> bricks;
  for (const Vector3d& load : loads) {
    if (!(box.cast<double>().exteriorDistance(load) < edge)) continue;
    const Eigen::Vector3i middle = (load / edge).array().floor().cast<int>();
    for (int n = 0; n < 27; ++n) {
      const Eigen::Vector3i brick = middle + Eigen::Vector3i(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1);
      const Eigen::AlignedBox3i cells(edge * brick, edge * brick + Eigen::Vector3i::Constant(edge));
      if (cells.cast<double>().exteriorDistance(load) < edge && !cells.intersection(box).isEmpty())
        bricks.push_back(brick);
    }
  }
  return bricks;
}

template <std::size_t... I>
Generator generator_at(std::size_t index, std::index_sequence<I...>) {
  Generator generator;
  ((I == index ? void(generator.emplace<I>()) : void()), ...);
  return generator;
}

/// 1 − s atan(1/s) for s >= 0, without the loss of digits where s is large.
double arc_deficit(double s) {
  if (s < 100) return 1 - s * std::atan2(1, s);
  const double t = 1 / (s * s);
  return t * (1.0 / 3 - t * (1.0 / 5 - t / 7));
}

}  // namespace

const std::vector<std::string>& generator_kinds() {
  static const std::vector<std::string> kinds{"point_load", "two_point_load", "constant", "rotation",
                                              "shear",      "vortex",         "helix"};
  return kinds;
}

std::string kind_of(const Generator& generator) { return generator_kinds()[generator.index()]; }

Generator generator_of(const std::string& kind) {
  constexpr std::size_t count = std::variant_size_v<Generator>;
  for (std::size_t i = 0; i < count; ++i)
    if (generator_kinds()[i] == kind) return generator_at(i, std::make_index_sequence<count>());
  throw std::invalid_argument("unknown kind of field \"" + kind + "\"; the kinds are " + joined(generator_kinds()));
}

GridSettings default_grid(const Generator& generator, int resolution) {
  require(resolution >= 2, "resolution must be at least 2");
  GridSettings grid;
  grid.resolution.setConstant(resolution);
  if (is_point_load(generator)) {
    const double voxel = 2.0 / (resolution - 1);
    grid.resolution.z() = resolution - 1;  // The load is at z = 0, one voxel above the box.
    grid.min.z() = -2;
    grid.max.z() = -voxel;
  }
  return grid;
}

BlockSource generator_source(const Generator& generator, const GridSettings& grid) {
  Generator checked = generator;
  check_generator(checked);
  require(grid.levels >= 1 && grid.levels <= max_levels, "levels must be 1 to 4");
  const Eigen::Affine3d to_world = grid_to_world(grid, voxel_sizes(grid));
  const Eigen::AlignedBox3i box(Eigen::Vector3i::Zero(), Eigen::Vector3i(grid.resolution.array() - 1));
  const auto source_of_box = [&](const Eigen::AlignedBox3i& voxels, const Eigen::Affine3d& transform) {
    return std::visit(
        [&](const auto& g) {
          return dense_source(voxels, transform,
                              [sampled = sampler_of(g, grid), transform](const Eigen::Vector3i& index) {
                                return sampled(transform * index.cast<double>());
                              });
        },
        checked);
  };
  BlockSource result = source_of_box(box, to_world);
  Eigen::AlignedBox3i coarse = box;
  for (int level = 1; level < grid.levels; ++level) {
    const Eigen::Affine3d before = to_world_of_level(to_world, level - 1),
                          transform = to_world_of_level(to_world, level);
    const Eigen::AlignedBox3i voxels(2 * coarse.min(), 2 * coarse.max());
    const std::vector<Eigen::Vector3i> bricks = bricks_near(loads_of(checked, grid, before.inverse()), coarse);
    if (bricks.empty()) break;  // The loads are far away.
    const Eigen::AlignedBox3i any(Eigen::Vector3i::Zero(), Eigen::Vector3i::Zero());
    result.finer.push_back({shapes_within(bricks, voxels), source_of_box(any, transform).fill});
    coarse = voxels;
  }
  result.name = kind_of(generator);
  result.metadata["tensorray:field"] = result.name;
  result.metadata["tensorray:units"] = "1/length";
  result.metadata["tensorray:source"] = source_of(generator, grid);
  return result;
}

void require_memory_for(const GridSettings& grid, double bytes) {
  if (memory_bound()) return;
  const double needed = bytes * grid.resolution.cast<double>().prod();
  const MemoryLimit limit = memory_limit();
  require(needed <= limit.bytes, "resolution: the voxels need about " + bytes_text(needed) + ", more than " +
                                     limit.cause + ", " + bytes_text(limit.bytes) + "; make fewer");
}

TensorGrid generate(const Generator& generator, const GridSettings& grid) {
  require_memory_for(grid, 38);
  return to_grid(generator_source(generator, grid));
}

Matrix3d point_load_stress(const Vector3d& position, double load, double poisson_ratio) {
  // Timoshenko's cylindrical components, with depth = −z, regrouped so that nothing is divided by the distance to the
  // axis. The radial part is −3 depth p pᵀ/R⁵; the rest lies in the plane of the surface.
  const double depth = -position.z(), distance = position.norm();
  const double cube = distance * distance * distance, reach = distance + depth;
  // A product of a vector with itself is symmetric, bit for bit; with a factor in the same expression it need not be.
  const Matrix3d square = position * position.transpose();
  Matrix3d tensor = -3 * depth / (cube * distance * distance) * square;
  const double compressibility = 1 - 2 * poisson_ratio;
  const Vector2d across = position.head<2>();
  const Matrix2d across_square = across * across.transpose();
  tensor.topLeftCorner<2, 2>() += compressibility * ((depth / cube - 1 / (distance * reach)) * Matrix2d::Identity() +
                                                     (distance + reach) / (cube * reach * reach) * across_square);
  return load / (2 * pi) * tensor;
}

Matrix3d disc_load_stress(const Vector3d& position, double load, double radius, double poisson_ratio) {
  // Huber's components with lengths in radii. An ellipsoid confocal to the disc goes through the position; its half
  // axis is s: r²/(1 + s²) + depth²/s² = 1. Then q = depth/s, and s² + q² = root. The components are regrouped so that
  // nothing is divided by r, and that no large terms cancel.
  const Vector2d across = position.head<2>() / radius;
  const double depth = std::max(0.0, -position.z() / radius);
  const double b = across.squaredNorm() + depth * depth - 1;
  const double root = std::hypot(b, 2 * depth);
  if (root == 0) return Matrix3d::Zero();  // On the edge of the disc there is no pressure.
  const double s = b < 0 ? std::sqrt(2 / (root - b)) * depth : std::sqrt((root + b) / 2);
  const double q = b < 0 ? std::sqrt((root - b) / 2) : depth / s;

  const double w = 1 / (1 + s * s);
  const double compressibility = 1 - 2 * poisson_ratio;
  const double around = -compressibility / 3 * w * (1 + q + q * q) / (1 + q) +
                        q * ((1 - poisson_ratio) * w - (1 + poisson_ratio) * arc_deficit(s));
  // (radial − around) / r².
  const double difference = w * w * (compressibility * (2 + q) / (3 * (1 + q) * (1 + q)) - q * s * s / root);

  Matrix3d tensor = Matrix3d::Zero();
  const Matrix2d across_square = across * across.transpose();
  tensor.topLeftCorner<2, 2>() = around * Matrix2d::Identity() + difference * across_square;
  tensor.topRightCorner<2, 1>() = q * q * s * w / root * across;
  tensor.bottomLeftCorner<1, 2>() = tensor.topRightCorner<2, 1>().transpose();
  tensor(2, 2) = -q * q * q / root;
  return 3 * load / (2 * pi * radius * radius) * tensor;
}

}  // namespace tensorray
