#pragma once
/// @file renderer/film/point_buckets.h
/// Sorts points into buckets, so that threads can work on different ones.

#include <cstdint>
#include <vector>

#include "renderer/film/kernel_deposit.h"

namespace tensorray {

/// Which points belong together: those of a plane (a channel, or all of them) and of a square tile of it, 2^tile_bits
/// columns and rows.
struct PointBucketing {
  int tile_bits = 0;
  std::uint32_t columns = 1, rows = 1;  ///< Of tiles, in each plane.
  std::uint32_t planes = 1;             ///< 1, or the number of channels.

  std::uint32_t tiles() const { return columns * rows; }
  std::uint32_t count() const { return tiles() * planes; }
  std::uint32_t operator()(const DensityPoint& point) const {
    const std::uint32_t column = point.column, row = point.row, plane = planes > 1 ? point.channel : 0;
    return (plane * rows + (row >> tile_bits)) * columns + (column >> tile_bits);
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
