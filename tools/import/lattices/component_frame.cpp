#include "tools/import/lattices/component_frame.h"

#include <algorithm>
#include <stdexcept>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tensorray {
namespace {

Eigen::Matrix3d voxel_axes(const Eigen::Matrix3d& to_ras) {
  const Eigen::Matrix3d directions = to_ras.colwise().normalized();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(directions, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace

const std::vector<std::string>& component_frame_names() {
  static const std::vector<std::string> names = {"ras", "lps", "voxels", "fsl"};  // in the order of ComponentFrame
  return names;
}

ComponentFrame component_frame_of(const std::string& name) {
  const auto& names = component_frame_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw std::invalid_argument(
        fmt::format("--frame: unknown frame \"{}\"; there are {}", name, fmt::join(names, ", ")));
  return static_cast<ComponentFrame>(found - names.begin());
}

Eigen::Matrix3d axes_of(ComponentFrame frame, const Eigen::Matrix3d& to_ras) {
  if (frame == ComponentFrame::ras) return Eigen::Matrix3d::Identity();
  if (frame == ComponentFrame::lps) return Eigen::Vector3d(-1, -1, 1).asDiagonal();
  Eigen::Matrix3d axes = voxel_axes(to_ras);
  if (frame == ComponentFrame::fsl && to_ras.determinant() > 0) axes.col(0) *= -1;
  return axes;
}

}  // namespace tensorray
