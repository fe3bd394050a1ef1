#include "renderer/density/point_buckets.h"

#include <random>

#include <gtest/gtest.h>

namespace tensorray {
namespace {

TEST(PointBuckets, HoldTheirPointsInTheOrderInWhichTheyCame) {
  PointBucketing bucketing;
  bucketing.tile_bits = 3;
  bucketing.columns = 5;
  bucketing.rows = 4;
  bucketing.planes = 3;
  std::mt19937 random(3);
  std::vector<DensityPoint> points(100000);  // Several segments.
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].x = static_cast<float>(i);
    points[i].column = static_cast<std::uint16_t>(random() % 40);
    points[i].row = static_cast<std::uint16_t>(random() % 32);
    points[i].channel = static_cast<std::uint16_t>(random() % 3);
    if (i % 7 == 0) points[i].channel = DensityPoint::nowhere;
  }
  PointBuckets buckets;
  for (int round = 0; round < 2; ++round) {  // The second round reuses the result of the first.
    sort_into_buckets(points, bucketing, buckets);
    ASSERT_EQ(buckets.begin.size(), 61u);
    std::size_t seen = 0;
    for (std::uint32_t bucket = 0; bucket < 60; ++bucket)
      for (std::size_t i = buckets.begin[bucket]; i < buckets.begin[bucket + 1]; ++i, ++seen) {
        const DensityPoint& point = buckets.points[i];
        ASSERT_EQ((point.channel * 4 + point.row / 8) * 5 + point.column / 8, bucket);
        if (i > buckets.begin[bucket]) {
          ASSERT_LT(buckets.points[i - 1].x, point.x);
        }
      }
    std::size_t somewhere = 0;
    for (const DensityPoint& point : points) somewhere += point.channel != DensityPoint::nowhere;
    EXPECT_EQ(seen, somewhere);
    points.resize(1000);
  }
}

}  // namespace
}  // namespace tensorray
