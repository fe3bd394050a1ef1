#include "renderer/images/image.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include <dlfcn.h>
#include <fcntl.h>

#include "base/errors.h"
#include "base/files/descriptor.h"
#include "base/text/text.h"
#include "renderer/images/formats.h"

namespace tensorray {
namespace {

PictureFormat find_format(const std::filesystem::path& path) {
  const std::string ending = lower_case_ending(path);
  if (ending == ".exr") return {"openexr", SampleType::float32, true};
  if (ending == ".png") return {"png", SampleType::uint16, true};
  if (ending == ".jpg" || ending == ".jpeg") return {"jpeg", SampleType::uint8, false};
  if (ending == ".tif" || ending == ".tiff") return {"tiff", SampleType::uint16, true};
  throw std::runtime_error("unknown picture ending \"" + ending + "\"; known: " + joined(image_endings()));
}

bool is_exr(const PictureFormat& format) { return format.name == "openexr"; }
bool is_png(const PictureFormat& format) { return format.name == "png"; }

void check_size(const Image& image) {
  if (image.width < 1 || image.height < 1 || image.channels.empty())
    throw std::invalid_argument("a picture must have pixels and channels");
  if (image.pixels.size() != static_cast<std::size_t>(image.width) * image.height * image.channels.size())
    throw std::invalid_argument("a picture's number of values must be width * height * channels");
}

/// The channels that a display-referred format stores, clipped to [0, 1].
Image clipped(const Image& image, bool alpha) {
  const std::size_t from = image.channels.size();
  const std::size_t to = from < 3 ? 1 : (alpha && from > 3 && image.channels[3] == "A") ? 4 : 3;
  Image result(image.width, image.height, {image.channels.begin(), image.channels.begin() + to});
  for (std::size_t pixel = 0; pixel * to < result.pixels.size(); ++pixel)
    for (std::size_t c = 0; c < to; ++c) {
      const float value = image.pixels[pixel * from + c];
      result.pixels[pixel * to + c] = value > 0 ? std::min(value, 1.0f) : 0.0f;  // NaN becomes 0.
    }
  return result;
}

/// Also checks the result of closing the file: a full disk may be reported only then.
void write_bytes(const std::filesystem::path& path, const std::vector<unsigned char>& bytes) {
  Descriptor file = open_file(path, O_WRONLY | O_CREAT | O_TRUNC);
  const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!file.is_open() || !write_whole(file.get(), all) || !file.close())
    throw std::runtime_error(std::generic_category().message(errno));
}

/// Whether the end of a JPEG is missing. libjpeg fills the missing part with grey without an error.
bool is_cut_off_jpeg(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(2, '\0');
  file.read(&bytes[0], 2);
  if (bytes != "\xFF\xD8") return false;
  bytes.resize(std::filesystem::file_size(path));
  file.seekg(0).read(&bytes[0], static_cast<std::streamsize>(bytes.size()));
  // In the compressed data 0xFF is always followed by 0 or a restart marker. Therefore the first end marker after the
  // start of the last scan belongs to the picture itself, not to an embedded one.
  const std::size_t scan = bytes.rfind("\xFF\xDA");
  return scan == std::string::npos || bytes.find("\xFF\xD9", scan) == std::string::npos;
}

/// The run path of the program, which `dlopen` searches, is its own folder (CMAKE_BUILD_RPATH).
const ImagePlugin& load_plugin() {
  constexpr const char* file = "libtensorray_pictures.so";
#ifdef TENSORRAY_LOADED_FIRST
  dlopen(TENSORRAY_LOADED_FIRST, RTLD_LAZY | RTLD_LOCAL);  // For speed (CMakeLists.txt); without it all works, too.
#endif
  void* const library = dlopen(file, RTLD_LAZY | RTLD_LOCAL);
  void* const functions = library ? dlsym(library, "tensorray_image_plugin") : nullptr;
  if (!functions)
    throw std::runtime_error(std::string("cannot load ") + file + ", which must be beside the program: " + dlerror());
  return *static_cast<const ImagePlugin*>(functions);
}

/// The library, loaded at the first call. @throw std::runtime_error if it cannot be loaded.
const ImagePlugin& image_plugin() {
  static const ImagePlugin& library = load_plugin();
  return library;
}

int image_threads = 0;  ///< 0: all.

/// The library, with its number of threads. Several threads may write pictures at once, but OpenImageIO's threads must
/// not be changed by two of them, nor while one works.
const ImagePlugin& ready_library() {
  const ImagePlugin& library = image_plugin();
  static std::mutex mutex;
  static int threads = -1;
  const std::lock_guard<std::mutex> lock(mutex);
  if (threads != image_threads) library.set_threads(image_threads);
  threads = image_threads;
  return library;
}

std::vector<unsigned char> encode(const Image& image, const PictureFormat& format, const ImageMetadata& metadata) {
  if (is_exr(format)) return encode_exr(image, metadata, image_threads);
  const Image shown = clipped(image, format.alpha);
  return is_png(format) ? encode_png(shown, metadata) : ready_library().encode(shown, format, metadata);
}

/// Reads a file with `decode`, which gets the tags of a PNG; errors name the file.
template <class Decode>
auto read(const std::filesystem::path& path, const Decode& decode) {
  require_readable(path);
  try {
    if (is_cut_off_jpeg(path)) throw std::runtime_error("the file is cut off");
    return decode(read_png_chunks(path));
  } catch (const std::bad_alloc&) {
    throw std::runtime_error("cannot read " + path.string() + ": not enough memory for a picture of its size");
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read " + path.string() + ": " + error.what());
  }
}

/// @param full  The stored value that means 1.
template <class Sample>
void unpack(const NativeImage& image, std::size_t first_pixel, int count, float full, float* rgba) {
  const Sample* from = static_cast<const Sample*>(image.samples.get()) + first_pixel * image.channels;
  const auto value = [&](int channel) {
    const float number = static_cast<float>(from[channel]) / full;
    return std::isfinite(number) ? number : 0.0f;
  };
  for (int i = 0; i < count; ++i, from += image.channels, rgba += 4) {
    for (int c = 0; c < 3; ++c) rgba[c] = value(image.rgb[c]);
    rgba[3] = image.alpha < 0 ? 1.0f : value(image.alpha);
  }
}

std::size_t non_finite_pixels(const NativeImage& image) {
  if (image.type != SampleType::float32) return 0;
  const auto* pixel = static_cast<const float*>(image.samples.get());
  const std::size_t count = static_cast<std::size_t>(image.data_width) * image.data_height;
  std::size_t found = 0;
  for (std::size_t i = 0; i < count; ++i, pixel += image.channels) {
    const auto is_finite = [&](int channel) { return channel < 0 || std::isfinite(pixel[channel]); };
    found += !(is_finite(image.rgb[0]) && is_finite(image.rgb[1]) && is_finite(image.rgb[2]) && is_finite(image.alpha));
  }
  return found;
}

}  // namespace

std::string layer_of(const std::string& channel) {
  const bool is_picture = channel == "R" || channel == "G" || channel == "B" || channel == "A";
  return is_picture ? "" : channel.substr(0, channel.find('.'));
}

std::vector<std::string> image_endings() { return {".exr", ".png", ".jpg", ".jpeg", ".tif", ".tiff"}; }

bool holds_alpha(const std::filesystem::path& path) { return find_format(path).alpha; }

void set_image_threads(int threads) { image_threads = threads; }

void prepare_images(const std::vector<std::filesystem::path>& files) {
  for (const std::filesystem::path& file : files) {
    const std::vector<std::string> known = image_endings();
    const bool is_picture = std::find(known.begin(), known.end(), lower_case_ending(file)) != known.end();
    if (!is_picture) continue;
    const PictureFormat format = find_format(file);
    if (!is_exr(format) && !is_png(format)) image_plugin();
  }
}

void write_image(const std::filesystem::path& path, const Image& image, const ImageMetadata& metadata) {
  check_size(image);
  try {
    write_bytes(path, encode(image, find_format(path), metadata));
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot write " + path.string() + ": " + error.what());
  }
}

std::vector<unsigned char> encode_for_screen(const Image& image) {
  check_size(image);
  return encode_png(clipped(image, true), {}, 8);
}

Image read_image(const std::filesystem::path& path) {
  return read(path, [&](const std::optional<ColorTags>&) { return ready_library().decode(path); });
}

NativeImage read_native_image(const std::filesystem::path& path, const std::string& layer) {
  return read(path, [&](std::optional<ColorTags> of_png) {
    std::optional<NativeImage> image;
    if (layer.empty()) image = read_luminance_chroma(path);
    if (!image) image = ready_library().decode_native(path, layer);
    if (of_png) of_png->icc_profile = image->tags.icc_profile;
    if (of_png) image->tags = *of_png;
    image->non_finite = non_finite_pixels(*image);
    return *image;
  });
}

void add_notes(const std::filesystem::path& path, const NativeImage& image, std::vector<std::string>& notes) {
  if (!image.choice.empty()) notes.push_back(path.string() + ": " + image.choice);
  if (image.non_finite > 0)
    notes.push_back("warning: " + path.string() + ": " + std::to_string(image.non_finite) +
                    " pixels have values that are not finite; these count as 0");
}

NativeImage native_image(Image image) {
  const std::vector<std::string> rgb{"R", "G", "B"}, rgba{"R", "G", "B", "A"};
  check_size(image);
  if (image.channels != rgb && image.channels != rgba)
    throw std::invalid_argument("a picture to be looked up must have the channels R, G, B or R, G, B, A");
  NativeImage native;
  native.width = native.data_width = image.width;
  native.height = native.data_height = image.height;
  native.channels = static_cast<int>(image.channels.size());
  native.rgb = {0, 1, 2};
  native.alpha = native.channels == 4 ? 3 : -1;
  native.is_premultiplied = true;
  const auto pixels = std::make_shared<const std::vector<float>>(std::move(image.pixels));
  native.samples = std::shared_ptr<const void>(pixels, pixels->data());
  return native;
}

void read_pixels(const NativeImage& image, int x, int y, int count, float* rgba) {
  std::fill_n(rgba, static_cast<std::size_t>(count) * 4, 0.0f);
  const int row = y - image.data_y;
  const int begin = std::max(x, image.data_x), end = std::min(x + count, image.data_x + image.data_width);
  if (row < 0 || row >= image.data_height || begin >= end) return;
  const std::size_t first = static_cast<std::size_t>(row) * image.data_width + (begin - image.data_x);
  float* const to = rgba + static_cast<std::size_t>(begin - x) * 4;
  if (image.type == SampleType::uint8) unpack<std::uint8_t>(image, first, end - begin, 255, to);
  if (image.type == SampleType::uint16) unpack<std::uint16_t>(image, first, end - begin, 65535, to);
  if (image.type == SampleType::float32) unpack<float>(image, first, end - begin, 1, to);
}

}  // namespace tensorray
