#pragma once
/// @file renderer/openimageio/tile_lookup.h
/// Look-ups by OpenImageIO's TextureSystem; see TileLookup.

#include <memory>

#include "renderer/images/image_plugin.h"

namespace tensorray::openimageio {

std::unique_ptr<TileLookup> make_lookup(const TileSource& source, Wrap wrap);

}  // namespace tensorray::openimageio
