#include "tools/import/lattices/component_frame.h"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace tensorray {

const std::vector<std::pair<std::string, ComponentFrame>>& component_frames() {
  static const std::vector<std::pair<std::string, ComponentFrame>> frames = {{"ras", ComponentFrame::ras},
                                                                             {"lps", ComponentFrame::lps},
                                                                             {"voxels", ComponentFrame::voxels},
                                                                             {"fsl", ComponentFrame::fsl}};
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

}  // namespace tensorray
