#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text/byte_order.h"
#include "tools/import/cases/case_files.h"

namespace tensorray {
namespace {

struct BadHeader {};

/// Reads the big-endian numbers of a header. Their sizes depend on the version. As doubles they do not overflow, and
/// are exact up to the length of any file.
class Header {
 public:
  explicit Header(const std::filesystem::path& path)
      : stream_(path, std::ios::binary), size_(static_cast<double>(std::filesystem::file_size(path))) {
    char magic[4];
    if (!stream_.read(magic, 4) || magic[0] != 'C' || magic[1] != 'D' || magic[2] != 'F') throw BadHeader();
    version_ = magic[3];
  }

  /// @param bytes  4 or 8.
  double number(int bytes) {
    std::array<char, 8> read{};
    if (!stream_.read(read.data(), bytes)) throw BadHeader();
    if (bytes == 4) return read_number<std::uint32_t>(read.data(), ByteOrder::big);
    return static_cast<double>(read_number<std::uint64_t>(read.data(), ByteOrder::big));
  }

  double count() { return number(version_ == 5 ? 8 : 4); }
  double offset() { return number(version_ == 1 ? 4 : 8); }

  /// Calls `read` for each element of a list. Each takes at least one byte, so that a damaged length ends with the
  /// file.
  template <class Read>
  void list(const Read& read) {
    number(4);  // The list's tag.
    for (double left = count(); left > 0; --left) read();
  }

  void skip(double bytes) {
    if (bytes > size_) throw BadHeader();
    stream_.seekg(static_cast<std::streamoff>(padded(bytes)), std::ios::cur);
  }

  void skip_name() { skip(count()); }

  /// Reads a type. @return the size of a number of this type, bytes.
  double type_size() {
    static constexpr std::array sizes{0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
    const double type = number(4);
    if (type < 1 || type >= sizes.size()) throw BadHeader();
    return sizes[static_cast<std::size_t>(type)];
  }

  void skip_attributes() {
    list([this] {
      skip_name();
      const double size = type_size();
      skip(size * count());
    });
  }

  /// With netCDF's padding to a multiple of four bytes.
  static double padded(double bytes) { return 4 * std::ceil(bytes / 4); }

 private:
  std::ifstream stream_;
  double size_;
  int version_ = 0;
};

double needed_size(Header& header) {
  const double records = header.count();
  if (records == 0xffffffffu) throw BadHeader();  // The value means "count the records": the file was never closed.
  std::vector<double> dimensions;                 // 0 marks that of the records.
  double needed = 0, record_end = 0, record_size = 0;
  header.list([&] {
    header.skip_name();
    dimensions.push_back(header.count());
    needed = std::max(needed, dimensions.back());  // For which readers take memory.
  });
  header.skip_attributes();
  header.list([&] {
    header.skip_name();
    double size = 1;
    bool is_record = false;
    for (double left = header.count(); left > 0; --left) {
      const double dimension = header.count();
      if (dimension >= static_cast<double>(dimensions.size())) throw BadHeader();
      const double extent = dimensions[static_cast<std::size_t>(dimension)];
      is_record = is_record || extent == 0;
      size *= extent == 0 ? 1 : extent;
    }
    header.skip_attributes();
    size *= header.type_size();
    header.count();  // The size itself, which overflows for large variables.
    double& end = is_record ? record_end : needed;
    end = std::max(end, header.offset() + size);
    if (is_record) record_size += Header::padded(size);
  });
  return record_end > 0 && records > 0 ? std::max(needed, record_end + (records - 1) * record_size) : needed;
}

}  // namespace

void require_whole_netcdf(const std::filesystem::path& path) {
  double needed = 0;
  try {
    Header header(path);
    needed = needed_size(header);
  } catch (const BadHeader&) {
    return;
  }
  const auto held = static_cast<double>(std::filesystem::file_size(path));
  if (held < needed)
    fail(path, fmt::format("is cut off: it has {:.0f} of {:.0f} bytes; copy or write it again", held, needed));
}

}  // namespace tensorray
