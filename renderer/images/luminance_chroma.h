#pragma once
/// @file renderer/images/luminance_chroma.h
/// EXR pictures that are stored as luminance and two colour differences, at half of the resolution. OpenImageIO does
/// not read them.

#include <filesystem>
#include <optional>

#include "renderer/images/image.h"

namespace tensorray {

/// The picture as R, G, B, A. Nothing if the file is no such picture. @throw std::runtime_error with the reason (not
/// the file) if it is damaged.
std::optional<NativeImage> read_luminance_chroma(const std::filesystem::path& path);

}  // namespace tensorray
