#include "renderer/images/image_plugin.h"
#include "renderer/openimageio/picture_files.h"

extern "C" __attribute__((visibility("default"))) const tensorray::ImagePlugin tensorray_image_plugin{
    tensorray::openimageio::set_threads, tensorray::openimageio::encode, tensorray::openimageio::decode,
    tensorray::openimageio::decode_native};
