#include "volumes/points/poly_data.h"

#include <fstream>
#include <iterator>
#include <stdexcept>

#include "base/process/archive.h"

namespace tensorray {
namespace {

const std::string lines_magic = "tensorray poly lines 2\n";

void copy_arrays(Archive& archive, std::map<std::string, DataArray>& arrays) {
  std::size_t count = arrays.size();
  archive.copy(count);
  auto next = arrays.begin();
  for (std::size_t i = 0; i < count; ++i) {
    std::string name = archive.reads() ? std::string() : next->first;
    archive.copy_list(name);
    DataArray& array = archive.reads() ? arrays[name] : next++->second;
    archive.copy(array.components);
    archive.copy_list(std::get<std::vector<double>>(array.values));
  }
}

void copy_lines(Archive& archive, std::string& begin, PolylineData& lines) {
  archive.copy_list(begin);
  archive.copy_list(lines.points);
  archive.copy_list(lines.line_ends);
  copy_arrays(archive, lines.point_data);
  copy_arrays(archive, lines.line_data);
}

}  // namespace

void write_poly_lines(const std::filesystem::path& path, PolylineData lines) {
  Archive archive;
  std::string begin = lines_magic;
  copy_lines(archive, begin, lines);
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file << archive.take();
  file.close();
  if (!file) throw std::runtime_error("the temporary file cannot be written; the disk may be full");
}

PolylineData read_poly_lines(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  Archive archive(bytes);
  PolylineData lines;
  std::string begin;
  try {
    copy_lines(archive, begin, lines);
  } catch (const DamagedArchive&) {
    throw std::runtime_error("the temporary file is cut off; the disk may be full");
  }
  if (begin != lines_magic) throw std::runtime_error("the temporary file is of another version of the program");
  return lines;
}

}  // namespace tensorray
