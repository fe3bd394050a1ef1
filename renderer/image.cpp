#include "renderer/image.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
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

#include "renderer/file_error.h"

namespace tensorray {
namespace {

/// What a file format takes. OpenImageIO's name for it chooses the writer.
struct Format {
  std::string name;
  OIIO::TypeDesc type;
  bool display_referred = true;
  bool alpha = false;
  bool all_metadata = false;
};

Format find_format(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".exr") return {"openexr", OIIO::TypeDesc::FLOAT, false, true, true};
  if (ending == ".png") return {"png", OIIO::TypeDesc::UINT16, true, true, true};
  if (ending == ".jpg" || ending == ".jpeg") return {"jpeg", OIIO::TypeDesc::UINT8, true, false, false};
  if (ending == ".tif" || ending == ".tiff") return {"tiff", OIIO::TypeDesc::UINT16, true, true, false};
  std::string known;
  for (const std::string& each : image_endings()) known += (known.empty() ? "" : ", ") + each;
  throw std::runtime_error("unknown picture ending \"" + ending + "\"; known: " + known);
}

void check_size(const Image& image) {
  if (image.width < 1 || image.height < 1 || image.channels.empty())
    throw std::invalid_argument("a picture to be written must have pixels and channels");
  if (image.pixels.size() != static_cast<std::size_t>(image.width) * image.height * image.channels.size())
    throw std::invalid_argument("a picture's number of values must be width * height * channels");
}

/// The channels that a display-referred format holds, clipped.
Image clipped(const Image& image, bool alpha) {
  const std::size_t from = image.channels.size();
  const std::size_t to = from < 3 ? 1 : (alpha && from > 3 && image.channels[3] == "A") ? 4 : 3;
  Image result(image.width, image.height, {image.channels.begin(), image.channels.begin() + to});
  for (std::size_t pixel = 0; pixel * to < result.pixels.size(); ++pixel)
    for (std::size_t c = 0; c < to; ++c) {
      const float value = image.pixels[pixel * from + c];
      result.pixels[pixel * to + c] = value > 0 ? std::min(value, 1.0f) : 0.0f;  // Not a number: 0.
    }
  return result;
}

/// Attributes that TIFF and JPEG have a plain field for. Others would make OpenImageIO 2.4 write an Exif directory,
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
  if (format.name == "jpeg") {
    spec.attribute("Compression", "jpeg:95");
    spec.attribute("jpeg:subsampling", "4:4:4");
  }
  if (format.name == "png" || format.name == "jpeg") spec.attribute("oiio:ColorSpace", "sRGB");
  for (const auto& [name, value] : metadata)
    if (format.all_metadata || is_plain(name) || (format.name == "jpeg" && name == "oiio:ColorSpace"))
      spec.attribute(name, value);
  spec.attribute("DateTime", "");  // Keeps OpenImageIO from writing the time, which would differ from run to run.
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

/// A full disk may show as late as when the file is closed.
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

/// Whether a JPEG or PNG lacks its end. libjpeg fills what is missing with grey and says nothing; libpng prints.
bool is_cut_off(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(4, '\0');
  file.read(&bytes[0], 4);
  const bool jpeg = begins_with(bytes, "\xFF\xD8"), png = begins_with(bytes, "\x89PNG");
  if (!jpeg && !png) return false;
  bytes.append(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  if (png)
    return bytes.rfind("IEND\xAE\x42\x60\x82") == std::string::npos;  // The last chunk, which is always the same.
  // In the compressed data 0xFF is always followed by 0 or a restart marker, so that the first end marker after the
  // last start of a scan is the picture's own.
  const std::size_t scan = bytes.rfind("\xFF\xDA");
  return scan == std::string::npos || bytes.find("\xFF\xD9", scan) == std::string::npos;
}

Image decode(const std::filesystem::path& path) {
  if (is_cut_off(path)) throw std::runtime_error("the file is cut off");
  OIIO::ImageSpec as_it_is;
  as_it_is.attribute("oiio:UnassociatedAlpha", 1);
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string(), &as_it_is);
  if (!input) throw std::runtime_error(one_line(OIIO::geterror()));
  const OIIO::ImageSpec& spec = input->spec();
  Image image(spec.width, spec.height, spec.channelnames);
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels.data()))
    throw std::runtime_error(one_line(input->geterror()));
  input->close();
  return image;
}

}  // namespace

std::vector<std::string> image_endings() { return {".exr", ".png", ".jpg", ".jpeg", ".tif", ".tiff"}; }

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

Image read_image(const std::filesystem::path& path) {
  require_readable(path);
  try {
    return decode(path);
  } catch (const std::bad_alloc&) {
    throw std::runtime_error("cannot read " + path.string() + ": not enough memory for a picture of its size");
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read " + path.string() + ": " + error.what());
  }
}

}  // namespace tensorray
