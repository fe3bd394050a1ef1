#pragma once
/// @file renderer/images/png_tags.h
/// Reads what a PNG says about its colours. OpenImageIO 2.4 does not pass on chromaticities and code points.

#include <filesystem>

#include "renderer/images/color_tags.h"

namespace tensorray {

/// Adds cICP, sRGB, gAMA and cHRM to `tags`. Changes nothing if the file is no PNG. Damaged chunks are left out.
void add_png_tags(const std::filesystem::path& path, ColorTags& tags);

}  // namespace tensorray
