#pragma once
/// Errors are exceptions whose text is one line: what is wrong, where, and the fix. std::invalid_argument means that
/// the user's input is wrong (exit status 2); every other exception means that the work failed (exit status 1).

#include <filesystem>
#include <string>

namespace tensorray {

/// @throw std::invalid_argument with `message` unless `condition` holds.
void require(bool condition, const char* message);
void require(bool condition, const std::string& message);

/// @throw std::runtime_error "PATH: WHAT".
[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what);

/// Checks a file before a library reads it, because libraries report these errors badly or not at all.
/// @throw std::runtime_error naming the file and the reason: missing, a folder, not permitted, empty.
void require_readable(const std::filesystem::path& path);

/// Checks a path that a file names, or that is in a folder with files: to open a pipe or a device waits, or never ends.
/// @throw std::runtime_error naming the path if it is there, and is neither a file nor a folder.
void require_no_device(const std::filesystem::path& path);

}  // namespace tensorray
