#include "volumes/sampling/sample_tensors.h"

#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {

void sample_tensors(const TensorField& field, const IndexPoints& points, float factor, float* components,
                    std::size_t stride) {
  TensorSampler sampler(field);
  const Eigen::Vector3d origin = (TensorBrick::cells * points.brick).cast<double>();
  for (std::size_t p = 0; p < points.count; ++p) {
    const Eigen::Vector3d from(points.position[0][p], points.position[1][p], points.position[2][p]);
    const Eigen::Matrix3f T = factor * sampler.at(field.to_world() * (origin + from)).cast<float>();
    for (std::size_t c = 0; c < 9; ++c) components[c * stride + p] = T.data()[c];
  }
}

}  // namespace tensorray
