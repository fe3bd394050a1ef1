#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>
#include <stdexcept>

#include <tbb/parallel_for.h>

#include "integrators/seeds/seeds.h"
#include "renderer/sampling/random.h"
#include "volumes/bricks/brick_point.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

constexpr std::uint32_t block = 1u << 16;  // Candidates that are evaluated between two checks of their number.
constexpr std::uint32_t enough_to_give_up = 1u << 20;  // Stop after so many candidates if none is selected.
constexpr std::uint32_t max_candidates = 1u << 26;

/// The sequence of points among which seeds are selected.
struct CandidateSequence {
  Eigen::AlignedBox3d box;
  std::uint64_t seed;

  Eigen::Vector3d at(std::uint32_t i) const {
    const Eigen::Vector3d u(sobol(seed, i, 0), sobol(seed, i, 1), sobol(seed, i, 2));
    return box.min() + u.cwiseProduct(box.sizes());
  }
};

/// Candidates that are sampled together.
struct Candidates {
  static constexpr std::uint32_t count = 1024;
  float places[3][sampled_room(count)];
  float tensors[9][sampled_room(count)];
  bool inside[count];
};

/// Sets the values of the candidates from `first` on; NaN outside the extent.
void judge_some(const TensorField& field, const Threshold& threshold, const CandidateSequence& sequence,
                std::uint32_t first, Candidates& candidates, double* values) {
  const BrickPoint corner = brick_point(field, field.voxels().min());
  const Eigen::Vector3i first_brick(corner.brick[0], corner.brick[1], corner.brick[2]);
  const Eigen::Vector3d origin = index_position({corner.brick, {}});
  for (std::uint32_t i = 0; i < Candidates::count; ++i) {
    const Eigen::Vector3d index = field.to_index() * sequence.at(first + i);
    candidates.inside[i] = field.index_bounds().contains(index);
    for (int axis = 0; axis < 3; ++axis) candidates.places[axis][i] = static_cast<float>(index[axis] - origin[axis]);
  }
  const IndexPoints points{
      first_brick, {candidates.places[0], candidates.places[1], candidates.places[2]}, Candidates::count};
  sample_tensors(field, points, 1, candidates.tensors[0], sampled_room(Candidates::count));
  for (std::uint32_t i = 0; i < Candidates::count; ++i) {
    if (!candidates.inside[i]) continue;
    Eigen::Matrix3d tensor;
    for (int component = 0; component < 9; ++component)
      tensor.data()[component] = double{candidates.tensors[component][i]};
    values[i] = invariant(threshold.invariant, tensor);
  }
}

/// Values of the candidates from `first` on; NaN outside the extent.
std::vector<double> judge(const TensorField& field, const Threshold& threshold, const CandidateSequence& sequence,
                          std::uint32_t first) {
  std::vector<double> values(block, std::nan(""));
  tbb::parallel_for(0u, block / Candidates::count, [&](std::uint32_t i) {
    const auto candidates = std::make_unique<Candidates>();
    const std::uint32_t begin = i * Candidates::count;
    judge_some(field, threshold, sequence, first + begin, *candidates, &values[begin]);
  });
  return values;
}

[[noreturn]] void refuse(const Threshold& threshold, std::size_t found, std::uint64_t count, double smallest,
                         double largest) {
  std::ostringstream text;
  text << "only " << found << " of " << count << " seeds found where the threshold wants values from " << threshold.min
       << " to " << threshold.max << ": in the box they are from " << smallest << " to " << largest
       << "; widen the threshold, or ask for fewer seeds";
  throw std::invalid_argument(text.str());
}

}  // namespace

std::vector<Eigen::Vector3d> threshold_seeds(const TensorField& field, const Threshold& threshold, std::uint64_t count,
                                             std::uint64_t seed) {
  if (count == 0) throw std::invalid_argument("the count of seeds must be 1 or more");
  if (!(threshold.min <= threshold.max))
    throw std::invalid_argument("the threshold of seeds is empty: its max must not be below its min");
  const CandidateSequence sequence{field.world_box(), seed};
  std::vector<Eigen::Vector3d> seeds;
  double smallest = std::numeric_limits<double>::infinity(), largest = -smallest;
  for (std::uint32_t first = 0; first < (seeds.empty() ? enough_to_give_up : max_candidates); first += block) {
    const std::vector<double> values = judge(field, threshold, sequence, first);
    for (std::uint32_t i = 0; i < block; ++i) {
      if (std::isnan(values[i])) continue;
      smallest = std::min(smallest, values[i]);
      largest = std::max(largest, values[i]);
      if (values[i] < threshold.min || values[i] > threshold.max) continue;
      seeds.push_back(sequence.at(first + i));
      if (seeds.size() == count) return seeds;
    }
  }
  refuse(threshold, seeds.size(), count, smallest, largest);
}

}  // namespace tensorray
