#pragma once
/// @file renderer/openimageio/png_chunks.h
/// Checks PNG files before libpng reads them, which prints a line of its own about damaged ones.

#include <filesystem>

namespace tensorray::openimageio {

/// Does nothing where the file does not begin as a PNG. @throw std::runtime_error with the reason, without the file:
/// it is cut off, or a chunk is not the one that was written (its CRC).
void check_png(const std::filesystem::path& path);

}  // namespace tensorray::openimageio
