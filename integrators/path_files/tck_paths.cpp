// Tracks of MRtrix (mrtrix.readthedocs.io, "Image and other file formats", "Tracks file format"): a header of
// `key: value` lines, then triplets. A triplet of NaNs ends a track, a triplet of infinities ends the file.

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <tbb/parallel_for.h>

#include "base/errors.h"
#include "base/text/byte_order.h"
#include "base/text/text.h"
#include "integrators/path_files/path_files.h"

namespace tensorray {
namespace {

const std::string magic = "mrtrix tracks";
constexpr std::size_t tracks_together = 4096;  // Tracks that one thread converts.

void put(const Eigen::Vector3d& triplet, std::string& text) {
  for (const double x : triplet) append_number(static_cast<float>(x), ByteOrder::little, text);
}

void put(const Path& path, std::string& text) {
  text.reserve(text.size() + 3 * sizeof(float) * (path.points.size() + 1));
  for (const PathPoint& point : path.points) put(point.position, text);
  put(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()), text);
}

std::string header_text(std::size_t count) {
  const std::string before = magic + "\ndatatype: Float32LE\ncount: " + std::to_string(count) + "\nfile: . ";
  const std::string behind = "\nEND\n";
  // The offset includes the digits of the offset itself.
  std::size_t offset = before.size() + behind.size();
  while (before.size() + std::to_string(offset).size() + behind.size() != offset) ++offset;
  return before + std::to_string(offset) + behind;
}

struct Header {
  int bytes = 0;  ///< Size of a number.
  ByteOrder order = ByteOrder::little;
  std::optional<std::uint64_t> count;  ///< Number of tracks.
  std::uint64_t offset = 0;            ///< Offset of the first triplet in the file.
};

std::uint64_t to_number(const std::string& key, const std::string& text) {
  std::uint64_t number = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), number);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size())
    throw std::runtime_error("\"" + key + "\" in its header is not a number");
  return number;
}

void parse_line(const std::string& line, Header& header) {
  const std::size_t colon = line.find(':');
  if (colon == std::string::npos) return;
  const std::string key = trimmed(line.substr(0, colon)), value = trimmed(line.substr(colon + 1));
  if (key == "datatype") {
    if (value != "Float32LE" && value != "Float32BE" && value != "Float64LE" && value != "Float64BE")
      throw std::runtime_error("its datatype is not Float32LE, Float32BE, Float64LE or Float64BE");
    header.bytes = value.compare(5, 2, "32") == 0 ? 4 : 8;
    header.order = ends_with(value, "LE") ? ByteOrder::little : ByteOrder::big;
  } else if (key == "count") {
    header.count = to_number(key, value);
  } else if (key == "file") {
    if (value.compare(0, 1, ".") != 0)
      throw std::runtime_error("its tracks are in another file; write both as one, with \"file: .\" in the header");
    header.offset = to_number(key, trimmed(value.substr(1)));
  }
}

Header read_header(std::ifstream& file, std::uint64_t file_size) {
  constexpr std::size_t longest_first_line = 100, longest_line = 1 << 20;  // Longer lines mean another format.
  Header header;
  std::string line;
  bool first = true;
  for (char c; file.get(c);) {
    if (c != '\n') {
      line += c;
      if (line.size() > (first ? longest_first_line : longest_line)) break;
      continue;
    }
    line = trimmed(line);
    if (first && line != magic) break;
    if (line == "END") {
      if (header.bytes == 0) throw std::runtime_error("its header has no datatype");
      if (header.offset < static_cast<std::uint64_t>(file.tellg()) || header.offset > file_size)
        throw std::runtime_error("the offset in its header points to no place behind it; the file is damaged");
      return header;
    }
    if (!first) parse_line(line, header);
    first = false;
    line.clear();
  }
  throw std::runtime_error(first ? "it is not a file of MRtrix tracks" : "its header is cut off");
}

Eigen::Vector3d read_triplet(std::ifstream& file, const Header& header) {
  std::array<char, 24> bytes;
  if (!file.read(bytes.data(), 3 * header.bytes))
    throw std::runtime_error("the file is cut off: it ends before its tracks do");
  Eigen::Vector3d triplet;
  for (int axis = 0; axis < 3; ++axis) {
    const char* const number = bytes.data() + axis * header.bytes;
    triplet[axis] = header.bytes == 4 ? double{read_number<float>(number, header.order)}
                                      : read_number<double>(number, header.order);
  }
  return triplet;
}

}  // namespace

void write_tck_paths(const std::filesystem::path& path, const std::vector<Path>& paths) {
  const auto has_points = [](const Path& line) { return !line.points.empty(); };
  std::ofstream file(path, std::ios::binary);
  file << header_text(static_cast<std::size_t>(std::count_if(paths.begin(), paths.end(), has_points)));
  const auto write = [&](const std::string& bytes) {
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  };
  std::vector<std::string> tracks((paths.size() + tracks_together - 1) / tracks_together);
  tbb::parallel_for(std::size_t{0}, tracks.size(), [&](std::size_t i) {
    for (std::size_t k = i * tracks_together; k < std::min((i + 1) * tracks_together, paths.size()); ++k)
      if (has_points(paths[k])) put(paths[k], tracks[i]);
  });
  for (const std::string& bytes : tracks) write(bytes);
  std::string end;
  put(Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), end);
  write(end);
  file.close();
  if (!file) fail(path, "cannot be written; check the path and the space on the disk");
}

std::vector<Path> read_tck_paths(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const Header header = read_header(file, std::filesystem::file_size(path));
  file.seekg(static_cast<std::streamoff>(header.offset));
  std::vector<Path> paths;
  std::vector<Eigen::Vector3d> positions;
  std::uint64_t count = 0;
  while (true) {
    const Eigen::Vector3d triplet = read_triplet(file, header);
    if (triplet.allFinite()) {
      positions.push_back(triplet);
      continue;
    }
    const bool ends = triplet.array().isInf().all();
    if (!ends && !triplet.array().isNaN().all())
      throw std::runtime_error("a point of track " + std::to_string(count) + " is not finite; the file is damaged");
    if (!ends || !positions.empty()) {
      ++count;
      Path line;
      line.points = bare_way(positions);
      if (!line.points.empty()) paths.push_back(std::move(line));
      positions.clear();
    }
    if (ends) break;
  }
  if (header.count && *header.count != count)
    throw std::runtime_error("its header gives " + std::to_string(*header.count) + " tracks, but the file holds " +
                             std::to_string(count) + "; the file is damaged or incomplete");
  return paths;
}

}  // namespace tensorray
