#include "tools/import/lattices/lattice.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <tuple>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "volumes/tensors/finite_differences.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr int width = TensorBlock::size;

/// A block of the slab that is being read. It is made when the first active voxel is found. Counts its voxels by
/// kind.
template <class Block>
struct Place {
  std::unique_ptr<Block> block;
  std::size_t background = 0, non_finite = 0;
  FillValues fills;
};

int unmasked(const Lattice& lattice) { return lattice.components - (lattice.masked ? 1 : 0); }

bool is_background(const Lattice& lattice, const double* components) {
  if (lattice.masked && !(components[0] >= 0.5)) return true;  // A NaN in the mask counts as masked.
  return lattice.zero_is_background && std::all_of(components + (lattice.masked ? 1 : 0),
                                                   components + lattice.components, [](double c) { return c == 0; });
}

/// Stores the voxels that slice `z` has in the block that begins at (x0, y0).
template <class Block, class ValueOf>
void put(const Lattice& lattice, const ValueOf& value_of, const double* slice, const Vector3i& first, int z,
         Place<Block>& place) {
  for (int y = first.y(); y < std::min(first.y() + width, lattice.size.y()); ++y)
    for (int x = first.x(); x < std::min(first.x() + width, lattice.size.x()); ++x) {
      const auto voxel = static_cast<std::size_t>(y) * static_cast<std::size_t>(lattice.size.x()) + x;
      const double* components = slice + voxel * lattice.components;
      if (is_background(lattice, components)) {
        ++place.background;
        continue;
      }
      components += lattice.masked ? 1 : 0;
      const auto value = value_of(components);
      if (!value.allFinite()) {
        ++place.non_finite;
        continue;
      }
      place.fills.add(components, unmasked(lattice));
      if (!place.block) {
        place.block = std::make_unique<Block>();
        place.block->origin = first;
      }
      const int offset = TensorBlock::offset(x - first.x(), y - first.y(), z - first.z());
      place.block->active.set(offset);
      place.block->values[offset] = value;
    }
}

/// Appends the blocks of the slab whose first slice is `first_z` to `blocks`.
template <class Blocks, class ValueOf>
void add_slab(const Lattice& lattice, const ValueOf& value_of, int first_z, std::vector<double>& slice, Blocks& blocks,
              LatticeReport& report) {
  const int columns = (lattice.size.x() - 1) / width + 1, rows = (lattice.size.y() - 1) / width + 1;
  std::vector<Place<typename Blocks::value_type>> places(static_cast<std::size_t>(columns) * rows);
  for (int z = std::min(first_z + width, lattice.size.z()) - 1; z >= first_z; --z) {
    lattice.read_slice(z, slice.data());
    tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) {
      const Vector3i first(static_cast<int>(i % columns) * width, static_cast<int>(i / columns) * width, first_z);
      put(lattice, value_of, slice.data(), first, z, places[i]);
    });
  }
  for (auto& place : places) {
    report.background += place.background;
    report.non_finite += place.non_finite;
    report.fills.count += place.fills.count;
    if (place.fills.count > 0) report.fills.example = place.fills.example;
    if (!place.block) continue;
    report.active += place.block->active.count();
    blocks.push_back(std::move(*place.block));
    place.block.reset();
  }
}

/// Sorts blocks by origin. Moves each block only once, because blocks are large.
template <class Blocks>
void sort(Blocks& blocks) {
  std::vector<std::tuple<int, int, int, std::size_t>> order(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
    const Eigen::Vector3i& origin = blocks[i].origin;
    order[i] = {origin.x(), origin.y(), origin.z(), i};
  });
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> source;
  for (const auto& place : order) source.push_back(std::get<3>(place));
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (source[i] == i) continue;
    const auto first = std::make_unique<typename Blocks::value_type>(std::move(blocks[i]));
    std::size_t to = i;
    while (source[to] != i) {
      blocks[to] = std::move(blocks[source[to]]);
      to = std::exchange(source[to], to);
    }
    blocks[to] = std::move(*first);
    source[to] = to;
  }
}

/// Fills `blocks` with `value_of(components)` at all active voxels.
template <class Blocks, class ValueOf>
void read_blocks(const Lattice& lattice, const ValueOf& value_of, Blocks& blocks, LatticeReport& report) {
  report = {};
  report.notes = lattice.notes;
  if (!lattice.frame_note.empty()) report.notes.push_back(lattice.frame_note);
  const auto slice_voxels = static_cast<std::size_t>(lattice.size.x()) * lattice.size.y();
  report.voxels = slice_voxels * lattice.size.z();
  std::vector<double> slice(slice_voxels * lattice.components);
  for (int first_z = (lattice.size.z() - 1) / width * width; first_z >= 0; first_z -= width)
    add_slab(lattice, value_of, first_z, slice, blocks, report);
  sort(blocks);
}

std::string called(const Lattice& lattice) {
  return lattice.array.empty() ? "the file" : fmt::format("array \"{}\"", lattice.array);
}

/// Whether vectors are directions: those that are not zero have the length 1.
bool has_directions(const Lattice& lattice) {
  const auto voxels = static_cast<std::size_t>(lattice.size.x()) * static_cast<std::size_t>(lattice.size.y());
  std::vector<double> slice(voxels * static_cast<std::size_t>(lattice.components));
  bool has_some = false;
  for (int z = lattice.size.z() - 1; z >= 0; --z) {
    lattice.read_slice(z, slice.data());
    for (std::size_t i = 0; i < voxels; ++i) {
      const double* const vector = &slice[(i + 1) * static_cast<std::size_t>(lattice.components) - 3];
      const double length = Eigen::Map<const Vector3d>(vector).norm();
      if (length > 0 && !(std::abs(length - 1) < 0.01)) return false;
      has_some = has_some || length > 0;
    }
  }
  return has_some;
}

TensorOrder order_of(const Lattice& lattice, const std::optional<TensorOrder>& order) {
  const int count = unmasked(lattice);
  if (count == 3)
    throw std::invalid_argument(
        called(lattice) +
        (has_directions(lattice)
             ? " has vectors of length 1, as eigenvectors (dti_V1) are, of which no tensor can be made: import the "
               "tensor itself (FSL: dtifit --save_tensor writes dti_tensor)"
             : " has three components, a vector: derive a tensor (--gradient-of), or choose another array"));
  if (count != 4 && count != 6 && count < 9)
    throw std::invalid_argument(fmt::format("{} has {} component{} and a tensor six or nine: choose another array",
                                            called(lattice), count, count == 1 ? "" : "s"));
  const std::optional<TensorOrder> said = lattice.order || order ? lattice.order : lattice.usual_order;
  return chosen_order(count, said, order, called(lattice));
}

Matrix3d frame_of(const Lattice& lattice, TensorOrder order) {
  const Matrix3d to_world = lattice.to_world.linear();
  if (lattice.order_tells_frame && order == TensorOrder::fsl) return axes_of(ComponentFrame::fsl, to_world);
  if (lattice.order_tells_frame && order == TensorOrder::lower_triangle)
    return axes_of(ComponentFrame::voxels, to_world);
  return lattice.frame;
}

/// Whether an eigenvalue of a symmetric tensor is negative, by more than rounding or a thousandth of the norm.
bool has_negative_eigenvalue(const Eigen::Matrix3f& tensor) {
  const Matrix3d T = tensor.cast<double>();
  Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
  return solver.computeDirect(T, Eigen::EigenvaluesOnly).eigenvalues()[0] < -1e-3 * T.norm();
}

TensorGrid empty_grid(const Lattice& lattice) {
  TensorGrid grid;
  grid.to_world = lattice.to_world;
  if (!lattice.array.empty()) grid.name = lattice.array;
  return grid;
}

}  // namespace

void FillValues::add(const double* components, int size) {
  const double* const end = components + size;
  const double first = std::abs(components[0]), nines = std::pow(10, std::round(std::log10(first + 1))) - 1;
  const auto is_first = [first](double value) { return std::abs(first - value) <= 1e-6 * value; };
  const bool is_known = (nines >= 999 && is_first(nines)) || is_first(0x1p15) || is_first(0x1p31);
  if (std::none_of(components, end, [](double c) { return std::isfinite(c) && std::abs(c) >= 1e18; }) &&
      !(is_known && std::all_of(components, end, [&](double c) { return is_first(std::abs(c)); })))
    return;
  ++count;
  example = *std::max_element(components, end, [](double a, double b) { return std::abs(a) < std::abs(b); });
}

const std::vector<std::pair<std::string, ComponentFrame>>& component_frames() {
  using Frame = ComponentFrame;
  static const std::vector<std::pair<std::string, Frame>> frames = {
      {"ras", Frame::ras}, {"lps", Frame::lps}, {"voxels", Frame::voxels}, {"fsl", Frame::fsl}};
  return frames;
}

Eigen::Matrix3d axes_of(ComponentFrame frame, const Eigen::Matrix3d& to_ras) {
  if (frame == ComponentFrame::ras) return Eigen::Matrix3d::Identity();
  if (frame == ComponentFrame::lps) return Eigen::Vector3d(-1, -1, 1).asDiagonal();
  const Eigen::Matrix3d directions = to_ras.colwise().normalized();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(directions, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d axes = svd.matrixU() * svd.matrixV().transpose();
  if (frame == ComponentFrame::fsl && to_ras.determinant() > 0) axes.col(0) *= -1;
  return axes;
}

void take_frame(Lattice& lattice, ComponentFrame frame) {
  if (!lattice.takes_frame)
    throw std::invalid_argument(called(lattice) +
                                " says itself in which axes its components are, or is not in an anatomical space: "
                                "leave --frame out");
  lattice.frame = axes_of(frame, lattice.to_world.linear());
  lattice.order_tells_frame = false;
  lattice.frame_note.clear();
}

TensorGrid tensors_of(const Lattice& lattice, const std::optional<TensorOrder>& order, LatticeReport& report) {
  const TensorOrder chosen = order_of(lattice, order);
  const bool is_usual = lattice.usual_order && !lattice.order && !order;
  const Matrix3d frame = frame_of(lattice, chosen);
  TensorGrid grid = empty_grid(lattice);
  // Anatomical files hold diffusion tensors, whose eigenvalues are positive unless the user's order is wrong.
  const bool checks_order = lattice.takes_frame && order && !lattice.order && chosen != TensorOrder::full;
  std::atomic<std::size_t> negative{0};
  const auto tensor = [&](const double* components) -> Eigen::Matrix3f {
    const Matrix3d turned = frame * tensor_of(components, chosen) * frame.transpose();
    if (chosen == TensorOrder::full) return turned.cast<float>();
    // Symmetrizing removes rounding errors, so that symmetric tensors stay symmetric.
    const Eigen::Matrix3f symmetric = (0.5 * (turned + turned.transpose())).cast<float>();
    if (checks_order && has_negative_eigenvalue(symmetric)) negative.fetch_add(1, std::memory_order_relaxed);
    return symmetric;
  };
  read_blocks(lattice, tensor, grid.blocks, report);
  if (is_usual) report.notes.push_back("its six components are taken in the usual order; --order says otherwise");
  report.negative = static_cast<double>(negative) / static_cast<double>(std::max<std::size_t>(1, report.active));
  return grid;
}

TensorGrid gradient_of(const Lattice& lattice, LatticeReport& report) {
  if (unmasked(lattice) != 3)
    throw std::invalid_argument(
        fmt::format("a gradient or a strain needs a vector of three components: {} has {}; choose another",
                    called(lattice), unmasked(lattice)));
  SampleBlocks vectors;
  const auto vector = [&](const double* components) -> Vector3d {
    return lattice.frame * Eigen::Map<const Vector3d>(components);
  };
  read_blocks(lattice, vector, vectors, report);
  TensorGrid grid = empty_grid(lattice);
  grid.blocks = gradient(vectors, lattice.to_world.linear().inverse());
  return grid;
}

}  // namespace tensorray
