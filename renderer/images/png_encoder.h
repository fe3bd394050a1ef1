#pragma once
/// @file renderer/images/png_encoder.h
/// Encodes PNG files with libpng, because most renders write one picture, and OpenImageIO, which would use libpng too,
/// takes longer to load than a small render takes (image_plugin.h).

#include <vector>

#include "renderer/images/image.h"

namespace tensorray {

/// A PNG of 16 bits, marked as sRGB unless the metadata `oiio:ColorSpace` says otherwise.
/// @param image     One channel (grey), three (RGB) or four (RGBA, colours not multiplied by alpha); values in [0, 1].
/// @param metadata  All becomes text; names longer than 79 characters are left out: the format has no place for them.
/// @throw std::runtime_error if the picture is too large for the format.
std::vector<unsigned char> encode_png(const Image& image, const ImageMetadata& metadata);

}  // namespace tensorray
