#include "renderer/point_buckets.h"

#include <algorithm>
#include <stdexcept>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

constexpr std::size_t shortest_segment = 1u << 14, most_segments = 64;

/// Calls `use(point)` for those of a segment's points that are somewhere.
template <class Use>
void visit_segment(const std::vector<DensityPoint>& points, std::size_t segment, std::size_t length, const Use& use) {
  const std::size_t last = std::min((segment + 1) * length, points.size());
  for (std::size_t i = segment * length; i < last; ++i)
    if (points[i].channel != DensityPoint::nowhere) use(points[i]);
}

/// From each segment's numbers of points in each bucket to where it puts its first one.
void counts_to_places(std::vector<std::uint32_t>& counts, std::size_t segments, PointBuckets& buckets) {
  const std::size_t size = buckets.begin.size() - 1;
  std::uint32_t place = 0;
  for (std::size_t bucket = 0; bucket < size; ++bucket) {
    buckets.begin[bucket] = place;
    for (std::size_t segment = 0; segment < segments; ++segment) {
      std::uint32_t& entry = counts[segment * size + bucket];
      const std::uint32_t count = entry;
      entry = place;
      place += count;
    }
  }
  buckets.begin[size] = place;
}

}  // namespace

/// A counting sort: each segment of the points is counted, and then put in its places, by itself.
void sort_into_buckets(const std::vector<DensityPoint>& points, const PointBucketing& bucketing,
                       PointBuckets& buckets) {
  if (points.size() > 0xffffffffu) throw std::invalid_argument("too many points to sort at once");
  const std::size_t length =
      std::max<std::size_t>(shortest_segment, (points.size() + most_segments - 1) / most_segments);
  const std::size_t segments = (points.size() + length - 1) / length, size = bucketing.count();
  std::vector<std::uint32_t> counts(segments * size);
  tbb::parallel_for(std::size_t{0}, segments, [&](std::size_t segment) {
    std::uint32_t* const count = &counts[segment * size];
    visit_segment(points, segment, length, [&](const DensityPoint& point) { ++count[bucketing(point)]; });
  });
  buckets.begin.resize(size + 1);
  counts_to_places(counts, segments, buckets);
  buckets.points.resize(std::max<std::size_t>(buckets.points.size(), buckets.begin.back()));
  tbb::parallel_for(std::size_t{0}, segments, [&](std::size_t segment) {
    std::uint32_t* const place = &counts[segment * size];
    visit_segment(points, segment, length,
                  [&](const DensityPoint& point) { buckets.points[place[bucketing(point)]++] = point; });
  });
}

}  // namespace tensorray
