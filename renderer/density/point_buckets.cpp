#include "renderer/density/point_buckets.h"

#include <algorithm>
#include <stdexcept>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

constexpr std::size_t shortest_segment = 1u << 14, most_segments = 64;

/// Calls `use(bucket, first, last)` for each run of consecutive points of a segment that are in the same bucket.
/// Consecutive points mostly are.
template <class Use>
void visit_runs(const std::vector<DensityPoint>& points, const PointBucketing& bucketing, std::size_t segment,
                std::size_t length, const Use& use) {
  constexpr std::uint32_t none = 0xffffffffu;
  const DensityPoint* const end = points.data() + std::min((segment + 1) * length, points.size());
  const auto bucket_of = [&](const DensityPoint& point) {
    return point.channel == DensityPoint::nowhere ? none : bucketing(point);
  };
  for (const DensityPoint* first = points.data() + segment * length; first != end;) {
    const std::uint32_t bucket = bucket_of(*first);
    const DensityPoint* last = first + 1;
    while (last != end && bucket_of(*last) == bucket) ++last;
    if (bucket != none) use(bucket, first, last);
    first = last;
  }
}

/// Turns the number of points of each segment in each bucket into the place of the first of these points.
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

/// A counting sort. Each segment of the points is counted, and later copied to its places, independently of the others.
void sort_into_buckets(const std::vector<DensityPoint>& points, const PointBucketing& bucketing,
                       PointBuckets& buckets) {
  if (points.size() > 0xffffffffu) throw std::invalid_argument("too many points to sort at once");
  const std::size_t length =
      std::max<std::size_t>(shortest_segment, (points.size() + most_segments - 1) / most_segments);
  const std::size_t segments = (points.size() + length - 1) / length, size = bucketing.count();
  std::vector<std::uint32_t> counts(segments * size);
  tbb::parallel_for(std::size_t{0}, segments, [&](std::size_t segment) {
    std::uint32_t* const count = &counts[segment * size];
    visit_runs(points, bucketing, segment, length,
               [&](std::uint32_t bucket, const DensityPoint* first, const DensityPoint* last) {
                 count[bucket] += static_cast<std::uint32_t>(last - first);
               });
  });
  buckets.begin.resize(size + 1);
  counts_to_places(counts, segments, buckets);
  buckets.points.resize(std::max<std::size_t>(buckets.points.size(), buckets.begin.back()));
  tbb::parallel_for(std::size_t{0}, segments, [&](std::size_t segment) {
    std::uint32_t* const place = &counts[segment * size];
    visit_runs(points, bucketing, segment, length,
               [&](std::uint32_t bucket, const DensityPoint* first, const DensityPoint* last) {
                 std::copy(first, last, &buckets.points[place[bucket]]);
                 place[bucket] += static_cast<std::uint32_t>(last - first);
               });
  });
}

}  // namespace tensorray
