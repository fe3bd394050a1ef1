#include "tools/import/vtk_formats/netcdf_size.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <vector>

#include "base/text/byte_order.h"

namespace tensorray {
namespace {

struct BadHeader : std::runtime_error {
  BadHeader() : std::runtime_error("damaged netCDF header") {}
};

/// @throw BadHeader if the result needs more than 64 bits.
std::uint64_t sum(std::uint64_t a, std::uint64_t b) {
  if (a > std::numeric_limits<std::uint64_t>::max() - b) throw BadHeader();
  return a + b;
}

std::uint64_t product(std::uint64_t a, std::uint64_t b) {
  if (b != 0 && a > std::numeric_limits<std::uint64_t>::max() / b) throw BadHeader();
  return a * b;
}

/// The size after netCDF's padding to a multiple of four bytes.
std::uint64_t padded(std::uint64_t bytes) { return sum(bytes, 3) / 4 * 4; }

/// Reads the big-endian numbers of a header. Their sizes depend on the version.
class Header {
 public:
  /// @param size  Size of the file, bytes.
  Header(std::istream& stream, std::uint64_t size) : stream_(stream), size_(size) {
    char magic[4];
    if (!stream_.read(magic, 4) || magic[0] != 'C' || magic[1] != 'D' || magic[2] != 'F') throw BadHeader();
    version_ = magic[3];
    if (version_ != 1 && version_ != 2 && version_ != 5) throw BadHeader();
  }

  /// @param bytes  4 or 8.
  std::uint64_t integer(int bytes) {
    std::array<char, 8> read{};
    if (!stream_.read(read.data(), bytes)) throw BadHeader();
    if (bytes == 4) return read_number<std::uint32_t>(read.data(), ByteOrder::big);
    return read_number<std::uint64_t>(read.data(), ByteOrder::big);
  }

  std::uint64_t count() { return integer(version_ == 5 ? 8 : 4); }
  std::uint64_t offset() { return integer(version_ == 1 ? 4 : 8); }

  /// Reads the length of a list. Every element takes at least one byte and reading always moves forward, so a damaged
  /// length ends at the end of the file.
  std::uint64_t list() {
    integer(4);  // The list's tag.
    return count();
  }

  void skip(std::uint64_t bytes) {
    if (padded(bytes) > size_) throw BadHeader();  // A seek would read greater sizes as negative.
    stream_.seekg(static_cast<std::streamoff>(padded(bytes)), std::ios::cur);
    if (!stream_) throw BadHeader();
  }

  void skip_name() { skip(count()); }

  /// Reads a type. @return the size of a number of this type, bytes.
  std::uint64_t type_size() {
    static constexpr int sizes[] = {0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
    const std::uint64_t type = integer(4);
    if (type < 1 || type > 11) throw BadHeader();
    return static_cast<std::uint64_t>(sizes[type]);
  }

  void skip_attributes() {
    for (std::uint64_t left = list(); left > 0; --left) {
      skip_name();
      const std::uint64_t size = type_size();
      skip(product(count(), size));
    }
  }

 private:
  std::istream& stream_;
  std::uint64_t size_;
  int version_;
};

struct Variable {
  std::uint64_t begin = 0, size = 0;
  bool is_record = false;
};

std::vector<std::uint64_t> read_dimensions(Header& header) {
  std::vector<std::uint64_t> dimensions;
  for (std::uint64_t left = header.list(); left > 0; --left) {
    header.skip_name();
    dimensions.push_back(header.count());  // 0 marks the record dimension.
  }
  return dimensions;
}

Variable read_variable(Header& header, const std::vector<std::uint64_t>& dimensions) {
  Variable variable;
  header.skip_name();
  std::uint64_t elements = 1;
  for (std::uint64_t left = header.count(), i = 0; i < left; ++i) {
    const std::uint64_t dimension = header.count();
    if (dimension >= dimensions.size()) throw BadHeader();
    if (dimensions[dimension] == 0)
      variable.is_record = true;
    else
      elements = product(elements, dimensions[dimension]);
  }
  header.skip_attributes();
  variable.size = product(elements, header.type_size());
  header.count();  // Ignore the stored size: it overflows for large variables.
  variable.begin = header.offset();
  return variable;
}

/// Also of dimensions that no variable has, a reader takes memory for each element.
std::uint64_t longest(const std::vector<std::uint64_t>& dimensions) {
  return dimensions.empty() ? 0 : *std::max_element(dimensions.begin(), dimensions.end());
}

std::uint64_t needed_size(std::istream& stream, std::uint64_t file_size) {
  Header header(stream, file_size);
  const std::uint64_t records = header.count();
  if (records == 0xffffffffu) throw BadHeader();  // The value means "count the records": the file was never closed.
  const std::vector<std::uint64_t> dimensions = read_dimensions(header);
  header.skip_attributes();
  std::vector<Variable> variables;
  for (std::uint64_t left = header.list(); left > 0; --left) variables.push_back(read_variable(header, dimensions));
  std::uint64_t record_size = 0;
  for (const Variable& variable : variables)
    if (variable.is_record) record_size = sum(record_size, padded(variable.size));
  std::uint64_t size = longest(dimensions);
  for (const Variable& variable : variables) {
    if (variable.is_record && records == 0) continue;
    const std::uint64_t before = variable.is_record ? product(records - 1, record_size) : 0;
    size = std::max(size, sum(sum(variable.begin, before), variable.size));
  }
  return size;
}

}  // namespace

std::optional<std::uint64_t> netcdf_size(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  try {
    return needed_size(stream, std::filesystem::file_size(path));
  } catch (const BadHeader&) {
    return std::nullopt;
  }
}

}  // namespace tensorray
