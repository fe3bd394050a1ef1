#include <algorithm>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfTestFile.h>

#include "base/text/text.h"
#include "renderer/images/formats.h"

namespace tensorray {
namespace {

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
