#include "integrators/bending/radiance_change.h"

#include "volumes/bricks/tensor_sampler.h"

namespace tensorray {
namespace {

constexpr double piece = 1;  // Least length of a piece, voxels, unless the ray ends.

}  // namespace

double log_radiance_change(const TensorField& field, const Geometry& geometry, const Track& track,
                           double strength) {
  TensorSampler sampler(field);
  double sum = 0;
  for (std::size_t from = 0, to = 1; to < track.size(); ++to) {
    const Eigen::Vector3d chord = track[to].position - track[from].position;
    const bool is_last = to + 1 == track.size();
    if (!is_last && (field.to_index().linear() * chord).squaredNorm() < piece * piece) continue;
    const Eigen::Vector3d middle = track[from].position + chord / 2;
    const double length = track[to].length - track[from].length, squared = chord.squaredNorm();
    from = to;
    if (!(squared > 0) || !field.contains(middle) || !geometry.inside_cut(middle)) continue;
    const Eigen::Matrix3d T = sampler.at(middle);
    sum += length * (T.trace() - 3 * chord.dot(T * chord) / squared);
  }
  return strength * sum;
}

}  // namespace tensorray
