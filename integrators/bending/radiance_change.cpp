#include "integrators/bending/radiance_change.h"

#include "volumes/bricks/tensor_sampler.h"

namespace tensorray {
namespace {

constexpr double long_piece = 1.5;  // Voxels; pieces end at this length, ...
constexpr double turn = 0.05;       // ... where light has turned by so much, radians, and where the ray ends.

}  // namespace

double log_radiance_change(const TensorField& field, const Geometry& geometry, const Track& track, double strength) {
  TensorSampler sampler(field);
  double sum = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();  // The first step of the piece.
  for (std::size_t from = 0, to = 1; to < track.size(); ++to) {
    const Eigen::Vector3d chord = track[to].position - track[from].position;
    const Eigen::Vector3d step = track[to].position - track[to - 1].position;
    if (from + 1 == to) first = step;
    const bool is_last = to + 1 == track.size();
    const bool is_short = (field.to_index().linear() * chord).squaredNorm() < long_piece * long_piece;
    if (!is_last && is_short &&
        first.cross(step).squaredNorm() <= turn * turn * first.squaredNorm() * step.squaredNorm())
      continue;
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
