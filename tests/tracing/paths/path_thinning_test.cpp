#include "tracing/paths/path_thinning.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tracing/packet_support.h"
#include "tracing/trace/trace.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;

class PathThinning : public EveryInstructionSet {};
INSTANTIATE_TEST_SUITE_P(All, PathThinning, instruction_sets(), instruction_set_name);

/// A ray that was traced from a seed within the field, in both directions.
struct Traced {
  TensorField field;
  std::vector<RayRecord> back, on;
  JoinedRay ray;
};

Traced trace_both(const TensorField& field, const Vector3d& index, double flexibility) {
  Traced traced{field, {}, {}, {}};
  const Geometry geometry(surfaces_of(field));
  for (const double sign : {1.0, -1.0}) {
    RayBatch batch;
    batch.add(field.to_world() * index, sign * Vector3d(0.3, -0.2, 1).normalized(), sign * flexibility);
    const BendingSettings settings = settings_of(BendingMethod::splitting4, 0.5);  // In packets, with many points.
    trace(field, geometry, settings, batch, sign > 0 ? &traced.on : &traced.back);
  }
  join(field, traced.back[0], traced.on[0], traced.ray);
  return traced;
}

Traced bent_ray(double flexibility = 0.2) {
  const TensorFunction smooth = smooth_tensor(3);
  const auto strong = [&](const Vector3d& p) { return Matrix3d(smooth(p) + 0.2 * Matrix3d::Identity()); };
  return trace_both(lattice_field(odd_box(), lattices()[2], strong), {3, 20, 5}, flexibility);
}

/// All points of a ray, in double precision.
PathPoints all_points(const Traced& traced) {
  PathPoints points;
  for (const JoinedPoint& joined : traced.ray.points) {
    points.push_back(joined.point);
    for (std::size_t i = 0; i < joined.steps.count; ++i)
      points.push_back(path_point(traced.field, traced.ray, joined.steps, i));
  }
  return points;
}

/// The error of each point between two that stay, in the tolerances' units, in double precision.
TEST_P(PathThinning, KeepsItsTolerances) {
  for (const double flexibility : {0.05, 0.2, 0.8}) {
    const Traced traced = bent_ray(flexibility);
    const PathPoints points = all_points(traced);
    PathSamples samples;
    sample_path(traced.field, traced.ray, true, samples);
    const std::vector<std::size_t> chosen = thinned(samples, 0.05, 0.02);
    EXPECT_LT(chosen.size(), points.size() / 2);
    TensorSampler sampler(traced.field);
    const auto tensor = [&](const PathPoint& p) {
      return p.in_field ? Matrix3d(sampler.at(p.position)) : Matrix3d::Zero();
    };
    for (std::size_t n = 1; n < chosen.size(); ++n)
      for (std::size_t k = chosen[n - 1] + 1; k < chosen[n]; ++k) {
        const PathPoint &a = points[chosen[n - 1]], &b = points[chosen[n]], &p = points[k];
        const double t = (p.length - a.length) / (b.length - a.length);
        const Matrix3d from = tensor(a), to = tensor(b), here = tensor(p);
        EXPECT_LT((a.position + t * (b.position - a.position) - p.position).norm(), 1.001 * 0.05 * mean_edge);
        EXPECT_LT((from + t * (to - from) - here).norm(),
                  1.001 * 0.02 * std::max({from.norm(), to.norm(), here.norm()}));
      }
  }
}

}  // namespace
}  // namespace tensorray
