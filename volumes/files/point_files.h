#pragma once
/// @file volumes/files/point_files.h
/// Points with attributes, as OpenVDB points or VTK polydata.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Points, and named values for each: scalars and vectors. All vectors have one entry a point.
struct PointCloud {
  std::vector<Eigen::Vector3f> positions;  ///< World.
  std::map<std::string, std::vector<float>> scalars;
  std::map<std::string, std::vector<Eigen::Vector3f>> vectors;
  std::map<std::string, std::string> metadata;
};

/// Writes points as the ending of `path` says: ".vdb" (an OpenVDB PointDataGrid named "points", voxels sized for about
/// eight points each) or ".vtp" (VTK polydata, a vertex a point, binary; metadata as string field data).
/// @throw std::invalid_argument on another ending; std::runtime_error naming the file and the reason (also when the
/// disk is full). The file is written in place.
void write_points(const std::filesystem::path& path, const PointCloud& points);

}  // namespace tensorray
