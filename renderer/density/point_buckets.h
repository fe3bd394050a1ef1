#pragma once
/// @file renderer/density/point_buckets.h
/// Sorts points into buckets, so that each thread can work on a different bucket.

#include <cstdint>
#include <vector>

#include "renderer/density/kernel_deposit.h"

namespace tensorray {

/// Defines the buckets: a bucket has the points of one plane (a channel, or all channels) and of one square tile of it,
/// with 2^tile_bits columns and rows.
struct PointBucketing {
  int tile_bits = 0;
  std::uint32_t columns = 1, rows = 1;  ///< Number of columns and rows of tiles in each plane.
  std::uint32_t planes = 1;             ///< 1, or the number of channels.

  std::uint32_t tiles() const { return columns * rows; }
  std::uint32_t count() const { return tiles() * planes; }
  std::uint32_t operator()(const DensityPoint& point) const {
    const std::uint32_t column = point.column, row = point.row, plane = planes > 1 ? point.channel : 0;
    return (plane * rows + (row >> tile_bits)) * columns + (column >> tile_bits);
  }
};

/// Points in the order of their buckets. Within a bucket they keep their original order.
struct PointBuckets {
  std::vector<DensityPoint> points;
  std::vector<std::uint32_t> begin;  ///< Index of the first point of each bucket, and the end of the last bucket.
};

/// Sorts all points except unused ones; at most 2^32. Runs on all threads.
/// @param buckets  Is overwritten; its memory is reused.
void sort_into_buckets(const std::vector<DensityPoint>& points, const PointBucketing& bucketing, PointBuckets& buckets);

}  // namespace tensorray
