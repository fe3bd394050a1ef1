#include "volumes/grids/mirror.h"

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>

namespace tensorray {
namespace {

using Eigen::Vector3i;
using Fill = std::function<void(std::size_t, TensorBlock&)>;

constexpr double tolerance = 1e-3;  // Voxels.

/// Voxel j along `axis` becomes `sum` − j.
struct Reflection {
  int axis = 0;
  int sum = 0;
  Eigen::DiagonalMatrix<float, 3> of_world{Eigen::Vector3f::Ones()};

  Vector3i operator()(Vector3i voxel) const {
    voxel[axis] = sum - voxel[axis];
    return voxel;
  }
};

int axis_named(const std::string& name) {
  for (const int axis : {0, 1, 2})
    if (name == std::string(1, "xyz"[axis])) return axis;
  throw std::invalid_argument(std::string(mirror_key) + " is \"" + name + "\", not x, y or z");
}

Reflection reflection_of(const Eigen::Affine3d& to_world, int world_axis) {
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs[world_axis] = -1;
  const Eigen::Affine3d in_voxels = to_world.inverse() * Eigen::Scaling(signs) * to_world;
  Reflection result;
  in_voxels.linear().diagonal().minCoeff(&result.axis);
  result.sum = static_cast<int>(std::lround(in_voxels.translation()[result.axis]));
  result.of_world.diagonal() = signs.cast<float>();
  Eigen::Affine3d exact = Eigen::Affine3d::Identity();
  exact.linear()(result.axis, result.axis) = -1;
  exact.translation()[result.axis] = result.sum;
  if (!in_voxels.matrix().isApprox(exact.matrix(), tolerance / (1 + std::abs(result.sum))))
    throw std::invalid_argument(std::string("the plane of ") + mirror_key +
                                " is neither at voxels nor half-way between them");
  return result;
}

/// A level and its mirror image.
class MirroredLevel {
 public:
  /// @param brick  Of a finer level, the voxels along an edge of the bricks that it refines; 0: the level is no such.
  MirroredLevel(std::vector<BlockShape> shapes, Fill fill, const Reflection& reflection, int brick)
      : half_(std::move(shapes)), fill_(std::move(fill)), reflection_(reflection), brick_(brick) {
    for (std::size_t i = 0; i < half_.size(); ++i) number_[key_of(half_[i].origin)] = i;
    if (brick_ == 0) return;
    for (const BlockShape& shape : half_) {
      Vector3i place = brick_of(shape.origin);
      refined_.insert(key_of(place));
      place[reflection_.axis] = reflection_.sum / brick_ - 1 - place[reflection_.axis];
      refined_.insert(key_of(place));
    }
  }

  /// The shapes of the whole level.
  std::vector<BlockShape> shapes() const {
    constexpr int none = std::numeric_limits<int>::max();  // No block begins there.
    std::map<Key, BlockShape> all;
    const auto shape_at = [&](const Vector3i& origin) -> BlockShape* {
      // The image of the first face of a brick is that of the next one, which need not be refined.
      if (brick_ > 0 && refined_.count(key_of(brick_of(origin))) == 0) return nullptr;
      BlockShape& shape = all[key_of(origin)];
      shape.origin = origin;
      return &shape;
    };
    for (const BlockShape& half : half_) {
      if (BlockShape* const shape = shape_at(half.origin)) shape->active |= half.active;
      BlockShape* image = nullptr;
      Vector3i origin = Vector3i::Constant(none);  // Of the image's block.
      for (int i = 0; i < TensorBlock::voxels; ++i) {
        if (!half.active[static_cast<std::size_t>(i)]) continue;
        const Vector3i voxel = reflection_(half.origin + TensorBlock::position(i));
        if (origin_of(voxel) != origin) image = shape_at(origin = origin_of(voxel));
        const Vector3i at = voxel - origin;
        if (image) image->active.set(static_cast<std::size_t>(TensorBlock::offset(at.x(), at.y(), at.z())));
      }
    }
    std::vector<BlockShape> result;
    for (const auto& [key, shape] : all) result.push_back(shape);
    return result;
  }

  /// Writes the values of the active voxels of `block`.
  void fill(TensorBlock& block) const {
    std::array<int, TensorBlock::voxels> counts{};
    add(block.origin, false, block, counts);
    const int last = reflection_.sum - block.origin[reflection_.axis];  // The image of the first voxels.
    Vector3i image = block.origin;
    image[reflection_.axis] = last;
    add(origin_of(image), true, block, counts);
    Vector3i other = image;
    other[reflection_.axis] = last - TensorBlock::size + 1;
    if (origin_of(other) != origin_of(image)) add(origin_of(other), true, block, counts);
    for (std::size_t i = 0; i < TensorBlock::voxels; ++i)
      if (counts[i] == 2) block.values[i] *= 0.5F;
  }

 private:
  using Key = std::array<int, 3>;

  static Key key_of(const Vector3i& origin) { return {origin.x(), origin.y(), origin.z()}; }
  Vector3i brick_of(const Vector3i& voxel) const {
    return voxel.unaryExpr([this](int i) { return (i - (i % brick_ + brick_) % brick_) / brick_; });
  }
  static Vector3i origin_of(const Vector3i& voxel) {
    return voxel.unaryExpr([](int i) { return i & ~(TensorBlock::size - 1); });
  }

  /// Adds the values of the half's block at `origin`, or of its image.
  void add(const Vector3i& origin, bool is_image, TensorBlock& block,
           std::array<int, TensorBlock::voxels>& counts) const {
    const auto found = number_.find(key_of(origin));
    if (found == number_.end()) return;
    TensorBlock half{TensorBlock::Unset{}};
    read_block(half_[found->second], fill_, found->second, half);
    for (int i = 0; i < TensorBlock::voxels; ++i) {
      if (!half.active[static_cast<std::size_t>(i)]) continue;
      const Vector3i voxel = half.origin + TensorBlock::position(i);
      const Vector3i at = (is_image ? reflection_(voxel) : voxel) - block.origin;
      if ((at.array() < 0 || at.array() >= TensorBlock::size).any()) continue;
      const auto offset = static_cast<std::size_t>(TensorBlock::offset(at.x(), at.y(), at.z()));
      if (!block.active[offset]) continue;
      const Eigen::Matrix3f& value = half.values[static_cast<std::size_t>(i)];
      const Eigen::Matrix3f wanted =
          is_image ? Eigen::Matrix3f(reflection_.of_world * value * reflection_.of_world) : value;
      block.values[offset] = counts[offset]++ == 0 ? wanted : Eigen::Matrix3f(block.values[offset] + wanted);
    }
  }

  std::vector<BlockShape> half_;
  Fill fill_;
  Reflection reflection_;
  int brick_;
  std::map<Key, std::size_t> number_;
  std::set<Key> refined_;  // The places of bricks, of the whole level.
};

void mirror_level(std::vector<BlockShape>& shapes, Fill& fill, const Reflection& reflection, int brick) {
  const auto level = std::make_shared<MirroredLevel>(std::move(shapes), std::move(fill), reflection, brick);
  shapes = level->shapes();
  fill = [level](std::size_t, TensorBlock& block) { level->fill(block); };
}

TriangleMesh with_mirror_image(const TriangleMesh& half, int axis) {
  const double thin = tolerance * 1e-3 * half.bounds().diagonal().norm();
  const auto is_in_plane = [&](std::uint32_t i) { return std::abs(half.vertices[i][axis]) <= thin; };
  TriangleMesh whole{half.vertices, {}};
  std::vector<std::uint32_t> image;  // Vertices in the plane are their own.
  for (std::uint32_t i = 0; i < half.vertices.size(); ++i) {
    image.push_back(is_in_plane(i) ? i : static_cast<std::uint32_t>(whole.vertices.size()));
    if (is_in_plane(i)) continue;
    whole.vertices.push_back(half.vertices[i]);
    whole.vertices.back()[axis] *= -1;
  }
  for (const auto& [a, b, c] : half.triangles) {
    if (is_in_plane(a) && is_in_plane(b) && is_in_plane(c)) continue;
    whole.triangles.push_back({a, b, c});
    whole.triangles.push_back({image[a], image[c], image[b]});
  }
  return whole;
}

}  // namespace

BlockSource with_mirror_image(BlockSource source) {
  const auto entry = source.metadata.find(mirror_key);
  if (entry == source.metadata.end()) return source;
  const int axis = axis_named(entry->second);
  Reflection reflection = reflection_of(source.to_world, axis);
  if (!source.finer.empty() && reflection.sum % TensorBlock::size != 0)
    throw std::invalid_argument(std::string("the plane of ") + mirror_key +
                                " must be a face of the bricks of 8 voxels, as the field has finer levels");
  mirror_level(source.shapes, source.fill, reflection, 0);
  for (BlockLevel& level : source.finer) {
    reflection.sum *= 2;
    mirror_level(level.shapes, level.fill, reflection, 2 * TensorBlock::size);
  }
  source.surface = with_mirror_image(source.surface, axis);
  source.metadata[mirrored_key] = entry->second;
  source.metadata.erase(mirror_key);
  return source;
}

}  // namespace tensorray
