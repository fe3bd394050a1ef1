#pragma once
/// @file tools/import/cases/plot3d_layout.h
/// Finds the layout of the numbers in a PLOT3D file. The file does not state it.

#include <cstdint>
#include <filesystem>

#include <Eigen/Core>

namespace tensorray {

struct Plot3dLayout {
  bool big_endian = false;
  bool record_marks = false;  ///< Fortran's marks: four bytes with the record's length before and after each record.
  bool block_count = false;   ///< The file begins with the number of blocks, which must be 1.
  bool blanking = false;      ///< Grid files: one integer per point follows the coordinates.
  int real_size = 4;          ///< Bytes per number: 4 (float) or 8 (double).
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  ///< Points along each axis; >= 1.
  std::uintmax_t numbers =
      0;  ///< Offset in bytes of the first number: in a grid file, of the first x; in a q file, of the first density.

  std::uintmax_t points() const {
    return static_cast<std::uintmax_t>(size.x()) * static_cast<std::uintmax_t>(size.y()) *
           static_cast<std::uintmax_t>(size.z());
  }
};

/// The layout of a grid file. Its length must be the length of the file, or shorter by less than a page of zeros
/// (some writers pad files to whole blocks). Record marks, if any, must be correct. Nothing is guessed from the
/// numbers themselves. (If a file without record marks lost exactly its blanking, it cannot be distinguished from a
/// file that had none.)
/// @throw std::runtime_error naming the file: missing, not a PLOT3D grid, cut off, two-dimensional, several blocks.
Plot3dLayout plot3d_grid_layout(const std::filesystem::path& path);

/// The layout of the q file of a grid of `size` points.
/// @throw std::runtime_error as above, and if the q file has another size.
Plot3dLayout plot3d_q_layout(const std::filesystem::path& path, const Eigen::Vector3i& size);

}  // namespace tensorray
