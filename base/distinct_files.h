#pragma once
/// @file base/distinct_files.h
/// No run may overwrite one of its inputs, or write two outputs into one file.

#include <filesystem>
#include <string>
#include <vector>

namespace tensorray {

/// A file that a run reads or writes, and what to call it in an error: "`/field/file`", "--stats".
struct NamedFile {
  std::filesystem::path path;  ///< Empty: there is none.
  std::string name;
};

/// Compares files by what they are (device and inode, links followed); a file that is not there yet by its folder and
/// name. Devices and pipes may be written several times, one after the other.
/// @throw std::invalid_argument that names both, if an output is the same file as an input or as another output.
void require_distinct_files(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs);

}  // namespace tensorray
