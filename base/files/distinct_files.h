#pragma once
/// @file base/files/distinct_files.h
/// Checks that a run does not overwrite one of its inputs, or write two outputs into one file.

#include <filesystem>
#include <string>
#include <vector>

namespace tensorray {

/// A file that a run reads or writes.
struct NamedFile {
  std::filesystem::path path;  ///< Empty: no file.
  std::string name;            ///< How an error names the file: "`/field/file`", "--stats".
};

/// Whether a path leads to what is neither a file nor a folder: a pipe, a device or a socket. Opening it may never end.
bool is_device(const std::filesystem::path& path);

/// Compares files by device and inode, after following links. A file that does not exist yet is compared by its folder
/// and name. Several outputs may go to the same device or pipe, one after the other.
/// @throw std::invalid_argument that names both files, if an output is the same file as an input or another output; or
/// if an input is a device.
void require_distinct_files(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs);

}  // namespace tensorray
