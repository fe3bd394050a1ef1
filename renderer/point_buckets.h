#pragma once
/// @file renderer/point_buckets.h
/// Sorts points into buckets, so that threads can work on different ones.

#include <cstdint>
#include <vector>

#include "renderer/kernel_deposit.h"

namespace tensorray {

/// Which points belong together: those of a plane (a channel, or all of them) and of a band of 2^row_bits rows.
struct PointBucketing {
  bool by_channel = false;
  int row_bits = 0;
  std::uint32_t bands = 1;   ///< Of each plane.
  std::uint32_t planes = 1;  ///< 1 unless by channel.

  std::uint32_t count() const { return bands * planes; }
  std::uint32_t operator()(const DensityPoint& point) const {
    return (by_channel ? point.channel * bands : 0) + (static_cast<std::uint32_t>(point.row) >> row_bits);
  }
};

/// Points in order of their buckets, within a bucket in the order in which they came.
struct PointBuckets {
  std::vector<DensityPoint> points;
  std::vector<std::uint32_t> begin;  ///< Where each bucket begins; one more for the end of the last.
};

/// Sorts the points that are somewhere; at most 2^32. Runs on all threads.
/// @param buckets  Is overwritten; its memory is used again.
void sort_into_buckets(const std::vector<DensityPoint>& points, const PointBucketing& bucketing, PointBuckets& buckets);

}  // namespace tensorray
