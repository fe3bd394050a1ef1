#pragma once
/// @file renderer/coverage/polygon.h
/// Divides polygons into triangles.

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Triangles of a polygon, with the order of its corners; an index names a corner. A convex polygon becomes a fan; of
/// others, ears are cut off (Meisters 1975) as seen along the polygon's normal (Newell's). Corners that lie on a line
/// between their neighbours become corners of triangles, too, so that neighbouring polygons stay joined. A polygon that
/// crosses itself becomes as many triangles, which may overlap.
/// @param corners  At least three. @throw std::runtime_error if a concave polygon has more than 10,000 corners.
std::vector<std::array<std::uint32_t, 3>> triangulate(const std::vector<Eigen::Vector3d>& corners);

}  // namespace tensorray
