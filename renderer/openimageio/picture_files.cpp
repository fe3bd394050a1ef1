#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "base/text/text.h"
#include "renderer/images/formats.h"

namespace tensorray {
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
  const auto profile = metadata.find("ICCProfile");
  if (profile != metadata.end())
    spec.attribute("ICCProfile", OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(profile->second.size())),
                   profile->second.data());
  spec.attribute("DateTime", "");  // Prevents OpenImageIO from writing the time, which would differ between runs.
  return spec;
}

bool is_tiff(const OIIO::ImageInput& input) { return std::strcmp(input.format_name(), "tiff") == 0; }
bool is_exr(const OIIO::ImageInput& input) { return std::strcmp(input.format_name(), "openexr") == 0; }

/// A tile may be larger than its picture, but memory is reserved for all of it before the file is found to be shorter.
/// Lines are counted from a place that the file sets.
void require_likely_layout(const OIIO::ImageSpec& spec) {
  if (std::abs(std::int64_t{spec.y}) > 1 << 30)
    throw std::runtime_error("its header is damaged: its first line is " + std::to_string(spec.y));
  const double tile = double(spec.tile_width) * spec.tile_height, picture = double(spec.width) * spec.height;
  if (tile > std::max(4096.0 * 4096, 4 * picture))
    throw std::runtime_error("its header is damaged: its tiles have " + std::to_string(spec.tile_width) + " x " +
                             std::to_string(spec.tile_height) + " pixels");
}

/// Reads channels of a part as `type` into `samples`, which holds them all. TIFF is read line by line: OpenImageIO does
/// not notice damage in several strips.
/// @throw std::runtime_error with the reader's first message. Some readers give none if a file is cut off.
void read_samples(OIIO::ImageInput& input, int part, int first, int count, OIIO::TypeDesc type, void* samples) {
  const OIIO::ImageSpec spec = input.spec(part, 0);
  require_likely_layout(spec);
  bool done = true;
  if (is_tiff(input) && spec.tile_width == 0) {
    const std::size_t line = type.size() * static_cast<std::size_t>(count) * static_cast<std::size_t>(spec.width);
    auto* target = static_cast<unsigned char*>(samples);
    for (int y = spec.y; done && y < spec.y + spec.height; ++y, target += line)
      done = input.read_scanlines(part, 0, y, y + 1, spec.z, first, first + count, type, target) && !input.has_error();
  } else {
    done = input.read_image(part, 0, first, first + count, type, samples) && !input.has_error();
  }
  if (done) return;
  const std::string reasons = input.geterror();
  const std::string reason = one_line(reasons.substr(0, reasons.find('\n')));
  throw std::runtime_error("the file is cut off or damaged" + (reason.empty() ? "" : ": " + reason));
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
  const std::vector<std::string>& names = spec.channelnames;  // Formats with inks may name more or fewer of them.
  for (std::size_t i = 0; i < names.size() && static_cast<int>(i) < spec.nchannels; ++i)
    if (OIIO::Strutil::iequals(names[i], name)) return static_cast<int>(i);
  return -1;
}

/// Finds the colours of a layer, by the names of the format or by Nuke's.
bool find_rgb_of(const OIIO::ImageSpec& spec, const std::string& prefix, NativeImage& image) {
  for (const auto& [red, green, blue, alpha] :
       {std::array{"R", "G", "B", "A"}, std::array{"red", "green", "blue", "alpha"}}) {
    const std::array<int, 3> rgb{find_channel(spec, prefix + red), find_channel(spec, prefix + green),
                                 find_channel(spec, prefix + blue)};
    if (rgb[0] < 0 || rgb[1] < 0 || rgb[2] < 0) continue;
    image.rgb = rgb;
    image.alpha = find_channel(spec, prefix + alpha);
    return true;
  }
  return false;
}

/// The names before the last point of the channels' names, with the point; also of channels without a point.
std::vector<std::string> prefixes(const OIIO::ImageSpec& spec) {
  std::vector<std::string> found;
  for (const std::string& name : spec.channelnames) {
    const std::string prefix = name.substr(0, name.rfind('.') + 1);
    if (std::find(found.begin(), found.end(), prefix) == found.end()) found.push_back(prefix);
  }
  return found;
}

/// Finds the colour channels without a layer's name, or those of the first layer that has colours.
bool find_rgb(const OIIO::ImageSpec& spec, NativeImage& image) {
  const std::vector<std::string> all = prefixes(spec);
  return find_rgb_of(spec, "", image) ||
         std::any_of(all.begin(), all.end(), [&](const std::string& each) { return find_rgb_of(spec, each, image); });
}

bool find_grey(const OIIO::ImageSpec& spec, NativeImage& image) {
  image.alpha = spec.nchannels == 1 ? -1 : find_channel(spec, "A");
  int grey = spec.nchannels == 1 ? 0 : find_channel(spec, "Y");
  if (spec.nchannels == 2 && image.alpha >= 0) grey = 1 - image.alpha;
  image.rgb = {grey, grey, grey};
  return grey >= 0;
}

std::string part_name(const OIIO::ImageSpec& spec) { return spec.get_string_attribute("oiio:subimagename"); }

/// Finds the channels of a layer: LAYER.R, ..., the channel LAYER, or all channels of the part of this name.
bool find_layer(const OIIO::ImageSpec& spec, const std::string& layer, NativeImage& image) {
  if (find_rgb_of(spec, layer + ".", image)) return true;
  if (OIIO::Strutil::iequals(part_name(spec), layer)) return find_rgb(spec, image) || find_grey(spec, image);
  int grey = find_channel(spec, layer + ".Y");
  if (grey < 0) grey = find_channel(spec, layer);
  image.rgb = {grey, grey, grey};
  image.alpha = -1;
  return grey >= 0;
}

/// The names of the parts, and of the layers of channels in them.
std::vector<std::string> layers_of(OIIO::ImageInput& input) {
  std::vector<std::string> known;
  for (int part = 0; input.seek_subimage(part, 0); ++part) {
    if (!part_name(input.spec()).empty()) known.push_back(part_name(input.spec()));
    for (const std::string& prefix : prefixes(input.spec()))
      if (!prefix.empty()) known.push_back(prefix.substr(0, prefix.size() - 1));
  }
  return known;
}

/// Says which part or layer was taken, unless it is the first part's without a layer, and no other part has such ones.
void say_choice(OIIO::ImageInput& input, int part, NativeImage& image) {
  const std::vector<std::string> known = layers_of(input);
  int plain = 0;
  for (NativeImage other; input.seek_subimage(plain, 0) && find_rgb_of(input.spec(), "", other);) ++plain;
  const OIIO::ImageSpec spec = input.spec(part, 0);
  const std::string channel = spec.channelnames[static_cast<std::size_t>(image.rgb[0])], name = part_name(spec);
  const std::size_t point = channel.rfind('.');
  if (known.size() < 2 || (part == 0 && point == std::string::npos && plain < 2)) return;
  image.choice = std::string(image.rgb[0] == image.rgb[1] ? "its grey is" : "its colours are") + " taken from " +
                 (point != std::string::npos ? "the layer \"" + channel.substr(0, point) : "the part \"" + name) +
                 "\"; its layers: " + joined(known);
}

/// Finds colours in the first part of a file, or of an EXR in the first part that has some: without a layer's name, or
/// else of a layer. Without colours, grey is taken, by its name before any channel (depth).
int find_colors(OIIO::ImageInput& input, NativeImage& image) {
  using Spec = const OIIO::ImageSpec&;
  const std::function<bool(Spec)> finders[] = {
      [&](Spec spec) { return find_rgb_of(spec, "", image); }, [&](Spec spec) { return find_rgb(spec, image); },
      [&](Spec spec) { return find_channel(spec, "Y") >= 0 && find_grey(spec, image); },
      [&](Spec spec) { return find_grey(spec, image); }};
  const bool has_parts = is_exr(input) && input.seek_subimage(1, 0);
  for (const auto& finds : finders)
    for (int part = 0; (part == 0 || has_parts) && input.seek_subimage(part, 0); ++part)
      if (!(has_parts && input.spec().deep) && finds(input.spec())) return part;
  input.seek_subimage(0, 0);
  throw std::runtime_error("it has no channels R, G, B, nor grey (Y); its channels: " +
                           joined(input.spec().channelnames));
}

/// Finds the channels of a picture, or those of a layer in any part. @return the part.
int find_channels(OIIO::ImageInput& input, const std::string& layer, NativeImage& image) {
  if (layer.empty()) {
    const int part = find_colors(input, image);
    if (is_exr(input)) say_choice(input, part, image);  // Others may not be read after they have been searched.
    return part;
  }
  for (int part = 0; input.seek_subimage(part, 0); ++part)
    if (find_layer(input.spec(), layer, image)) return part;
  const std::vector<std::string> known = layers_of(input);
  throw std::runtime_error("it has no layer \"" + layer +
                           "\"; its layers: " + (known.empty() ? "none" : joined(known)));
}

/// Makes the channels' indices count from the first one that is needed.
/// @return the index of that first channel in the file; `image.channels` counts from it to the last one needed.
int first_channel(NativeImage& image) {
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

/// Only TIFF has integers of 24 bits. Other formats have this attribute for other reasons.
bool has_24_bits(const OIIO::ImageInput& input, const OIIO::ImageSpec& spec) {
  return is_tiff(input) && spec.format.size() == sizeof(std::uint32_t) &&
         spec.get_int_attribute("oiio:BitsPerSample") == 24;
}

void require_flat(const OIIO::ImageSpec& spec) {
  if (spec.deep || spec.depth > 1) throw std::runtime_error("it is not a flat picture, but deep or a volume");
}

ColorTags tags_of(const OIIO::ImageSpec& spec) {
  ColorTags tags;
  if (const OIIO::ParamValue* const profile = spec.find_attribute("ICCProfile"))
    tags.icc_profile.assign(static_cast<const char*>(profile->data()), static_cast<std::size_t>(profile->datasize()));
  const auto floats = [&](const char* name, auto& target) {
    const OIIO::ParamValue* const found = spec.find_attribute(name);
    if (!found || found->type().basetype != OIIO::TypeDesc::FLOAT) return;
    const auto* const values = static_cast<const float*>(found->data());
    if (static_cast<std::size_t>(found->datasize()) == target.emplace().size() * sizeof(float))
      std::copy_n(values, target->size(), target->begin());
    else
      target.reset();
  };
  floats("chromaticities", tags.chromaticities);
  floats("adoptedNeutral", tags.adopted_neutral);
  return tags;
}

/// Makes floats of a TIFF's integers of 24 bits, which were read as uint32, in place. OpenImageIO 2.4 scales them to 32
/// bits, and takes their bytes in the wrong order: libtiff gives them in the processor's.
void convert_24_bits(unsigned char* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i, values += sizeof(float)) {
    std::uint32_t wrong = 0;
    std::memcpy(&wrong, values, sizeof wrong);
    wrong >>= 8;
    const std::uint32_t right = (wrong & 0xff) << 16 | (wrong & 0xff00) | wrong >> 16;
    const float value = static_cast<float>(right / 16777215.0);
    std::memcpy(values, &value, sizeof value);
  }
}

/// The difference of two places, or the greatest integer if it is none.
int offset(int place, int origin) {
  const std::int64_t difference = std::int64_t{place} - origin;
  constexpr int greatest = std::numeric_limits<int>::max();
  return std::abs(difference) > greatest ? greatest : static_cast<int>(difference);
}

/// Turns a picture as Exif's orientation (1 to 8) says.
void turn(int orientation, NativeImage& image) {
  if (orientation < 2 || orientation > 8) return;
  const bool swaps = orientation >= 5;
  const bool mirrors_x = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool mirrors_y = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  const NativeImage from = image;
  if (mirrors_x) image.data_x = from.width - from.data_x - from.data_width;
  if (mirrors_y) image.data_y = from.height - from.data_y - from.data_height;
  if (swaps) {
    std::swap(image.width, image.height);
    std::swap(image.data_x, image.data_y);
    std::swap(image.data_width, image.data_height);
  }
  const std::size_t pixel = bytes_of(image.type) * static_cast<std::size_t>(image.channels);
  const auto* const source = static_cast<const unsigned char*>(from.samples.get());
  const std::shared_ptr<unsigned char[]> target(new unsigned char[stored_bytes(image)]);
  std::size_t at = 0;
  for (int y = 0; y < image.data_height; ++y)
    for (int x = 0; x < image.data_width; ++x, at += pixel) {
      const int column = swaps ? y : x, row = swaps ? x : y;
      const int from_x = mirrors_x ? from.data_width - 1 - column : column;
      const int from_y = mirrors_y ? from.data_height - 1 - row : row;
      std::copy_n(source + (static_cast<std::size_t>(from_y) * from.data_width + from_x) * pixel, pixel, &target[at]);
    }
  image.samples = target;
}

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
  const OIIO::ImageSpec spec = input->spec();
  require_flat(spec);
  std::vector<std::string> channels = spec.channelnames;
  channels.resize(static_cast<std::size_t>(spec.nchannels));
  Image image(spec.width, spec.height, std::move(channels));
  read_samples(*input, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels.data());
  input->close();
  return image;
}

NativeImage decode_native(const std::filesystem::path& path, const std::string& layer) {
  const std::unique_ptr<OIIO::ImageInput> input = open_as_it_is(path);
  NativeImage image;
  const int part = find_channels(*input, layer, image);
  const OIIO::ImageSpec spec = input->spec(part, 0);
  require_flat(spec);
  image.width = spec.full_width;
  image.height = spec.full_height;
  image.data_x = offset(spec.x, spec.full_x);
  image.data_y = offset(spec.y, spec.full_y);
  image.data_width = spec.width;
  image.data_height = spec.height;
  image.type = sample_type(spec);
  image.is_integer = !spec.format.is_floating_point();
  image.tags = tags_of(spec);
  const bool is_24_bits = has_24_bits(*input, spec);
  if (is_24_bits && !image.is_integer)
    throw std::runtime_error("floats of 24 bits are not read; save it with 16 or 32 bits");
  const int first = first_channel(image);
  image.is_premultiplied = image.alpha >= 0 && !spec.get_int_attribute("oiio:UnassociatedAlpha");
  const std::size_t bytes = stored_bytes(image);
  const std::shared_ptr<unsigned char[]> samples(new unsigned char[bytes]);
  read_samples(*input, part, first, image.channels,
               is_24_bits ? OIIO::TypeDesc(OIIO::TypeDesc::UINT32) : type_desc(image.type), samples.get());
  input->close();
  if (is_24_bits) convert_24_bits(samples.get(), bytes / sizeof(float));
  image.samples = samples;
  turn(spec.get_int_attribute("Orientation", 1), image);
  return image;
}

}  // namespace
}  // namespace tensorray

/// The functions of the library, found by this name.
extern "C" __attribute__((visibility("default"))) const tensorray::ImagePlugin tensorray_image_plugin{
    tensorray::set_threads, tensorray::encode, tensorray::decode, tensorray::decode_native};
