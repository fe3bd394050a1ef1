#include "tracing/paths/path_thinning.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "renderer/surfaces/polyline.h"
#include "tests/tracing/packet_support.h"
#include "tracing/paths/joined_ray.h"
#include "tracing/paths/path_samples.h"
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

/// The square of the error, in the tolerances' units, of each point between two others.
class Reference {
 public:
  Reference(const Traced& traced, double tolerance, double tensor_tolerance)
      : points_(all_points(traced)), tolerance_(tolerance * mean_edge), tensor_tolerance_(tensor_tolerance) {
    TensorSampler sampler(traced.field);
    for (const PathPoint& point : points_)
      tensors_.emplace_back(point.in_field ? sampler.at(point.position) : Matrix3d::Zero());
  }

  std::size_t size() const { return points_.size(); }

  double error(std::size_t i, std::size_t j, std::size_t k) const {
    const double t = (points_[k].length - points_[i].length) / (points_[j].length - points_[i].length);
    const double apart =
        (points_[i].position + t * (points_[j].position - points_[i].position) - points_[k].position).norm();
    const double unlike = (tensors_[i] + t * (tensors_[j] - tensors_[i]) - tensors_[k]).norm();
    const double greatest = std::max({tensors_[i].norm(), tensors_[j].norm(), tensors_[k].norm()});
    return std::max(apart / tolerance_, unlike / (tensor_tolerance_ * greatest));
  }

  std::vector<std::size_t> thinned() const {
    return tensorray::thinned(size(), [&](std::size_t i, std::size_t j) {
      Worst worst;
      for (std::size_t k = i + 1; k < j; ++k)
        if (const double found = error(i, j, k); found > worst.error) worst = {found, k};
      return worst;
    });
  }

 private:
  PathPoints points_;
  std::vector<Matrix3d> tensors_;
  double tolerance_, tensor_tolerance_;
};

TEST_P(PathThinning, SamplesAreThePointsOfTheRay) {
  const Traced traced = bent_ray();
  const PathPoints points = all_points(traced);
  ASSERT_GT(points.size(), 60u);
  PathSamples samples;
  sample_path(traced.field, traced.ray, true, samples);
  ASSERT_EQ(samples.count, points.size());
  TensorSampler sampler(traced.field);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto at = [&](const std::vector<float>& values, std::size_t component) {
      return double{values[component * samples.room + i]};
    };
    const auto moved = [&](std::size_t k) -> Vector3d {
      return Vector3d(at(samples.positions, 0), at(samples.positions, 1), at(samples.positions, 2)) -
             Vector3d(samples.positions[k], samples.positions[samples.room + k],
                      samples.positions[2 * samples.room + k]);
    };
    EXPECT_LT((mean_edge * moved(0) - (points[i].position - points[0].position)).norm(), 1e-5 * mean_edge);
    EXPECT_NEAR(at(samples.lengths, 0) + at(samples.more, 0), points[i].length - points[0].length, 1e-9);
    const Matrix3d T = sampler.at(points[i].position) / traced.field.max_norm();
    for (std::size_t c = 0; c < 9; ++c) {
      EXPECT_NEAR(at(samples.tensors, c), points[i].in_field ? T.data()[c] : 0, 1e-5);
    }
  }
}

TEST_P(PathThinning, ChoosesThePointsThatDoublePrecisionChooses) {
  int all = 0, alike = 0;
  for (const double flexibility : {0.05, 0.1, 0.2, 0.4, 0.8}) {
    const Traced traced = bent_ray(flexibility);
    const Reference reference(traced, 0.05, 0.02);
    PathSamples samples;
    sample_path(traced.field, traced.ray, true, samples);
    const std::vector<std::size_t> chosen = thinned(samples, 0.05, 0.02), expected = reference.thinned();
    EXPECT_LT(chosen.size(), reference.size() / 2);
    for (std::size_t n = 1; n < chosen.size(); ++n)
      for (std::size_t k = chosen[n - 1] + 1; k < chosen[n]; ++k)
        EXPECT_LT(reference.error(chosen[n - 1], chosen[n], k), 1.001);
    all += static_cast<int>(expected.size());
    for (const std::size_t k : chosen) alike += std::binary_search(expected.begin(), expected.end(), k) ? 1 : 0;
  }
  EXPECT_GT(alike, 0.95 * all) << "only equal errors may be taken in another order";
}

TEST_P(PathThinning, KeepsAllPointsIfNoErrorIsAllowed) {
  const Traced traced = bent_ray();
  PathSamples samples;
  sample_path(traced.field, traced.ray, true, samples);
  EXPECT_GT(thinned(samples, 0, 0.02).size(), samples.count - 3);
  EXPECT_GT(thinned(samples, 0.05, 0).size(), samples.count - 3);
  sample_path(traced.field, traced.ray, false, samples);
  EXPECT_TRUE(samples.tensors.empty());
  EXPECT_GT(thinned(samples, 0, 0).size(), samples.count - 3);
  EXPECT_EQ(thinned(samples, 1e6, 0).size(), 2u);
}

}  // namespace
}  // namespace tensorray
