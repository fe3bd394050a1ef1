#include "volumes/tensors/finite_differences.h"

#include <algorithm>
#include <tuple>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

/// The value at a voxel; inactive voxels have none.
struct Sample {
  Vector3d value = Vector3d::Zero();
  bool active = false;
};

std::tuple<int, int, int> key(const Vector3i& origin) { return {origin.x(), origin.y(), origin.z()}; }

/// A block and its 26 neighbours.
class Neighbourhood {
 public:
  Neighbourhood(const SampleBlocks& blocks, const Vector3i& origin) {
    for (int i = 0; i < 27; ++i) {
      const Vector3i wanted = origin + TensorBlock::size * (Vector3i(i / 9, i / 3 % 3, i % 3) - Vector3i::Ones());
      const auto found =
          std::lower_bound(blocks.begin(), blocks.end(), wanted,
                           [](const SampleBlock& block, const Vector3i& o) { return key(block.origin) < key(o); });
      blocks_[i] = found != blocks.end() && found->origin == wanted ? &*found : nullptr;
    }
  }

  /// The sample at a position in the block. The position may be up to one block's width outside the block.
  Sample at(const Vector3i& position) const {
    constexpr int size = TensorBlock::size;
    const Vector3i shifted = position.array() + size;
    const Vector3i block = shifted / size, inside = shifted - size * block;
    const SampleBlock* found = blocks_[(block.x() * 3 + block.y()) * 3 + block.z()];
    const int offset = TensorBlock::offset(inside.x(), inside.y(), inside.z());
    if (!found || !found->active[offset]) return {};
    return {found->values[offset], true};
  }

 private:
  std::array<const SampleBlock*, 27> blocks_;
};

/// The first difference at 0 of `sample(n)`, n in voxels.
template <class At>
Vector3d first_difference(const At& sample) {
  const Sample before = sample(-1), here = sample(0), after = sample(1);
  if (before.active && after.active) return 0.5 * (after.value - before.value);
  if (!before.active && !after.active) return Vector3d::Zero();
  const int inwards = after.active ? 1 : -1;
  const Sample& one = after.active ? after : before;
  const Sample two = sample(2 * inwards);
  if (!two.active) return inwards * (one.value - here.value);
  return inwards * (2 * one.value - 1.5 * here.value - 0.5 * two.value);
}

/// The second difference at 0 of `sample(n)`; at an edge, the one of the next voxel inwards.
template <class At>
Vector3d second_difference(const At& sample) {
  const Sample before = sample(-1), here = sample(0), after = sample(1);
  if (before.active && after.active) return before.value - 2 * here.value + after.value;
  if (!before.active && !after.active) return Vector3d::Zero();
  const Sample& one = after.active ? after : before;
  const Sample two = sample(after.active ? 2 : -2);
  return two.active ? Vector3d(here.value - 2 * one.value + two.value) : Vector3d::Zero();
}

Vector3d first_difference(const Neighbourhood& near, const Vector3i& position, int axis) {
  return first_difference([&](int n) { return near.at(position + n * Vector3i::Unit(axis)); });
}

/// The difference along `second` of the differences along `first`.
double mixed_difference(const Neighbourhood& near, const Vector3i& position, int first, int second) {
  return first_difference([&](int n) -> Sample {
           const Vector3i there = position + n * Vector3i::Unit(second);
           if (!near.at(there).active) return {};
           return {first_difference(near, there, first), true};
         })
      .x();
}

Matrix3d gradient_at(const Neighbourhood& near, const Vector3i& position, const Matrix3d& to_index) {
  Matrix3d differences;
  for (int axis = 0; axis < 3; ++axis) differences.col(axis) = first_difference(near, position, axis);
  return differences * to_index;
}

/// The first difference at the middle between the faces 0 and 1 of `sample(n)`; where there is no face 1, extrapolated.
double face_difference(const std::array<Sample, 4>& faces) {  // −2, −1, 0 and 1
  const auto at = [&](int n) { return faces[static_cast<std::size_t>(n + 2)].value.x(); };
  const auto is_active = [&](int n) { return faces[static_cast<std::size_t>(n + 2)].active; };
  if (is_active(1)) return at(1) - at(0);
  if (!is_active(-1)) return 0;
  return is_active(-2) ? 2 * at(0) - 3 * at(-1) + at(-2) : at(0) - at(-1);
}

/// Component `axis` of a staggered vector at the centre of a voxel: the mean of its two faces, or extrapolated.
Sample centre_of(const Neighbourhood& near, const Vector3i& position, int axis) {
  const Sample face = near.at(position);
  if (!face.active) return {};
  const auto component = [axis](const Sample& sample) { return sample.value[axis]; };
  const Sample next = near.at(position + Vector3i::Unit(axis));
  if (next.active) return {Vector3d(0.5 * (component(face) + component(next)), 0, 0), true};
  const Sample before = near.at(position - Vector3i::Unit(axis));
  const double slope = before.active ? component(face) - component(before) : 0;
  return {Vector3d(component(face) + 0.5 * slope, 0, 0), true};
}

Matrix3d staggered_gradient_at(const Neighbourhood& near, const Vector3i& position, const Matrix3d& to_index) {
  Matrix3d differences;
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const auto along = [&](int n) -> Vector3i { return position + n * Vector3i::Unit(axis); };
      if (axis != i) {
        differences(i, axis) = first_difference([&](int n) { return centre_of(near, along(n), i); }).x();
        continue;
      }
      std::array<Sample, 4> faces;
      for (int n = -2; n <= 1; ++n) {
        Sample& face = faces[static_cast<std::size_t>(n + 2)];
        face = near.at(along(n));
        face.value = Vector3d(face.value[i], 0, 0);
      }
      differences(i, axis) = face_difference(faces);
    }
  return differences * to_index;
}

Matrix3d hessian_at(const Neighbourhood& near, const Vector3i& position, const Matrix3d& to_index) {
  Matrix3d differences;
  for (int i = 0; i < 3; ++i) {
    differences(i, i) = second_difference([&](int n) { return near.at(position + n * Vector3i::Unit(i)); }).x();
    for (int j = 0; j < i; ++j)  // At ragged edges the order of the two axes matters: take the mean.
      differences(i, j) = differences(j, i) =
          0.5 * (mixed_difference(near, position, i, j) + mixed_difference(near, position, j, i));
  }
  const Matrix3d tensor = to_index.transpose() * differences * to_index;
  return 0.5 * (tensor + tensor.transpose());
}

/// Evaluates `tensor_at(neighbourhood, position, to_index)` at every active voxel.
template <class TensorAt>
TensorBlocks derive(const SampleBlocks& blocks, const Matrix3d& to_index, const TensorAt& tensor_at) {
  TensorBlocks result = make_blocks(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
    const Neighbourhood near(blocks, blocks[i].origin);
    result[i].origin = blocks[i].origin;
    result[i].active = blocks[i].active;
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (blocks[i].active[offset])
        result[i].values[offset] = tensor_at(near, TensorBlock::position(offset), to_index).template cast<float>();
  });
  return result;
}

}  // namespace

TensorBlocks gradient(const SampleBlocks& blocks, const Matrix3d& to_index) {
  return derive(blocks, to_index, gradient_at);
}

TensorBlocks staggered_gradient(const SampleBlocks& blocks, const Matrix3d& to_index) {
  return derive(blocks, to_index, staggered_gradient_at);
}

TensorBlocks hessian(const SampleBlocks& blocks, const Matrix3d& to_index) {
  return derive(blocks, to_index, hessian_at);
}

}  // namespace tensorray
