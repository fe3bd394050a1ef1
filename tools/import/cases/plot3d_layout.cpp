#include "tools/import/cases/plot3d_layout.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/text/byte_order.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

enum class Contents { grid, q };

/// More points than any file holds. The length of so many points in bytes still fits 64 bits.
constexpr std::uintmax_t greatest_points = std::uintmax_t{1} << 50;

/// The bytes of a file that are needed to find its layout.
struct Bytes {
  std::ifstream file;
  std::uintmax_t size = 0;

  std::optional<std::int32_t> integer(std::uintmax_t offset, bool big_endian) {
    std::array<char, 4> read{};
    file.clear();
    file.seekg(static_cast<std::streamoff>(offset));
    if (!file.read(read.data(), 4)) return {};
    return read_number<std::int32_t>(read.data(), big_endian ? ByteOrder::big : ByteOrder::little);
  }

  bool zeros_from(std::uintmax_t offset) {
    file.clear();
    file.seekg(static_cast<std::streamoff>(offset));
    return std::all_of(std::istreambuf_iterator<char>(file), {}, [](char c) { return c == 0; });
  }
};

Bytes open_binary(const Path& path) {
  if (!std::filesystem::exists(path)) fail(path, "does not exist; PLOT3D needs two files, the grid and its q file");
  if (!std::filesystem::is_regular_file(path)) fail(path, "is not a file");
  Bytes bytes{std::ifstream(path, std::ios::binary), std::filesystem::file_size(path)};
  if (!bytes.file) fail(path, "cannot be opened; check that it may be read");
  std::string head(64, '\0');
  bytes.file.read(head.data(), 64);
  head.resize(static_cast<std::size_t>(bytes.file.gcount()));
  if (head.empty()) fail(path, "is empty; write it again");
  if (std::all_of(head.begin(), head.end(), [](unsigned char c) { return std::isprint(c) || std::isspace(c); })) {
    fail(path, "is text; PLOT3D is read as binary, write it unformatted");
  }
  return bytes;
}

/// The lengths of the records of one block.
std::vector<std::uintmax_t> records_of(const Plot3dLayout& layout, Contents contents) {
  const auto real = static_cast<std::uintmax_t>(layout.real_size);
  const std::uintmax_t points = layout.points();
  std::vector<std::uintmax_t> records;
  if (layout.block_count) records.push_back(4);
  records.push_back(12);
  if (contents == Contents::grid) {
    records.push_back(points * (3 * real + (layout.blanking ? 4 : 0)));
  } else {
    records.push_back(4 * real);  // Mach number, angle of attack, Reynolds number, time
    records.push_back(points * 5 * real);
  }
  return records;
}

/// Returns the length of the whole file in bytes; sets `layout.numbers`.
std::uintmax_t set_offsets(Plot3dLayout& layout, Contents contents) {
  const std::uintmax_t mark = layout.record_marks ? 4 : 0;
  std::uintmax_t end = 0;
  for (const std::uintmax_t record : records_of(layout, contents)) {
    layout.numbers = end + mark;
    end += record + 2 * mark;
  }
  return end;
}

bool marks_fit(Bytes& bytes, const Plot3dLayout& layout, Contents contents) {
  std::uintmax_t offset = 0;
  for (const std::uintmax_t record : records_of(layout, contents)) {
    for (const std::uintmax_t mark : {offset, offset + 4 + record}) {
      const auto value = bytes.integer(mark, layout.big_endian);
      if (!value || static_cast<std::uint32_t>(*value) != record) return false;
    }
    offset += record + 8;
  }
  return true;
}

/// The beginning of the file, read as one of the eight kinds of headers (byte order, marks, count); empty if it is
/// not of that kind.
struct Header {
  Plot3dLayout layout;  ///< Precision and blanking are not yet set.
  int blocks = 1;
  bool flat = false;  ///< There are two sizes, not three. Only record marks tell this.
};

std::optional<Header> read_header(Bytes& bytes, bool big_endian, bool marks, bool count) {
  Header header;
  header.layout.big_endian = big_endian;
  header.layout.record_marks = marks;
  header.layout.block_count = count;
  std::uintmax_t offset = 0;
  if (count) {
    if (marks && (bytes.integer(0, big_endian) != 4 || bytes.integer(8, big_endian) != 4)) return {};
    const auto blocks = bytes.integer(marks ? 4 : 0, big_endian);
    if (!blocks || *blocks < 1 || *blocks > 100000) return {};
    header.blocks = *blocks;
    offset = marks ? 12 : 4;
  }
  if (marks) {
    const auto length = bytes.integer(offset, big_endian);
    header.flat = length == 8 * header.blocks;
    if (!header.flat && length != 12 * header.blocks) return {};
    offset += 4;
  }
  for (int axis = 0; axis < (header.flat ? 2 : 3); ++axis) {
    const auto n = bytes.integer(offset + 4 * static_cast<std::uintmax_t>(axis), big_endian);
    if (!n || *n < 1 || *n > (1 << 20)) return {};
    header.layout.size[axis] = *n;
  }
  if (header.layout.points() > greatest_points) return {};
  return header;
}

struct Candidate {
  Plot3dLayout layout;
  std::uintmax_t length = 0;
};

/// All layouts that the headers allow.
std::vector<Candidate> candidates_of(const Path& path, Bytes& bytes, Contents contents) {
  std::vector<Candidate> candidates;
  for (const int bits : {0, 1, 2, 3, 4, 5, 6, 7}) {
    const bool marks = bits & 4;
    const auto header = read_header(bytes, bits & 1, marks, bits & 2);
    if (!header) continue;
    // Without marks, a block count is only a guess. A file with several blocks then fits no layout, and is reported
    // later.
    if (marks && header->flat) fail(path, "is two-dimensional; PLOT3D is read in three dimensions");
    if (marks && header->blocks > 1) {
      fail(path, "has " + std::to_string(header->blocks) + " blocks; write the one that matters alone");
    }
    if (header->blocks > 1) continue;
    for (const int real_size : {4, 8}) {
      for (const bool blanking : {false, true}) {
        if (blanking && contents == Contents::q) continue;
        Candidate candidate{header->layout, 0};
        candidate.layout.real_size = real_size;
        candidate.layout.blanking = blanking;
        candidate.length = set_offsets(candidate.layout, contents);
        candidates.push_back(candidate);
      }
    }
  }
  return candidates;
}

/// The number of blocks if a file without marks has the length of several blocks; 0 otherwise.
int blocks_that_fit(Bytes& bytes, bool big_endian, Contents contents) {
  const auto blocks = bytes.integer(0, big_endian);
  if (!blocks || *blocks < 2 || *blocks > 100000) return 0;
  for (const int real_size : {4, 8}) {
    for (const std::uintmax_t blanking : {0, 4}) {
      std::uintmax_t length = 4;
      for (std::uintmax_t block = 0; block < static_cast<std::uintmax_t>(*blocks) && length <= bytes.size; ++block) {
        std::uintmax_t points = 1;
        for (std::uintmax_t axis = 0; axis < 3; ++axis) {
          const std::int32_t n = bytes.integer(4 + 12 * block + 4 * axis, big_endian).value_or(0);
          if (n < 1 || n > (1 << 20)) return 0;
          points *= static_cast<std::uintmax_t>(n);
        }
        if (points > greatest_points) return 0;
        const auto real = static_cast<std::uintmax_t>(real_size);
        length += 12 + (contents == Contents::grid ? points * (3 * real + blanking) : (4 + 5 * points) * real);
      }
      if (length == bytes.size) return *blocks;
    }
  }
  return 0;
}

Plot3dLayout find_layout(const Path& path, Contents contents, const Eigen::Vector3i* size) {
  Bytes bytes = open_binary(path);
  std::vector<Candidate> candidates = candidates_of(path, bytes, contents);
  for (const bool big_endian : {false, true}) {
    if (const int blocks = blocks_that_fit(bytes, big_endian, contents)) {
      fail(path, "has " + std::to_string(blocks) + " blocks; write the one that matters alone");
    }
  }
  const auto shape = [](const Eigen::Vector3i& n) {
    return std::to_string(n.x()) + "x" + std::to_string(n.y()) + "x" + std::to_string(n.z());
  };
  const auto is_other = [&](const Candidate& candidate) { return size && candidate.layout.size != *size; };
  const std::string what = contents == Contents::grid ? "PLOT3D grid" : "q file";

  constexpr std::uintmax_t page = 4096;
  const Candidate* best = nullptr;
  for (const Candidate& candidate : candidates) {
    if (candidate.length > bytes.size || bytes.size - candidate.length >= page) continue;
    if (candidate.layout.record_marks && !marks_fit(bytes, candidate.layout, contents)) continue;
    if (bytes.size > candidate.length && !bytes.zeros_from(candidate.length)) continue;
    // Of the layouts that fit, prefer those with marks, because more must fit; then those with the least padding.
    const auto rank = [](const Candidate& c) { return std::pair(c.layout.record_marks, c.length); };
    if (!best || rank(candidate) > rank(*best)) best = &candidate;
  }
  if (best && is_other(*best)) {
    fail(path, "is the q file of a grid of " + shape(best->layout.size) + " points, and the grid has " + shape(*size));
  }
  if (best) return best->layout;

  candidates.erase(std::remove_if(candidates.begin(), candidates.end(), is_other), candidates.end());
  const auto shortest = std::min_element(candidates.begin(), candidates.end(),
                                         [](const Candidate& a, const Candidate& b) { return a.length < b.length; });
  const std::string have = std::to_string(bytes.size) + " bytes";
  if (shortest == candidates.end()) fail(path, "is no " + what + (size ? " of " + shape(*size) + " points" : ""));
  fail(path, (shortest->length > bytes.size ? "is cut off, or no " : "is no ") + what + ": its " + have +
                 " fit no layout of " + shape(shortest->layout.size) + " points, of which the least needs " +
                 std::to_string(shortest->length));
}

}  // namespace

Plot3dLayout plot3d_grid_layout(const Path& path) { return find_layout(path, Contents::grid, nullptr); }

Plot3dLayout plot3d_q_layout(const Path& path, const Eigen::Vector3i& size) {
  return find_layout(path, Contents::q, &size);
}

}  // namespace tensorray
