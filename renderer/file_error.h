#pragma once
/// @file renderer/file_error.h
/// What the readers and writers of files have in common when something is wrong.

#include <filesystem>
#include <string>

namespace tensorray {

/// Makes one line of a library's error text: line ends become "; ", and blanks at the ends go.
std::string one_line(const std::string& text);

/// Checks what libraries report badly or not at all, before they are asked to read a file.
/// @throw std::runtime_error naming the file and the reason: missing, a folder, not permitted, empty.
void require_readable(const std::filesystem::path& path);

}  // namespace tensorray
