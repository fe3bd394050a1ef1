#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "integrators/path_files/path_files.h"
#include "tracing/paths/cross_section.h"
#include "volumes/points/vtk_files.h"

namespace tensorray {
namespace {

using RowMajorMatrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Where the points of each path begin among all points; behind the last path, the number of all points.
std::vector<std::size_t> first_points(const std::vector<Path>& paths) {
  std::vector<std::size_t> firsts{0};
  for (const Path& path : paths) firsts.push_back(firsts.back() + path.points.size());
  return firsts;
}

template <class Number>
void put(double value, Number*& to) {
  *to++ = static_cast<Number>(value);
}
template <class Derived, class Number>
void put(const Eigen::PlainObjectBase<Derived>& value, Number*& to) {
  for (Eigen::Index i = 0; i < value.size(); ++i) put(value.data()[i], to);
}

template <class Number>
DataArray data_array(int components, std::vector<Number> values) {
  DataArray array;
  array.components = components;
  array.values = std::move(values);
  return array;
}

template <class Number, class Get>
DataArray per_point(const std::vector<Path>& paths, const std::vector<std::size_t>& firsts, int components,
                    const Get& get) {
  const auto width = static_cast<std::size_t>(components);
  std::vector<Number> values(width * firsts.back());
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t i) {
    Number* to = values.data() + width * firsts[i];
    for (const PathPoint& point : paths[i].points) put(get(point), to);
  });
  return data_array(components, std::move(values));
}

template <class Number, class Get>
DataArray per_path(const std::vector<Path>& paths, const Get& get) {
  std::vector<Number> values;
  for (const Path& path : paths)
    if (!path.points.empty()) values.push_back(static_cast<Number>(get(path)));
  return data_array(1, std::move(values));
}

void add_axes(const std::vector<Path>& paths, const std::vector<std::size_t>& firsts, PolylineData& data) {
  CrossSectionSettings bare;
  bare.min_radius = 1e-300;  // Becomes zero in single precision.
  std::vector<float> majors(3 * firsts.back()), minors(3 * firsts.back());
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t i) {
    float *major = majors.data() + 3 * firsts[i], *minor = minors.data() + 3 * firsts[i];
    for (const CrossSection& section : cross_sections(paths[i].points, bare)) {
      put(section.major, major);
      put(section.minor, minor);
    }
  });
  data.point_data["axis_major"] = data_array(3, std::move(majors));
  data.point_data["axis_minor"] = data_array(3, std::move(minors));
}

PolylineData data_of(const std::vector<Path>& paths) {
  PolylineData data;
  const std::vector<std::size_t> firsts = first_points(paths);
  for (const Path& path : paths) {
    for (const PathPoint& point : path.points) data.points.push_back(point.position);
    if (!path.points.empty()) data.line_ends.push_back(data.points.size());
  }
  auto& points = data.point_data;
  points["direction"] = per_point<double>(paths, firsts, 3, [](const PathPoint& point) { return point.direction; });
  points["length"] = per_point<double>(paths, firsts, 1, [](const PathPoint& point) { return point.length; });
  points["tensor"] =
      per_point<double>(paths, firsts, 9, [](const PathPoint& point) { return RowMajorMatrix(point.tensor); });
  points["change"] = per_point<double>(paths, firsts, 3, [](const PathPoint& point) { return point.change; });
  points["in_field"] =
      per_point<std::uint8_t>(paths, firsts, 1, [](const PathPoint& point) { return point.in_field ? 1 : 0; });
  points["force"] = per_point<float>(paths, firsts, 3, [](const PathPoint& point) { return point.force(); });
  points["curvature"] = per_point<float>(paths, firsts, 1, [](const PathPoint& point) { return point.change.norm(); });
  add_axes(paths, firsts, data);

  auto& lines = data.line_data;
  lines["wavelength"] = per_path<double>(paths, [](const Path& path) { return path.wavelength; });
  lines["flexibility"] = per_path<double>(paths, [](const Path& path) { return path.flexibility; });
  lines["end"] = per_path<std::int32_t>(paths, [](const Path& path) { return static_cast<int>(path.end); });
  lines["backward_end"] = per_path<std::int32_t>(
      paths, [](const Path& path) { return path.backward_end ? static_cast<int>(*path.backward_end) : -1; });
  for (int i = 0; i < ray_end_count; ++i) data.texts["end_names"].push_back(to_string(static_cast<RayEnd>(i)));
  return data;
}

/// The values of an array of the file; null if it is missing or has another number of components.
/// @throw std::runtime_error if a value is not finite.
const double* find(const std::map<std::string, DataArray>& arrays, const std::string& name, int components) {
  const auto found = arrays.find(name);
  if (found == arrays.end() || found->second.components != components) return nullptr;
  const auto& values = std::get<std::vector<double>>(found->second.values);
  if (!std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); }))
    throw std::runtime_error("the array \"" + name + "\" has a value that is not finite; remove it from the file");
  return values.data();
}

/// The arrays that hold the points of paths; null if missing.
struct PointArrays {
  const double* direction;
  const double* length;
  const double* tensor;
  const double* change;
  const double* in_field;
};

PointArrays point_arrays(const PolylineData& data) {
  return {find(data.point_data, "direction", 3), find(data.point_data, "length", 1), find(data.point_data, "tensor", 9),
          find(data.point_data, "change", 3), find(data.point_data, "in_field", 1)};
}

PathPoint path_point(const PolylineData& data, const PointArrays& arrays, std::size_t i) {
  PathPoint point;
  point.position = data.points[i];
  point.direction = Eigen::Map<const Eigen::Vector3d>(arrays.direction + 3 * i);
  point.length = arrays.length[i];
  point.tensor = Eigen::Map<const RowMajorMatrix>(arrays.tensor + 9 * i);
  point.change = Eigen::Map<const Eigen::Vector3d>(arrays.change + 3 * i);
  point.in_field = arrays.in_field[i] != 0;
  const double norm = point.direction.norm();
  if (!(norm > 0)) throw std::runtime_error("the direction of point " + std::to_string(i) + " is zero");
  // Other programs may interpolate, or use single precision. A unit vector keeps every bit.
  if (std::abs(norm - 1) > 1e-12) point.direction /= norm;
  return point;
}

PathPoints full_way(const PolylineData& data, const PointArrays& arrays, std::size_t begin, std::size_t end) {
  PathPoints way;
  way.reserve(end - begin);
  for (std::size_t i = begin; i < end; ++i) {
    way.push_back(path_point(data, arrays, i));
    way.back().length -= arrays.length[begin];
    if (i > begin && !(way[i - begin].length > way[i - begin - 1].length))
      throw std::runtime_error("the array \"length\" does not grow along a line, at point " + std::to_string(i) +
                               "; without it the bare lines are read");
  }
  if (way.size() < 2) way.clear();
  return way;
}

PathPoints way_of(const PolylineData& data, const PointArrays& arrays, std::size_t begin, std::size_t end) {
  if (arrays.direction && arrays.length && arrays.tensor && arrays.change && arrays.in_field)
    return full_way(data, arrays, begin, end);
  using Difference = std::vector<Eigen::Vector3d>::difference_type;
  const auto first = data.points.begin();
  return bare_way({first + static_cast<Difference>(begin), first + static_cast<Difference>(end)});
}

RayEnd to_ray_end(double value) {
  if (!(value >= 0 && value < ray_end_count && value == std::floor(value)))
    throw std::runtime_error("the array \"end\" or \"backward_end\" has a value that is no reason to end");
  return static_cast<RayEnd>(static_cast<int>(value));
}

}  // namespace

void write_vtp_paths(const std::filesystem::path& path, const std::vector<Path>& paths) {
  write_vtp(path, data_of(paths));
}

std::vector<Path> read_vtp_paths(const std::filesystem::path& path) {
  const PolylineData data = read_vtp_lines(path, {"direction", "length", "tensor", "change", "in_field", "wavelength",
                                                  "flexibility", "end", "backward_end"});
  for (std::size_t i = 0; i < data.points.size(); ++i)
    if (!data.points[i].allFinite())
      throw std::runtime_error("point " + std::to_string(i) + " of its lines is not finite; remove it from the file");
  const PointArrays arrays = point_arrays(data);
  const double* const wavelength = find(data.line_data, "wavelength", 1);
  const double* const flexibility = find(data.line_data, "flexibility", 1);
  const double* const end = find(data.line_data, "end", 1);
  const double* const backward_end = find(data.line_data, "backward_end", 1);
  std::vector<Path> paths;
  for (std::size_t i = 0; i < data.line_ends.size(); ++i) {
    Path line;
    line.points = way_of(data, arrays, i > 0 ? data.line_ends[i - 1] : 0, data.line_ends[i]);
    if (line.points.empty()) continue;
    if (wavelength) line.wavelength = wavelength[i];
    if (flexibility) line.flexibility = flexibility[i];
    if (end) line.end = to_ray_end(end[i]);
    if (backward_end && backward_end[i] != -1) line.backward_end = to_ray_end(backward_end[i]);
    paths.push_back(std::move(line));
  }
  return paths;
}

}  // namespace tensorray
