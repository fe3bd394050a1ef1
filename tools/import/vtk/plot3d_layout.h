#pragma once
/// @file tools/import/vtk/plot3d_layout.h
/// How the numbers lie in a PLOT3D file, which the file itself does not say.

#include <cstdint>
#include <filesystem>

#include <Eigen/Core>

namespace tensorray {

struct Plot3dLayout {
  bool big_endian = false;
  bool record_marks = false;  ///< Fortran's: each record has its length before and after it, four bytes each.
  bool block_count = false;   ///< The file begins with the number of blocks, which is 1.
  bool blanking = false;      ///< Grid: an integer for each point follows the coordinates.
  int real_size = 4;          ///< 4 (float) or 8 (double).
  Eigen::Vector3i size = Eigen::Vector3i::Zero();  ///< Points along each axis; >= 1.
  std::uintmax_t numbers = 0;  ///< Grid: offset in bytes of x of the first point. q: of its first density.

  std::uintmax_t points() const {
    return static_cast<std::uintmax_t>(size.x()) * static_cast<std::uintmax_t>(size.y()) *
           static_cast<std::uintmax_t>(size.z());
  }
};

/// The layout of a grid file: the one whose length is the file's, or falls short of it by less than a page of zeros
/// (writers fill up blocks); the record marks, if any, must be right. Nothing is guessed from the numbers themselves.
/// (A file without record marks that lost exactly its blanking cannot be told from one that had none.)
/// @throw std::runtime_error naming the file: missing, no PLOT3D grid, cut off, two-dimensional, of several blocks.
Plot3dLayout plot3d_grid_layout(const std::filesystem::path& path);

/// The same for the q file of a grid of `size` points.
/// @throw std::runtime_error; also if the q file is of another size.
Plot3dLayout plot3d_q_layout(const std::filesystem::path& path, const Eigen::Vector3i& size);

}  // namespace tensorray
