#pragma once
/// @file tracing/bending/clearance.h
/// Tells quickly how far surfaces are at least, so that most steps need no search for them.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "base/geometry/triangle_mesh.h"

namespace tensorray {

/// Blocks that fill a region, each with its distance from the nearest block that a triangle may touch, in blocks. World
/// units. Any number of threads may ask at once.
class Clearance {
 public:
  /// @param margin  Triangles so far from a block touch it.
  Clearance(const Eigen::AlignedBox3d& region, double margin);

  /// Call `spread` after all meshes.
  void add(const TriangleMesh& mesh);
  void spread();

  /// Lower bound of the distance from a point to the triangles; 0 outside the region.
  double at(const Eigen::Vector3d& point) const {
    const Eigen::Array3d place = (point - low_).array() / edge_;
    if (!((place >= 0) && (place < count_.cast<double>())).all()) return 0;
    if (blocks_.empty()) return std::numeric_limits<double>::infinity();
    return std::max(blocks_[index(place.cast<int>())] - 1, 0) * edge_;
  }

 private:
  static constexpr std::uint8_t far = 16;  // Blocks; greater distances do not matter.

  std::size_t index(const Eigen::Array3i& block) const {
    return (static_cast<std::size_t>(block[0]) * static_cast<std::size_t>(count_[1]) +
            static_cast<std::size_t>(block[1])) *
               static_cast<std::size_t>(count_[2]) +
           static_cast<std::size_t>(block[2]);
  }
  void touch(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

  Eigen::Vector3d low_;
  double edge_ = 0, margin_ = 0;
  Eigen::Array3i count_;
  std::vector<std::uint8_t> blocks_;  ///< Empty: no triangle is in the region.
};

}  // namespace tensorray
