#pragma once
/// @file renderer/images/png_chunks.h
/// What a PNG says about its colours, and whether its chunks are those that were written. OpenImageIO 2.4 does not pass
/// on chromaticities and code points, and libpng prints a line of its own about damaged files.

#include <filesystem>
#include <optional>

#include "renderer/images/color_tags.h"

namespace tensorray {

/// cICP, sRGB, gAMA and cHRM, without those that are damaged; nothing if the file is no PNG.
/// @throw std::runtime_error with the reason, without the file: it is cut off, or a chunk that pictures need has
/// another CRC.
std::optional<ColorTags> read_png_chunks(const std::filesystem::path& path);

}  // namespace tensorray
