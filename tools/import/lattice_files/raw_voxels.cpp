#include "tools/import/lattice_files/raw_voxels.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <utility>

#include <Eigen/LU>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <zlib.h>

#include "base/errors.h"
#include "base/files/descriptor.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

constexpr double max_expansion = 1032;        // Of zlib.
constexpr std::uint64_t page_size = 1 << 16;  // The largest of any system.

std::ifstream open_at(const std::filesystem::path& path, std::uint64_t offset) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(offset));
  if (!file) fail(path, "cannot be read");
  return file;
}

/// Inflates a stream, and gives its contents part by part to `take`, until this returns false.
template <class Take>
void inflate_stream(const RawPlace& place, const Take& take) {
  std::ifstream file = open_at(place.file, place.offset);
  z_stream stream{};
  constexpr int any_header = 47;  // the largest window; the header tells whether it is zlib or gzip
  if (inflateInit2(&stream, any_header) != Z_OK) throw std::bad_alloc();
  const std::unique_ptr<z_stream, decltype(&inflateEnd)> end(&stream, &inflateEnd);
  std::vector<char> in(1 << 16), out(1 << 18);
  for (int state = Z_OK; state != Z_STREAM_END;) {
    if (stream.avail_in == 0) {
      file.read(in.data(), static_cast<std::streamsize>(in.size()));
      if (file.gcount() == 0) return;  // Cut off: the caller counts what it got.
      stream.next_in = reinterpret_cast<Bytef*>(in.data());
      stream.avail_in = static_cast<uInt>(file.gcount());
    }
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    state = inflate(&stream, Z_NO_FLUSH);
    if (state != Z_OK && state != Z_STREAM_END) fail(place.file, "its compressed data are damaged");
    if (!take(out.data(), out.size() - stream.avail_out)) return;
    constexpr Bytef gzip = 0x1f;  // With which another stream begins.
    if (state == Z_STREAM_END && stream.avail_in > 0 && *stream.next_in == gzip) state = inflateReset(&stream);
  }
}

template <class Number>
double number(const char* bytes, ByteOrder order) {
  return static_cast<double>(read_number<Number>(bytes, order));
}

struct Mapping {
  void* pages = nullptr;
  std::size_t size = 0;

  void operator()(const char*) const { munmap(pages, size); }
};

/// @param size  > 0; the file has so many bytes.
std::shared_ptr<const char> map_bytes(const std::filesystem::path& path, std::uint64_t offset, std::size_t size) {
  const std::uint64_t begin = offset / page_size * page_size;
  const Descriptor file = open_file(path, O_RDONLY);
  Mapping mapping{nullptr, static_cast<std::size_t>(offset - begin) + size};
  mapping.pages = mmap(nullptr, mapping.size, PROT_READ, MAP_PRIVATE, file.get(), static_cast<off_t>(begin));
  if (mapping.pages == MAP_FAILED) fail(path, "cannot be read");
  return {static_cast<const char*>(mapping.pages) + (offset - begin), mapping};
}

const NumberType number_types[] = {
    {"int8", 1, number<std::int8_t>},     {"uint8", 1, number<std::uint8_t>},   {"int16", 2, number<std::int16_t>},
    {"uint16", 2, number<std::uint16_t>}, {"int32", 4, number<std::int32_t>},   {"uint32", 4, number<std::uint32_t>},
    {"int64", 8, number<std::int64_t>},   {"uint64", 8, number<std::uint64_t>}, {"float16", 2, number<Eigen::half>},
    {"float32", 4, number<float>},        {"float64", 8, number<double>},       {"bit", 0, nullptr}};

}  // namespace

void require_file(const std::filesystem::path& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) fail(path, "no such file");
}

void require_invertible(const std::filesystem::path& path, const Eigen::Affine3d& transform,
                        const std::string& is_what) {
  const Eigen::Matrix3d linear = transform.linear();
  if (!transform.matrix().allFinite() || !(std::abs(linear.determinant()) > 1e-9 * linear.colwise().norm().prod()))
    fail(path, is_what);
}

NumberType number_type(const std::filesystem::path& path, const std::string& name, const std::string& shown) {
  for (const NumberType& type : number_types)
    if (lower_case(name) == type.name) return type;
  fail(path, "its numbers are " + escaped(shown) + ", not integers or reals");
}

std::vector<char, PageAllocator<char>> read_some(const RawPlace& place, std::size_t count) {
  std::vector<char, PageAllocator<char>> bytes;
  if (!place.is_compressed) {
    std::ifstream file = open_at(place.file, place.offset + place.skipped);
    bytes.resize(count);
    file.read(bytes.data(), static_cast<std::streamsize>(count));
    bytes.resize(static_cast<std::size_t>(file.gcount()));
    return bytes;
  }
  std::uint64_t before = place.skipped;
  inflate_stream(place, [&](const char* part, std::size_t size) {
    const std::size_t skip = std::min<std::uint64_t>(before, size);
    before -= skip;
    const std::size_t taken = std::min(size - skip, count - bytes.size());
    bytes.insert(bytes.end(), part + skip, part + skip + taken);
    return bytes.size() < count;
  });
  return bytes;
}

std::string HeaderLines::text(const std::string& name) const {
  const auto found = values.find(name);
  return found == values.end() ? "" : found->second;
}

std::vector<double> HeaderLines::numbers(const std::string& name, std::vector<double> standard) const {
  std::string list = text(name);
  if (list.empty()) return standard;
  std::replace(list.begin(), list.end(), ',', ' ');
  std::istringstream words(list);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    char* rest = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &rest));
    if (*rest != '\0') fail(path, "its header is damaged: " + name);
  }
  return numbers;
}

HeaderLines header_lines(const RawPlace& place, char separator, const std::string& last) {
  const auto bytes = read_some(place, 1 << 22);
  std::istringstream stream(std::string(bytes.begin(), bytes.end()));
  HeaderLines header{place.file, {}, 0};
  for (std::string line, name; name != last && std::getline(stream, line);) {
    header.end += line.size() + (stream.eof() ? 0 : 1);
    const std::size_t sign = std::min(line.find(separator), line.size());
    name = trimmed(line.substr(0, sign));
    if (sign == line.size()) continue;
    std::string& value = header.values[name];
    value += (value.empty() ? "" : "\n") + trimmed(line.substr(sign + 1));
  }
  return header;
}

std::shared_ptr<const char> read_numbers(const std::filesystem::path& path, const RawPlace& place,
                                         const NumberType& type, const Eigen::Vector3i& size, int components) {
  std::error_code none;
  const std::uintmax_t bytes = std::filesystem::file_size(place.file, none);
  if (none || !std::filesystem::is_regular_file(place.file, none))
    fail(path, "its data file " + place.file.string() + " is missing");
  const double needed = std::ceil(size.cast<double>().prod() * components * (type.bytes > 0 ? type.bytes : 1.0 / 8));
  const double held = static_cast<double>(bytes) - static_cast<double>(place.offset);
  if (needed + static_cast<double>(place.skipped) > held * (place.is_compressed ? max_expansion : 1))
    fail(path, fmt::format("announces {:.0f} bytes of numbers, and holds no more than {:.0f}: cut off, or a damaged "
                           "header",
                           needed, std::max(0.0, held - static_cast<double>(place.skipped))));
  const auto count = static_cast<std::size_t>(needed);
  if (!place.is_compressed) return map_bytes(place.file, place.offset + place.skipped, count);
  // One byte more, because zlib compares checksums only at the end of a stream.
  const auto numbers = std::make_shared<std::vector<char, PageAllocator<char>>>(read_some(place, count + 1));
  if (numbers->size() < count) fail(path, "is cut off, or its compressed data are damaged");
  return {numbers, numbers->data()};
}

std::function<void(int z, double* values)> slices_of(RawVoxels voxels, const Eigen::Vector3i& size, int components) {
  const auto held = std::make_shared<const RawVoxels>(std::move(voxels));
  return [held, size, components](int z, double* values) {
    const auto& [x_stride, y_stride, z_stride, component_stride] = held->strides;
    for (int y = 0; y < size.y(); ++y)
      for (int x = 0; x < size.x(); ++x)
        for (int c = 0; c < components; ++c) {
          const int component = held->by_columns ? c % 3 * 3 + c / 3 : c;
          const std::int64_t index =
              held->first + x * x_stride + y * y_stride + z * z_stride + component * component_stride;
          const char* const bytes = held->bytes.get() + (held->type.read ? index * held->type.bytes : index / 8);
          const double number = held->type.read ? held->type.read(bytes, held->order) : *bytes >> (7 - index % 8) & 1;
          *values++ = held->slope * number + held->intercept;
        }
    // They need not stay in memory: the system has the file.
    if (const auto* const mapping = std::get_deleter<Mapping>(held->bytes))
      madvise(mapping->pages, mapping->size, MADV_DONTNEED);
  };
}

}  // namespace tensorray
