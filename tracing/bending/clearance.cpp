#include "tracing/bending/clearance.h"

#include <algorithm>
#include <cmath>

namespace tensorray {

Clearance::Clearance(const Eigen::AlignedBox3d& region, double margin) : low_(region.min()), margin_(margin) {
  constexpr double blocks = 1 << 17, most_along_an_axis = 512;
  const Eigen::Vector3d size = region.sizes();
  edge_ = std::max(size.maxCoeff() / most_along_an_axis,
                   std::cbrt(size[0] / blocks) * std::cbrt(size[1]) * std::cbrt(size[2]));
  count_ = (size.array() / edge_).ceil().max(1).min(most_along_an_axis + 1).cast<int>();
}

void Clearance::add(const TriangleMesh& mesh) {
  for (const auto& triangle : mesh.triangles)
    touch(mesh.vertices[triangle[0]], mesh.vertices[triangle[1]], mesh.vertices[triangle[2]]);
}

/// Marks the blocks that a triangle may touch: those about its plane, in its bounding box.
void Clearance::touch(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Array3d last = (count_ - 1).cast<double>();
  const Eigen::Array3d low = ((a.cwiseMin(b).cwiseMin(c) - low_).array() - margin_) / edge_,
                       high = ((a.cwiseMax(b).cwiseMax(c) - low_).array() + margin_) / edge_;
  if (!((low <= last + 1) && (high >= 0)).all()) return;
  if (blocks_.empty()) blocks_.assign(index(count_ - 1) + 1, far);
  const Eigen::Array3i from = low.max(0).min(last).cast<int>(), to = high.max(0).min(last).cast<int>();
  const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
  const double reach = edge_ / 2 * normal.lpNorm<1>() + margin_;
  for (int x = from[0]; x <= to[0]; ++x)
    for (int y = from[1]; y <= to[1]; ++y)
      for (int z = from[2]; z <= to[2]; ++z) {
        const Eigen::Vector3d middle = low_ + edge_ * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        if (!(std::abs(normal.dot(middle - a)) > reach)) blocks_[index({x, y, z})] = 0;
      }
}

/// The distance of two blocks is the greatest of those along the axes, so that one axis follows another.
void Clearance::spread() {
  std::size_t stride = 1;
  for (int axis = 2; axis >= 0 && !blocks_.empty(); stride *= static_cast<std::size_t>(count_[axis--])) {
    const std::vector<std::uint8_t> before = blocks_;
    for (std::size_t block = 0; block < blocks_.size(); ++block) {
      const int at = static_cast<int>(block / stride % static_cast<std::size_t>(count_[axis]));
      int nearest = before[block];
      for (int way = 1; way < nearest; ++way) {
        const std::size_t offset = static_cast<std::size_t>(way) * stride;
        if (at >= way) nearest = std::min(nearest, std::max<int>(way, before[block - offset]));
        if (at + way < count_[axis]) nearest = std::min(nearest, std::max<int>(way, before[block + offset]));
      }
      blocks_[block] = static_cast<std::uint8_t>(nearest);
    }
  }
}

}  // namespace tensorray
