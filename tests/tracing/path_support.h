#pragma once
/// Paths that files must keep, and comparisons of paths.

#include <random>

#include "tests/names.h"
#include "tracing/paths/paths.h"

namespace tensorray {

/// An empty path, then paths of 2, 3, ... points with numbers that need all digits of their type.
inline std::vector<Path> some_paths(std::size_t count) {
  std::mt19937 engine(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Path> paths(1);
  for (std::size_t i = 0; i < count; ++i) {
    Path path;
    for (std::size_t j = 0; j < i + 2; ++j) {
      PathPoint point;
      const auto random = [&](Eigen::Index, Eigen::Index) { return uniform(engine); };
      point.position = Vector3d(1e4, 0, 0) + Vector3d::NullaryExpr(3, 1, random);
      point.direction = Vector3d::NullaryExpr(3, 1, random).eval().normalized();
      point.length = path.points.empty() ? 0 : path.points.back().length + 1 + uniform(engine);
      point.in_field = j > 0;
      if (point.in_field) point.tensor = Matrix3d::NullaryExpr(3, 3, random);
      if (point.in_field) point.change = Vector3d::NullaryExpr(3, 1, random);
      path.points.push_back(point);
    }
    path.flexibility = uniform(engine);
    path.wavelength = 500 + 100 * uniform(engine);
    path.end = static_cast<RayEnd>(i % ray_end_count);
    if (i % 2) path.backward_end = static_cast<RayEnd>((i + 1) % ray_end_count);
    paths.push_back(path);
  }
  return paths;
}

inline void expect_same(const PathPoints& a, const PathPoints& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const PathPoint& p = b[i];
    EXPECT_THAT(a[i], testing::FieldsAre(p.position, p.direction, p.length, p.in_field, p.tensor, p.change)) << i;
  }
}

inline void expect_same(const std::vector<Path>& a, const std::vector<Path>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    expect_same(a[i].points, b[i].points);
    const Path& path = b[i];
    EXPECT_THAT(a[i], testing::FieldsAre(testing::_, path.flexibility, path.wavelength, path.end, path.backward_end));
  }
}

inline std::vector<Path> without_empty(std::vector<Path> paths) {
  paths.erase(paths.begin());
  return paths;
}

inline std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

}  // namespace tensorray
