#pragma once
/// @file renderer/openimageio/picture_files.h
/// Pictures in the formats of files; see ImagePlugin.

#include <filesystem>
#include <string>
#include <vector>

#include "renderer/images/image_plugin.h"

namespace tensorray::openimageio {

void set_threads(int threads);
std::vector<unsigned char> encode(const Image& image, const PictureFormat& format, const ImageMetadata& metadata);
Image decode(const std::filesystem::path& path);
NativeImage decode_native(const std::filesystem::path& path, const std::string& layer);

}  // namespace tensorray::openimageio
