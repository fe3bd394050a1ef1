#include "tools/benchmark/kernels/workload.h"

#include <algorithm>
#include <cmath>

#include "integrators/probes/auto_scale.h"
#include "renderer/lights/beam.h"
#include "renderer/meshes/mesh.h"

namespace tensorray::benchmark {
namespace {

constexpr std::uint64_t batch_packets = 16;
constexpr std::uint64_t warm_edge = 8;           // Origins along an edge of the square of Order::warm, one voxel apart.
constexpr double least_s = 0.02, most_s = 0.37;  // Flexibilities of 730 and 380 nm with the paper's a and b.

/// Rounds to eight bits: the last bits of the kernel that finds a scale must not change the field, so that the ends of
/// rays of two programs can be compared.
float rounded(double value) {
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);
  return static_cast<float>(std::ldexp(std::round(mantissa * 256) / 256, exponent));
}

/// Scales a grid so that the median ray turns by `turn`. Small turns are proportional to the scale.
void scale_to_turn(TensorGrid& grid, const Eigen::Vector3d& direction, double turn) {
  const TensorField field(grid);
  Surfaces surfaces;
  surfaces.bounds = box_mesh(field.index_bounds(), field.to_world());
  const Beam beam = silhouette_beam(field.corners(), direction, Eigen::Vector3d::UnitZ());
  const AutoScale chosen = choose_scale(field, Geometry(std::move(surfaces)), beam, Progress());
  const float factor = rounded(chosen.scale * turn / chosen.median_turn);
  for (TensorBlock& block : grid.blocks)
    for (Eigen::Matrix3f& value : block.values) value *= factor;
}

void empty_every_second_cube(TensorGrid& grid, int edge) {
  const auto leaves = [&](const TensorBlock& block) {
    const Eigen::Vector3i cube = block.origin / edge;
    return (cube.sum() & 1) != 0;
  };
  grid.blocks.erase(std::remove_if(grid.blocks.begin(), grid.blocks.end(), leaves), grid.blocks.end());
}

/// A permutation of the numbers below `count`, a power of two.
std::uint64_t shuffled(std::uint64_t i, std::uint64_t count) { return (i * 40503 + 12345) & (count - 1); }

/// Every second bit of a number, from the lowest on.
std::uint64_t even_bits(std::uint64_t number) {
  std::uint64_t result = 0;
  for (int bit = 0; bit < 32; ++bit) result |= (number >> (2 * bit) & 1) << bit;
  return result;
}

/// A position on a Morton curve through edge² cells, in shuffled pieces of 32² cells.
std::uint64_t along_curve(std::uint64_t packet, std::uint64_t edge) {
  constexpr std::uint64_t piece = 32 * 32;
  return shuffled(packet / piece, edge * edge / piece) * piece + packet % piece;
}

/// Where packet number `packet` enters the field, as fractions of the edges of the face.
Eigen::Vector2d place(Order order, std::uint64_t packet, int voxels) {
  if (order == Order::warm) {
    const double x = static_cast<double>(packet % warm_edge), y = static_cast<double>(packet / warm_edge % warm_edge);
    return Eigen::Vector2d(0.55, 0.6) + Eigen::Vector2d(x + 0.3, y + 0.6) / voxels;
  }
  const std::uint64_t edge = order == Order::dense ? 1024 : 256, cell = shuffled(packet, edge * edge);
  const std::uint64_t curve = along_curve(packet, edge);
  const std::uint64_t x = order == Order::fresh ? cell % edge : even_bits(curve);
  const std::uint64_t y = order == Order::fresh ? cell / edge : even_bits(curve >> 1);
  return Eigen::Vector2d(static_cast<double>(x) + 0.41, static_cast<double>(y) + 0.73) / static_cast<double>(edge);
}

}  // namespace

TestField make_field(const FieldRequest& request) {
  const Eigen::Vector3d direction = request.direction.normalized();
  TensorGrid grid = generate(request.generator, default_grid(request.generator, request.resolution));
  scale_to_turn(grid, direction, request.turn);
  if (request.half_empty) empty_every_second_cube(grid, request.resolution < 128 ? 16 : 64);
  TensorField field(grid);
  Surfaces surfaces;
  surfaces.bounds = box_mesh(field.index_bounds(), field.to_world());
  return {std::move(grid), std::move(field), Geometry(std::move(surfaces)), direction};
}

std::vector<RayBatch> make_batches(const TestField& test, Order order, std::uint64_t first, std::uint64_t packets) {
  const Eigen::AlignedBox3d& box = test.field.index_bounds();
  int axis = 0;
  test.direction.cwiseAbs().maxCoeff(&axis);
  std::vector<RayBatch> batches((packets + batch_packets - 1) / batch_packets);
  for (std::uint64_t i = 0; i < packets; ++i) {
    const Eigen::Vector2d at = place(order, first + i, static_cast<int>(box.sizes()[axis]));
    Eigen::Vector3d fraction;
    fraction[axis] = test.direction[axis] < 0 ? 1 : 0;
    fraction[(axis + 1) % 3] = at.x();
    fraction[(axis + 2) % 3] = at.y();
    const Eigen::Vector3d origin = test.field.to_world() * (box.min() + fraction.cwiseProduct(box.sizes())).eval();
    for (int lane = 0; lane < packet_rays; ++lane)
      batches[i / batch_packets].add(origin, test.direction, least_s + (most_s - least_s) * lane / (packet_rays - 1));
  }
  return batches;
}

}  // namespace tensorray::benchmark
