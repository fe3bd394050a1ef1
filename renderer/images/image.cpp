#include "renderer/images/image.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <set>
#include <stdexcept>
#include <system_error>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "base/errors.h"
#include "base/text.h"

namespace tensorray {
namespace {

/// Properties of a file format. OpenImageIO's name of the format chooses the writer.
struct Format {
  std::string name;
  OIIO::TypeDesc type;
  bool display_referred = true;
  bool alpha = false;
  bool all_metadata = false;
};

Format find_format(const std::filesystem::path& path) {
  const std::string ending = lower_case_ending(path);
  if (ending == ".exr") return {"openexr", OIIO::TypeDesc::FLOAT, false, true, true};
  if (ending == ".png") return {"png", OIIO::TypeDesc::UINT16, true, true, true};
  if (ending == ".jpg" || ending == ".jpeg") return {"jpeg", OIIO::TypeDesc::UINT8, true, false, false};
  if (ending == ".tif" || ending == ".tiff") return {"tiff", OIIO::TypeDesc::UINT16, true, true, false};
  throw std::runtime_error("unknown picture ending \"" + ending + "\"; known: " + joined(image_endings()));
}

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

/// Whether TIFF and JPEG have a plain field for an attribute. For others OpenImageIO 2.4 would write an Exif directory,
/// which it cannot do in memory for TIFF.
bool is_plain(const std::string& attribute) {
  static const std::set<std::string> names{"ImageDescription", "Software", "Artist", "Copyright"};
  return names.count(attribute) > 0;
}

OIIO::ImageSpec make_spec(const Image& image, const Format& format, const ImageMetadata& metadata) {
  OIIO::ImageSpec spec(image.width, image.height, static_cast<int>(image.channels.size()), format.type);
  spec.channelnames = image.channels;
  if (image.channels.size() > 3 && image.channels[3] == "A") spec.alpha_channel = 3;
  if (format.display_referred) spec.attribute("oiio:UnassociatedAlpha", 1);
  if (format.name == "openexr") spec.attribute("compression", "zip");
  // Three to four times as fast as the default strategy and level; files are from 2% larger to 7% smaller.
  if (format.name == "png") spec.attribute("compression", "rle");
  if (format.name == "jpeg") {
    spec.attribute("Compression", "jpeg:95");
    spec.attribute("jpeg:subsampling", "4:4:4");
  }
  if (format.name == "png" || format.name == "jpeg") spec.attribute("oiio:ColorSpace", "sRGB");
  for (const auto& [name, value] : metadata)
    if (format.all_metadata || is_plain(name) || (format.name == "jpeg" && name == "oiio:ColorSpace"))
      spec.attribute(name, value);
  spec.attribute("DateTime", "");  // Prevents OpenImageIO from writing the time, which would differ between runs.
  return spec;
}

std::vector<unsigned char> encode(const Image& image, const Format& format, const ImageMetadata& metadata) {
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(format.name);
  if (!output) throw std::runtime_error(one_line(OIIO::geterror()));
  OIIO::Filesystem::IOVecOutput memory;
  const auto require = [&](bool done) {
    if (!done) throw std::runtime_error(one_line(output->geterror()));
  };
  require(output->supports("ioproxy") && output->set_ioproxy(&memory));
  require(output->open("memory." + format.name, make_spec(image, format, metadata)));
  require(output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data()));
  require(output->close());
  return std::move(memory.buffer());
}

[[noreturn]] void throw_errno() { throw std::runtime_error(std::generic_category().message(errno)); }

/// Also checks the result of closing the file: a full disk may be reported only then.
void write_bytes(const std::filesystem::path& path, const std::vector<unsigned char>& bytes) {
  std::FILE* const file = std::fopen(path.string().c_str(), "wb");
  if (!file) throw_errno();
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size() && std::fflush(file) == 0;
  const int write_error = errno;
  const bool closed = std::fclose(file) == 0;
  if (!written) errno = write_error;
  if (!written || !closed) throw_errno();
}

bool begins_with(const std::string& bytes, const std::string& start) {
  return bytes.compare(0, start.size(), start) == 0;
}

/// Whether the end of a JPEG or PNG is missing. libjpeg fills the missing part with grey without an error; libpng
/// prints a message.
bool is_cut_off(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(4, '\0');
  file.read(&bytes[0], 4);
  const bool jpeg = begins_with(bytes, "\xFF\xD8"), png = begins_with(bytes, "\x89PNG");
  if (!jpeg && !png) return false;
  bytes.resize(std::filesystem::file_size(path));
  file.seekg(0).read(&bytes[0], static_cast<std::streamsize>(bytes.size()));
  if (png)
    return bytes.rfind("IEND\xAE\x42\x60\x82") == std::string::npos;  // The last chunk, which is always the same.
  // In the compressed data 0xFF is always followed by 0 or a restart marker. Therefore the first end marker after the
  // start of the last scan belongs to the picture itself, not to an embedded one.
  const std::size_t scan = bytes.rfind("\xFF\xDA");
  return scan == std::string::npos || bytes.find("\xFF\xD9", scan) == std::string::npos;
}

/// Throws the reader's message. Some readers give none if a file is cut off; the error then says so.
[[noreturn]] void throw_read_error(const OIIO::ImageInput& input) {
  const std::string reason = one_line(input.geterror());
  throw std::runtime_error(reason.empty() ? "the file is cut off or damaged" : reason);
}

std::unique_ptr<OIIO::ImageInput> open_as_it_is(const std::filesystem::path& path) {
  if (is_cut_off(path)) throw std::runtime_error("the file is cut off");
  OIIO::ImageSpec as_it_is;
  as_it_is.attribute("oiio:UnassociatedAlpha", 1);
  std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string(), &as_it_is);
  if (!input) throw std::runtime_error(one_line(OIIO::geterror()));
  return input;
}

Image decode(const std::filesystem::path& path) {
  const std::unique_ptr<OIIO::ImageInput> input = open_as_it_is(path);
  const OIIO::ImageSpec& spec = input->spec();
  Image image(spec.width, spec.height, spec.channelnames);
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels.data())) throw_read_error(*input);
  input->close();
  return image;
}

/// The index of a channel of a file, or -1 if there is none. Names match in upper and lower case.
int find_channel(const OIIO::ImageSpec& spec, const std::string& name) {
  for (int i = 0; i < spec.nchannels; ++i)
    if (OIIO::Strutil::iequals(spec.channelnames[i], name)) return i;
  return -1;
}

/// Finds the colour channels without a layer's name, or those of the first layer that has colours.
bool find_rgb(const OIIO::ImageSpec& spec, NativeImage& image) {
  std::vector<std::string> layers{""};
  for (const std::string& name : spec.channelnames) layers.push_back(name.substr(0, name.rfind('.') + 1));
  for (const std::string& layer : layers) {
    const std::array<int, 3> rgb{find_channel(spec, layer + "R"), find_channel(spec, layer + "G"),
                                 find_channel(spec, layer + "B")};
    if (rgb[0] < 0 || rgb[1] < 0 || rgb[2] < 0) continue;
    image.rgb = rgb;
    image.alpha = find_channel(spec, layer + "A");
    return true;
  }
  return false;
}

bool find_grey(const OIIO::ImageSpec& spec, NativeImage& image) {
  image.alpha = find_channel(spec, "A");
  int grey = find_channel(spec, "Y");
  if (spec.nchannels == 1) {
    grey = 0;
    image.alpha = -1;
  } else if (spec.nchannels == 2 && image.alpha >= 0) {
    grey = 1 - image.alpha;
  }
  image.rgb = {grey, grey, grey};
  return grey >= 0;
}

/// Finds the channels; their indices count from the first channel that is needed.
/// @return the index of that first channel in the file; `image.channels` counts from it to the last one needed.
int choose_channels(const OIIO::ImageSpec& spec, NativeImage& image) {
  if (!find_rgb(spec, image) && !find_grey(spec, image)) {
    std::string names;
    for (const std::string& name : spec.channelnames) names += (names.empty() ? "" : ", ") + name;
    throw std::runtime_error("it has no channels R, G, B, nor grey (Y); its channels: " + names);
  }
  const auto [least, most] = std::minmax_element(image.rgb.begin(), image.rgb.end());
  const int first = image.alpha < 0 ? *least : std::min(*least, image.alpha);
  image.channels = std::max(*most, image.alpha) + 1 - first;
  for (int& channel : image.rgb) channel -= first;
  if (image.alpha >= 0) image.alpha -= first;
  return first;
}

SampleType sample_type(const OIIO::ImageSpec& spec) {
  if (!spec.channelformats.empty()) return SampleType::float32;
  if (spec.format == OIIO::TypeDesc::UINT8) return SampleType::uint8;
  return spec.format == OIIO::TypeDesc::UINT16 ? SampleType::uint16 : SampleType::float32;
}

std::size_t bytes_of(SampleType type) { return type == SampleType::uint8 ? 1 : type == SampleType::uint16 ? 2 : 4; }

OIIO::TypeDesc type_desc(SampleType type) {
  if (type == SampleType::uint8) return OIIO::TypeDesc::UINT8;
  return type == SampleType::uint16 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::FLOAT;
}

/// The number of bytes of a picture's values. @throw std::runtime_error if there are more than the limit; this check
/// comes before memory is allocated.
std::size_t checked_bytes(const NativeImage& image) {
  constexpr double limit = 8.0 * (1 << 30);
  const double bytes = static_cast<double>(image.channels) * static_cast<double>(bytes_of(image.type));
  const double stored = bytes * image.data_width * image.data_height, whole = bytes * image.width * image.height;
  if (!(std::max(stored, whole) <= limit))
    throw std::runtime_error("its " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                             " pixels take more than 8 GiB; make it smaller");
  return static_cast<std::size_t>(stored);
}

NativeImage decode_native(const std::filesystem::path& path) {
  const std::unique_ptr<OIIO::ImageInput> input = open_as_it_is(path);
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.deep || spec.depth > 1) throw std::runtime_error("it is not a flat picture, but deep or a volume");
  NativeImage image;
  image.width = spec.full_width;
  image.height = spec.full_height;
  image.data_x = spec.x - spec.full_x;
  image.data_y = spec.y - spec.full_y;
  image.data_width = spec.width;
  image.data_height = spec.height;
  image.type = sample_type(spec);
  const int first = choose_channels(spec, image);
  image.is_premultiplied = image.alpha >= 0 && !spec.get_int_attribute("oiio:UnassociatedAlpha");
  const std::size_t bytes = checked_bytes(image);
  const std::shared_ptr<unsigned char[]> samples(new unsigned char[bytes]);
  if (!input->read_image(0, 0, first, first + image.channels, type_desc(image.type), samples.get()))
    throw_read_error(*input);
  input->close();
  image.samples = samples;
  return image;
}

/// Reads a file with one of the functions above; errors name the file.
template <class Decode>
auto read(const std::filesystem::path& path, const Decode& decode_file) {
  require_readable(path);
  try {
    return decode_file(path);
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

}  // namespace

std::vector<std::string> image_endings() { return {".exr", ".png", ".jpg", ".jpeg", ".tif", ".tiff"}; }

bool holds_alpha(const std::filesystem::path& path) { return find_format(path).alpha; }

void set_image_threads(int threads) {
  OIIO::attribute("threads", threads);
  OIIO::attribute("exr_threads", threads > 1 ? threads : -1);  // -1: use only the calling thread.
}

void write_image(const std::filesystem::path& path, const Image& image, const ImageMetadata& metadata) {
  check_size(image);
  try {
    const Format format = find_format(path);
    const bool clip = format.display_referred;
    write_bytes(path, encode(clip ? clipped(image, format.alpha) : image, format, metadata));
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot write " + path.string() + ": " + error.what());
  }
}

Image read_image(const std::filesystem::path& path) { return read(path, decode); }

NativeImage read_native_image(const std::filesystem::path& path) { return read(path, decode_native); }

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
