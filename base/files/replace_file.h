#pragma once
/// @file base/files/replace_file.h
/// Replaces a file so that its old bytes are safe until the new ones are.

#include <filesystem>
#include <string_view>
#include <vector>

namespace tensorray {

/// Writes `pieces`, one after the other, to a file beside it, waits until they are on the disk, and gives them the name
/// `file`. Whenever the process or the machine stops, `file` is complete: as it was, or as it becomes. The file beside
/// it, `.tensorray-HASH.new` with a hash of the name, is always the same, so that processes that were killed leave no
/// more than one; it is not one that a user names. An OutputFile, in contrast, lets two processes write the same target
/// at once, and follows links.
/// @throw std::runtime_error naming the file, for example because the disk is full. The old file is then unchanged.
void replace_file(const std::filesystem::path& file, const std::vector<std::string_view>& pieces);

}  // namespace tensorray
