#include "integrators/paths/threshold_seeds.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "renderer/sampling/random.h"
#include "volumes/bricks/tensor_sampler.h"

namespace tensorray {
namespace {

constexpr std::uint32_t block = 1u << 16;  // Candidates that are evaluated between two checks of their number.
constexpr std::uint32_t enough_to_give_up = 1u << 20;  // Stop after so many candidates if none is selected.
constexpr std::uint32_t most_candidates = 1u << 26;

Eigen::Vector3d candidate(const Eigen::AlignedBox3d& box, std::uint64_t seed, std::uint32_t i) {
  const Eigen::Vector3d u(sobol(seed, i, 0), sobol(seed, i, 1), sobol(seed, i, 2));
  return box.min() + u.cwiseProduct(box.sizes());
}

/// Values of the candidates from `first` on; NaN outside the extent.
std::vector<double> judge(const TensorField& field, const Eigen::AlignedBox3d& box, const Threshold& threshold,
                          std::uint64_t seed, std::uint32_t first) {
  std::vector<double> values(block, std::nan(""));
  tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, block, 1024), [&](const auto& range) {
    TensorSampler sampler(field);
    for (std::uint32_t i = range.begin(); i < range.end(); ++i)
      if (const Eigen::Vector3d point = candidate(box, seed, first + i); field.contains(point))
        values[i] = threshold.value(sampler.at(point));
  });
  return values;
}

[[noreturn]] void refuse(const Threshold& threshold, std::size_t found, std::uint64_t count, double smallest,
                         double largest) {
  std::ostringstream text;
  text << "only " << found << " of " << count << " seeds found where the threshold wants values from "
       << threshold.least << " to " << threshold.greatest << ": in the box ";
  if (smallest <= largest)
    text << "they are from " << smallest << " to " << largest << "; widen the threshold, or ask for fewer seeds";
  else
    text << "none is a number";
  throw std::runtime_error(text.str());
}

}  // namespace

std::vector<Eigen::Vector3d> threshold_seeds(const TensorField& field, const Eigen::AlignedBox3d& bounds,
                                             const Threshold& threshold, std::uint64_t count, std::uint64_t seed) {
  if (count == 0) throw std::invalid_argument("the count of seeds must be 1 or more");
  if (!(threshold.least <= threshold.greatest))
    throw std::invalid_argument(
        "the threshold of seeds is empty: its greatest value must not be below its least value");
  const Eigen::AlignedBox3d box = field.world_box().intersection(bounds);
  if (box.isEmpty()) throw std::invalid_argument("the box of threshold seeds does not meet the field's extent");
  std::vector<Eigen::Vector3d> seeds;
  double smallest = std::numeric_limits<double>::infinity(), largest = -smallest;
  for (std::uint32_t first = 0; first < (seeds.empty() ? enough_to_give_up : most_candidates); first += block) {
    const std::vector<double> values = judge(field, box, threshold, seed, first);
    for (std::uint32_t i = 0; i < block; ++i) {
      if (std::isnan(values[i])) continue;
      smallest = std::min(smallest, values[i]);
      largest = std::max(largest, values[i]);
      if (values[i] < threshold.least || values[i] > threshold.greatest) continue;
      seeds.push_back(candidate(box, seed, first + i));
      if (seeds.size() == count) return seeds;
    }
  }
  refuse(threshold, seeds.size(), count, smallest, largest);
}

}  // namespace tensorray
