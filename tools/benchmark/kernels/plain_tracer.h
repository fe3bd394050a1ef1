#pragma once
/// @file tools/benchmark/kernels/plain_tracer.h
/// A plain loop that traces rays with the sampler of another library: scalar, single precision, in index space, with
/// the splitting step and the series of the exponential up to the second order.

#include <Eigen/Core>

#include "tools/benchmark/kernels/workload.h"

namespace tensorray::benchmark {

/// A ray in index space. Tensors are multiplied by `kick`, which is h·s in world units.
struct PlainRay {
  Eigen::Vector3f P, V;
  float kick;
};

/// Follows a ray to the face where it leaves `box`.
/// @param sample  Returns the Matrix3f at an index position.
/// @return the number of samples taken.
template <class Sample>
std::uint64_t follow_plainly(const Eigen::AlignedBox3f& box, const Sample& sample, PlainRay& ray) {
  constexpr auto half = static_cast<float>(step / 2);
  std::uint64_t samples = 0;
  do {
    const Eigen::Vector3f middle = ray.P + half * ray.V;
    const Eigen::Matrix3f T = ray.kick * sample(middle);
    const Eigen::Vector3f first = T * ray.V;
    ray.V = (ray.V + first + 0.5f * (T * first)).normalized();
    ray.P = middle + half * ray.V;
    ++samples;
  } while (box.contains(ray.P));
  float beyond = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float outside = std::max(box.min()[axis] - ray.P[axis], ray.P[axis] - box.max()[axis]);
    if (outside > 0) beyond = std::max(beyond, outside / std::abs(ray.V[axis]));
  }
  ray.P -= beyond * ray.V;
  return samples;
}

template <class Sample>
void trace_plainly(const TestField& test, const Sample& sample, RayBatch& batch) {
  const Eigen::AlignedBox3f box = test.field.index_bounds().cast<float>();
  const auto kick = static_cast<float>(step * test.voxel());
  for (std::size_t i = 0; i < batch.size(); ++i) {
    PlainRay ray{(test.field.to_index() * batch.position[i]).cast<float>(), batch.direction[i].cast<float>(),
                 kick * static_cast<float>(batch.flexibility[i])};
    batch.tensor_samples += follow_plainly(box, sample, ray);
    batch.position[i] = test.field.to_world() * ray.P.cast<double>();
    batch.direction[i] = ray.V.cast<double>();
  }
}

}  // namespace tensorray::benchmark
