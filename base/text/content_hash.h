#pragma once
/// A hash by which changed or damaged bytes are noticed. It does not withstand forgery.

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace tensorray {

/// The hash of `bytes`, which continue those of which `before` is the hash. It depends on how the bytes are divided.
std::uint64_t content_hash(std::string_view bytes, std::uint64_t before = 0);

/// The hash of a file's bytes. @throw std::runtime_error naming the file if it cannot be read.
std::uint64_t file_hash(const std::filesystem::path& file);

}  // namespace tensorray
