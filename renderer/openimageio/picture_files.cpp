#include "renderer/openimageio/picture_files.h"

#include <algorithm>
#include <array>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "base/text.h"

namespace tensorray::openimageio {
namespace {

OIIO::TypeDesc type_desc(SampleType type) {
  if (type == SampleType::uint8) return OIIO::TypeDesc::UINT8;
  return type == SampleType::uint16 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::FLOAT;
}

/// Whether TIFF and JPEG have a plain field for an attribute. For others OpenImageIO 2.4 would write an Exif directory,
/// which it cannot do in memory for TIFF.
bool is_plain(const std::string& attribute) {
  static const std::set<std::string> names{"ImageDescription", "Software", "Artist", "Copyright"};
  return names.count(attribute) > 0;
}

OIIO::ImageSpec make_spec(const Image& image, const PictureFormat& format, const ImageMetadata& metadata) {
  OIIO::ImageSpec spec(image.width, image.height, static_cast<int>(image.channels.size()), type_desc(format.type));
  spec.channelnames = image.channels;
  if (image.channels.size() > 3 && image.channels[3] == "A") spec.alpha_channel = 3;
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (format.name == "jpeg") {
    spec.attribute("Compression", "jpeg:95");
    spec.attribute("jpeg:subsampling", "4:4:4");
    spec.attribute("oiio:ColorSpace", "sRGB");
  }
  for (const auto& [name, value] : metadata)
    if (is_plain(name) || (format.name == "jpeg" && name == "oiio:ColorSpace")) spec.attribute(name, value);
  spec.attribute("DateTime", "");  // Prevents OpenImageIO from writing the time, which would differ between runs.
  return spec;
}

/// Throws the reader's message. Some readers give none if a file is cut off; the error then says so.
[[noreturn]] void throw_read_error(const OIIO::ImageInput& input) {
  const std::string reason = one_line(input.geterror());
  throw std::runtime_error(reason.empty() ? "the file is cut off or damaged" : reason);
}

std::unique_ptr<OIIO::ImageInput> open_as_it_is(const std::filesystem::path& path) {
  OIIO::ImageSpec as_it_is;
  as_it_is.attribute("oiio:UnassociatedAlpha", 1);
  std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string(), &as_it_is);
  if (!input) throw std::runtime_error(one_line(OIIO::geterror()));
  return input;
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

}  // namespace

void set_threads(int threads) {
  OIIO::attribute("threads", threads);
  OIIO::attribute("exr_threads", threads > 1 ? threads : threads == 1 ? -1 : 0);  // -1: only the calling thread.
}

std::vector<unsigned char> encode(const Image& image, const PictureFormat& format, const ImageMetadata& metadata) {
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

Image decode(const std::filesystem::path& path) {
  const std::unique_ptr<OIIO::ImageInput> input = open_as_it_is(path);
  const OIIO::ImageSpec& spec = input->spec();
  Image image(spec.width, spec.height, spec.channelnames);
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels.data())) throw_read_error(*input);
  input->close();
  return image;
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

}  // namespace tensorray::openimageio
