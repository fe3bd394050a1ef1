#pragma once
/// @file integrators/path_files/path_formats.h
/// Readers and writers of the formats of path_files.h.

#include <filesystem>
#include <vector>

#include "tracing/paths/paths.h"

namespace tensorray {

/// Write the file. @throw std::runtime_error naming the file and the reason.
void write_vtp_paths(const std::filesystem::path& path, const std::vector<Path>& paths);
void write_tck_paths(const std::filesystem::path& path, const std::vector<Path>& paths);

/// Read the file. @throw std::runtime_error with the reason (without the file's name).
std::vector<Path> read_vtp_paths(const std::filesystem::path& path);
std::vector<Path> read_tck_paths(const std::filesystem::path& path);

}  // namespace tensorray
