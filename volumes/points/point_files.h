#pragma once
/// Points with attributes, as OpenVDB points or VTK polydata.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Points, and named values for each: scalars and vectors. All vectors have one entry per point.
struct PointCloud {
  std::vector<Eigen::Vector3f> positions;  ///< World positions.
  std::map<std::string, std::vector<float>> scalars;
  std::map<std::string, std::vector<Eigen::Vector3f>> vectors;
  std::map<std::string, std::string> metadata;
};

/// Writes points in the format that the ending of `path` names: ".vdb" (an OpenVDB PointDataGrid named "points"; its
/// voxels hold about eight points each) or ".vtp" (binary VTK polydata with one vertex per point; metadata as string
/// field data). Writes the file in place.
/// @throw std::invalid_argument on another ending; std::runtime_error naming the file and the reason (also when the
/// disk is full).
void write_points(const std::filesystem::path& path, const PointCloud& points);

}  // namespace tensorray
