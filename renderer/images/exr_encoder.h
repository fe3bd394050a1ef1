#pragma once
/// @file renderer/images/exr_encoder.h
/// Encodes EXR files with OpenEXR, because most renders write one, and OpenImageIO, which would use OpenEXR too, takes
/// longer to load than a small render takes (image_plugin.h).

#include <vector>

#include "renderer/images/image.h"

namespace tensorray {

/// An EXR of rows with all channels as 32-bit floats, ZIP-compressed. The file has the channels in alphabetical order.
/// Any number of threads may call it at once, with the same `threads`.
/// @param image     At least one pixel and one channel; any values. Names of channels that are empty, or equal in their
///                  first 255 characters (the format's limit), become "channel" and the channel's number.
/// @param metadata  All becomes text, with ImageDescription as `comments` and Copyright as `owner`; names that mean
///                  something else in the format (`channels` ...) are left out, and so is `oiio:ColorSpace`.
/// @param threads   How many compress at once; 0: all. They are OpenEXR's own, of which a process has one pool.
/// @throw std::runtime_error with one line if the picture is too large for the format or the memory.
std::vector<unsigned char> encode_exr(const Image& image, const ImageMetadata& metadata, int threads);

}  // namespace tensorray
