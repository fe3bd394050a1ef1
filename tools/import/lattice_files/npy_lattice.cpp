// The format: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/errors.h"
#include "base/text/byte_order.h"
#include "base/text/text.h"
#include "tools/import/lattice_files/lattice_files.h"
#include "tools/import/lattice_files/raw_voxels.h"

namespace tensorray {
namespace {

struct NpyHeader {
  std::string type;  ///< As number_type takes it.
  int number_bytes = 0;
  ByteOrder order = host_byte_order();
  bool fortran = false;  ///< The first index runs fastest.
  std::vector<std::size_t> shape;
  std::uint64_t data_start = 0;  ///< Offset in the file, in bytes.
};

std::string read_dictionary(std::ifstream& file, const std::filesystem::path& path, NpyHeader& header) {
  std::array<unsigned char, 12> start{};
  file.read(reinterpret_cast<char*>(start.data()), 10);
  if (std::memcmp(start.data(), "\x93NUMPY", 6) != 0) fail(path, "is not a .npy file of NumPy");
  const bool wide = start[6] >= 2;  // From version 2 on, the length has four bytes.
  if (wide) file.read(reinterpret_cast<char*>(start.data()) + 10, 2);
  if (!file || start[6] > 3) fail(path, "its .npy header is damaged or cut off");
  const std::size_t length = wide ? read_number<std::uint32_t>(start.data() + 8, ByteOrder::little)
                                  : read_number<std::uint16_t>(start.data() + 8, ByteOrder::little);
  constexpr std::size_t reasonable = 1 << 16;
  std::string text(std::min(length, reasonable), '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file || length > reasonable) fail(path, "its .npy header is damaged or cut off");
  header.data_start = (wide ? 12u : 10u) + length;
  return text;
}

/// The text after a key of the dictionary and its colon.
std::string value_of(const std::string& dictionary, const std::string& key, const std::filesystem::path& path) {
  const std::size_t found = dictionary.find("'" + key + "':");
  const std::size_t start =
      found == std::string::npos ? found : dictionary.find_first_not_of(' ', found + key.size() + 3);
  if (start == std::string::npos) fail(path, "its .npy header is damaged: no " + key);
  return dictionary.substr(start);
}

std::vector<std::size_t> shape_of(const std::string& text, const std::filesystem::path& path) {
  const std::size_t end = text.find(')');
  if (text[0] != '(' || end == std::string::npos) fail(path, "its .npy header is damaged: shape");
  std::string list = text.substr(1, end - 1);
  std::replace(list.begin(), list.end(), ',', ' ');
  std::istringstream stream(list);
  std::vector<std::size_t> shape;
  bool is_possible = true;
  for (std::string word; is_possible && stream >> word;) {
    char* rest = nullptr;
    const double extent = std::strtod(word.c_str(), &rest);
    is_possible =
        *rest == '\0' && extent >= 1 && extent <= std::numeric_limits<int>::max() && extent == std::floor(extent);
    if (is_possible) shape.push_back(static_cast<std::size_t>(extent));
  }
  if (!is_possible)
    fail(path, "its .npy header is damaged, or the array is empty: shape " + escaped(text.substr(0, end + 1)));
  return shape;
}

NpyHeader read_header(std::ifstream& file, const std::filesystem::path& path, bool is_mask) {
  NpyHeader header;
  const std::string dictionary = read_dictionary(file, path, header);
  const std::string descr = value_of(dictionary, "descr", path);
  const auto one_of = [&](std::size_t i, const std::string& characters) {
    return i < descr.size() && characters.find(descr[i]) != std::string::npos;
  };
  const bool real = one_of(2, "f") && one_of(3, "248"), whole = is_mask && one_of(2, "biu") && one_of(3, "1248");
  if (!one_of(0, "'") || !one_of(1, "<>=|") || !(real || whole) || !one_of(4, "'"))
    fail(path, "its numbers are not float16, float32 or float64: save array.astype(\"float32\")");
  header.number_bytes = descr[3] - '0';
  header.type = fmt::format("{}{}", real ? "float" : descr[2] == 'i' ? "int" : "uint", 8 * header.number_bytes);
  if (descr[1] == '<') header.order = ByteOrder::little;
  if (descr[1] == '>') header.order = ByteOrder::big;
  header.fortran = value_of(dictionary, "fortran_order", path).compare(0, 4, "True") == 0;
  header.shape = shape_of(value_of(dictionary, "shape", path), path);
  return header;
}

std::size_t component_count(const NpyHeader& header, const std::filesystem::path& path, bool is_mask) {
  const auto& shape = header.shape;
  if (is_mask && shape.size() == 3) return 1;
  if (is_mask) fail(path, fmt::format("its shape is ({}): a mask is (nz, ny, nx)", fmt::join(shape, ", ")));
  if (shape.size() == 5 && shape[3] == 3 && shape[4] == 3) return 9;
  if (shape.size() == 4 && (shape[3] == 9 || shape[3] == 6 || shape[3] == 3)) return shape[3];
  fail(path, fmt::format("its shape is ({}): a field of tensors is (nz, ny, nx, 3, 3), (nz, ny, nx, 9) or (nz, ny, nx, "
                         "6), one of vectors (nz, ny, nx, 3)",
                         fmt::join(shape, ", ")));
}

void check_size(const NpyHeader& header, const std::filesystem::path& path) {
  double needed = header.number_bytes;
  for (const std::size_t extent : header.shape) needed *= static_cast<double>(extent);
  const auto held = static_cast<double>(std::filesystem::file_size(path)) - static_cast<double>(header.data_start);
  if (needed == held) return;
  fail(path, fmt::format("its shape ({}) needs {:.0f} bytes of numbers, and there are {:.0f}: {}",
                         fmt::join(header.shape, ", "), needed, held,
                         held < needed ? "cut off, or a damaged header" : "a damaged header, or several arrays"));
}

}  // namespace

Lattice open_npy(const std::filesystem::path& path, bool is_mask) {
  require_file(path);
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(path, "cannot be read");
  const NpyHeader header = read_header(file, path, is_mask);
  const std::size_t components = component_count(header, path, is_mask);
  check_size(header, path);
  Lattice lattice;
  for (std::size_t i = 0; i < 3; ++i) lattice.size[static_cast<int>(i)] = static_cast<int>(header.shape[2 - i]);
  lattice.components = static_cast<int>(components);
  if (components == 9) lattice.order = TensorOrder::full;
  const std::int64_t n = lattice.components, x = lattice.size.x(), y = lattice.size.y(), z = lattice.size.z();
  RawVoxels voxels;
  voxels.type = number_type(path, header.type, "");
  voxels.order = header.order;
  voxels.strides = {n, n * x, n * x * y, 1};
  if (header.fortran) voxels.strides = {z * y, z, 1, z * y * x};
  voxels.by_columns = header.fortran && header.shape.size() == 5;
  voxels.bytes = read_numbers(path, {path, header.data_start}, voxels.type, lattice.size, lattice.components);
  lattice.read_slice = slices_of(std::move(voxels), lattice.size, lattice.components);
  return lattice;
}

}  // namespace tensorray
