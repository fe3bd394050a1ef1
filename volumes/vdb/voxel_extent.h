#pragma once
/// @file volumes/vdb/voxel_extent.h
/// Checks what a file claims about its voxels before anything is made for them.

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include <Eigen/Geometry>

namespace tensorray {

/// Voxels may have indices from −max_index to max_index along each axis. Then sizes, and the indices of
/// neighbours, are integers of 32 bits. 2²⁹ voxels of a micrometre are half a kilometre.
constexpr std::int32_t max_index = 1 << 29;

/// @param min, max  Indices of voxels. @throw std::runtime_error naming the file, if one of them is out of range.
void require_extent(const std::filesystem::path& path, const Eigen::Vector3i& min, const Eigen::Vector3i& max);

/// Checks that blocks fit in the memory that there is (memory_limit). A bound (--memory) is checked elsewhere.
/// @param block_bytes  Of each block, in memory. @throw std::runtime_error naming the file, with the numbers.
void require_memory(const std::filesystem::path& path, std::size_t blocks, std::size_t block_bytes);

}  // namespace tensorray
