#include "tools/import/netcdf_size.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace tensorray {
namespace {

struct BadHeader : std::runtime_error {
  BadHeader() : std::runtime_error("damaged netCDF header") {}
};

/// Reads the header's numbers, big-endian, in the widths of its version.
class Header {
 public:
  explicit Header(std::istream& stream) : stream_(stream) {
    char magic[4];
    if (!stream_.read(magic, 4) || magic[0] != 'C' || magic[1] != 'D' || magic[2] != 'F') throw BadHeader();
    version_ = magic[3];
    if (version_ != 1 && version_ != 2 && version_ != 5) throw BadHeader();
  }

  std::uint64_t integer(int bytes) {
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) {
      const int byte = stream_.get();
      if (byte < 0) throw BadHeader();
      value = value << 8 | static_cast<std::uint64_t>(byte);
    }
    return value;
  }

  std::uint64_t count() { return integer(version_ == 5 ? 8 : 4); }
  std::uint64_t offset() { return integer(version_ == 1 ? 4 : 8); }

  /// A list's length; each of its elements takes some bytes, so that a damaged length runs into the end of the file.
  std::uint64_t list() {
    integer(4);  // Its tag.
    return count();
  }

  void skip(std::uint64_t bytes) {
    stream_.seekg(static_cast<std::streamoff>((bytes + 3) / 4 * 4), std::ios::cur);
    if (!stream_) throw BadHeader();
  }

  void skip_name() { skip(count()); }

  /// @return bytes of a number of the type that comes next.
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
      skip(count() * size);
    }
  }

 private:
  std::istream& stream_;
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
    dimensions.push_back(header.count());  // 0: the record dimension.
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
      elements *= dimensions[dimension];
  }
  header.skip_attributes();
  variable.size = elements * header.type_size();
  header.count();  // The size as it was written, which overflows for large variables.
  variable.begin = header.offset();
  return variable;
}

std::uint64_t needed_size(std::istream& stream) {
  Header header(stream);
  const std::uint64_t records = header.count();
  if (records == 0xffffffffu) throw BadHeader();  // "Count them": of a file that was never closed.
  const std::vector<std::uint64_t> dimensions = read_dimensions(header);
  header.skip_attributes();
  std::vector<Variable> variables;
  for (std::uint64_t left = header.list(); left > 0; --left) variables.push_back(read_variable(header, dimensions));
  std::uint64_t record_size = 0;
  for (const Variable& variable : variables)
    if (variable.is_record) record_size += (variable.size + 3) / 4 * 4;
  std::uint64_t size = 0;
  for (const Variable& variable : variables) {
    if (variable.is_record && records == 0) continue;
    const std::uint64_t before = variable.is_record ? (records - 1) * record_size : 0;
    size = std::max(size, variable.begin + before + variable.size);
  }
  return size;
}

}  // namespace

std::optional<std::uint64_t> netcdf_size(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  try {
    return needed_size(stream);
  } catch (const BadHeader&) {
    return std::nullopt;
  }
}

}  // namespace tensorray
