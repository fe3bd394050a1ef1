#include "renderer/images/picture_library.h"
#include "renderer/openimageio/picture_files.h"
#include "renderer/openimageio/tile_lookup.h"

extern "C" __attribute__((visibility("default"))) const tensorray::PictureLibrary tensorray_picture_library{
    tensorray::openimageio::set_threads, tensorray::openimageio::encode, tensorray::openimageio::decode,
    tensorray::openimageio::decode_native, tensorray::openimageio::make_lookup};
