#include <algorithm>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTestFile.h>
#include <OpenEXR/ImfThreading.h>

#include "base/text/text.h"
#include "renderer/images/formats.h"

namespace tensorray {
namespace {

/// A file in memory. OpenEXR goes back in it to write where the rows are.
class MemoryFile : public Imf::OStream {
 public:
  MemoryFile() : OStream("in memory") {}

  void write(const char data[], int size) override {
    const std::size_t end = position_ + static_cast<std::size_t>(size);
    if (end > bytes.size()) bytes.resize(end);
    std::copy_n(data, size, bytes.begin() + static_cast<std::ptrdiff_t>(position_));
    position_ = end;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = static_cast<std::size_t>(position); }

  std::vector<unsigned char> bytes;

 private:
  std::size_t position_ = 0;
};

/// The name of the format for an attribute.
std::string attribute_name(const std::string& attribute) {
  if (attribute == "ImageDescription") return "comments";
  return attribute == "Copyright" ? "owner" : attribute;
}

/// The names of the channels in the file, all different.
std::vector<std::string> distinct_names(const std::vector<std::string>& channels) {
  constexpr std::size_t longest = 255;
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    std::string name = channels[c].substr(0, longest);
    if (name.empty() || !taken.insert(name).second) name = "channel" + std::to_string(c);
    names.push_back(name);
  }
  return names;
}

/// @param numbers  x and y of red, green, blue and white.
Imf::Chromaticities exr_chromaticities(const std::string& numbers) {
  std::istringstream words(numbers);
  Imath::V2f points[4];
  for (Imath::V2f& point : points) words >> point.x >> point.y;
  if (!words) throw std::runtime_error("chromaticities must be eight numbers");
  return {points[0], points[1], points[2], points[3]};
}

Imf::Header header_of(const Image& image, const ImageMetadata& metadata) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  header.insert("capDate", Imf::StringAttribute());  // Unknown: the same picture gives the same bytes at any time.
  const std::set<std::string> left_out{"", "type", "oiio:ColorSpace", "ICCProfile"};
  if (metadata.count("chromaticities") > 0)
    header.insert("chromaticities", Imf::ChromaticitiesAttribute(exr_chromaticities(metadata.at("chromaticities"))));
  for (const auto& [attribute, text] : metadata) {
    const std::string name = attribute_name(attribute);
    const bool is_free = left_out.count(name) == 0 && header.find(name) == header.end();
    if (is_free) header.insert(name, Imf::StringAttribute(text));
  }
  return header;
}

/// Colours and normals; not depths, numbers, lengths, and places in textures, which need more digits than halves have.
bool may_be_half(const std::string& channel) {
  const std::string end = channel.substr(channel.rfind('.') + 1);
  const bool is_normal = end != channel && (end == "X" || end == "Y" || end == "Z");
  return is_normal || end == "R" || end == "G" || end == "B" || channel == "A";
}

std::vector<half> halves_of(const Image& image, std::size_t channel) {
  constexpr auto most = static_cast<float>(HALF_MAX);
  std::vector<half> values;
  for (std::size_t i = channel; i < image.pixels.size(); i += image.channels.size())
    values.emplace_back(std::clamp(image.pixels[i], -most, most));
  return values;
}

/// OpenImageIO, which reads with the same pool, sets the same number (renderer/openimageio/picture_files.cpp).
void set_pool(int threads) {
  const int all = static_cast<int>(std::thread::hardware_concurrency());
  const int wanted = threads == 0 ? all : threads == 1 ? 0 : threads;  // 0: the calling thread alone.
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
  if (Imf::globalThreadCount() != wanted) Imf::setGlobalThreadCount(wanted);
}

bool is_luminance_chroma(const std::filesystem::path& path) {
  bool is_tiled = false, is_deep = false, is_multi_part = false;
  if (!Imf::isOpenExrFile(path.string().c_str(), is_tiled, is_deep, is_multi_part)) return false;
  if (is_tiled || is_deep || is_multi_part) return false;
  return (Imf::RgbaInputFile(path.string().c_str()).channels() & Imf::WRITE_C) != 0;
}

NativeImage read_pixels_of(Imf::RgbaInputFile& file) {
  const Imath::Box2i display = file.displayWindow(), data = file.dataWindow();
  NativeImage image;
  image.width = display.max.x - display.min.x + 1;
  image.height = display.max.y - display.min.y + 1;
  image.data_x = data.min.x - display.min.x;
  image.data_y = data.min.y - display.min.y;
  image.data_width = data.max.x - data.min.x + 1;
  image.data_height = data.max.y - data.min.y + 1;
  image.channels = 4;
  image.rgb = {0, 1, 2};
  image.alpha = 3;
  image.is_premultiplied = true;
  stored_bytes(image);
  const auto width = static_cast<std::size_t>(image.data_width);
  const std::size_t count = width * static_cast<std::size_t>(image.data_height);
  std::vector<Imf::Rgba> pixels(count);
  // The address of pixel (0, 0), which need not be stored.
  file.setFrameBuffer(pixels.data() - data.min.x - data.min.y * static_cast<std::ptrdiff_t>(width), 1, width);
  file.readPixels(data.min.y, data.max.y);
  const std::shared_ptr<float[]> samples(new float[count * 4]);
  for (std::size_t i = 0; i < count; ++i) {
    const float values[4] = {pixels[i].r, pixels[i].g, pixels[i].b, pixels[i].a};
    std::copy_n(values, 4, &samples[4 * i]);
  }
  image.samples = samples;
  return image;
}

}  // namespace

std::vector<unsigned char> encode_exr(const Image& image, const ImageMetadata& metadata, int threads) {
  const std::string failure = "the picture cannot be encoded as EXR: ";
  set_pool(threads);
  MemoryFile memory;
  try {
    Imf::Header header = header_of(image, metadata);
    Imf::FrameBuffer channels;
    const std::vector<std::string> names = distinct_names(image.channels);
    const std::size_t pixel_bytes = names.size() * sizeof(float);
    std::vector<std::vector<half>> halves(names.size());
    for (std::size_t c = 0; c < names.size(); ++c) {
      if (image.has_half_colors && may_be_half(names[c])) {
        halves[c] = halves_of(image, c);
        header.channels().insert(names[c], Imf::Channel(Imf::HALF));
        channels.insert(names[c], Imf::Slice(Imf::HALF, reinterpret_cast<char*>(halves[c].data()), sizeof(half),
                                             sizeof(half) * image.width));
        continue;
      }
      header.channels().insert(names[c], Imf::Channel(Imf::FLOAT));
      char* const first = reinterpret_cast<char*>(const_cast<float*>(&image.pixels[c]));  // It is only read.
      channels.insert(names[c], Imf::Slice(Imf::FLOAT, first, pixel_bytes, pixel_bytes * image.width));
    }
    Imf::OutputFile file(memory, header);
    file.setFrameBuffer(channels);
    file.writePixels(image.height);
  } catch (const std::bad_alloc&) {
    throw std::runtime_error(failure + "there is not enough memory");
  } catch (const std::exception& error) {
    throw std::runtime_error(failure + one_line(error.what()));
  }
  return std::move(memory.bytes);
}

std::optional<NativeImage> read_luminance_chroma(const std::filesystem::path& path) {
  try {
    if (!is_luminance_chroma(path)) return std::nullopt;
    Imf::RgbaInputFile file(path.string().c_str());
    NativeImage image = read_pixels_of(file);
    if (Imf::hasChromaticities(file.header())) {
      const Imf::Chromaticities& c = Imf::chromaticities(file.header());
      image.tags.chromaticities = {c.red.x, c.red.y, c.green.x, c.green.y, c.blue.x, c.blue.y, c.white.x, c.white.y};
    }
    return image;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw std::runtime_error(one_line(error.what()));
  }
}

}  // namespace tensorray
