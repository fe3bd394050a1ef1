#include "volumes/points/vtk_files.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <numeric>
#include <stdexcept>
#include <system_error>

#include <fcntl.h>
#include <tbb/parallel_for.h>

#include "base/errors.h"
#include "base/files/descriptor.h"
#include "base/process/archive.h"
#include "base/process/child_program.h"
#include "base/text/byte_order.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

/// Bytes that are encoded at once; a multiple of 3.
constexpr std::size_t piece_bytes = 3 << 17;

constexpr std::size_t encoded_size(std::size_t bytes) { return (bytes + 2) / 3 * 4; }

/// The two characters of twelve bits.
const std::array<std::array<char, 2>, 4096>& pairs() {
  static const auto table = [] {
    const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::array<std::array<char, 2>, 4096> all{};
    for (std::size_t bits = 0; bits < all.size(); ++bits) all[bits] = {digits[bits >> 6], digits[bits & 63]};
    return all;
  }();
  return table;
}

void encode_base64(const char* bytes, std::size_t count, std::string& text) {
  const auto& table = pairs();
  text.resize(encoded_size(count));
  char* to = text.data();
  const auto put = [&](std::uint32_t bits) {
    std::memcpy(to, table[bits >> 12].data(), 2);
    std::memcpy(to + 2, table[bits & 4095].data(), 2);
    to += 4;
  };
  const auto byte = [&](std::size_t i) { return std::uint32_t{static_cast<unsigned char>(bytes[i])}; };
  std::size_t i = 0;
  for (; i + 3 <= count; i += 3) put(byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2));
  if (i == count) return;
  put(byte(i) << 16 | (i + 1 < count ? byte(i + 1) << 8 : 0));
  std::fill(to - (3 - (count - i)), to, '=');
}

class VtpWriter {
 public:
  explicit VtpWriter(const std::filesystem::path& path)
      : path_(path), file_(open_file(path, O_WRONLY | O_CREAT | O_TRUNC)) {
    if (!file_.is_open()) fail_to_write();
  }

  void text(const std::string& text) {
    write(end_, text);
    end_ += text.size();
  }

  /// `attributes` of the element, and the bytes of numbers.
  void array(const std::string& element, const std::string& attributes, const void* data, std::size_t bytes) {
    std::string length;
    append_number(std::uint64_t{bytes}, host_byte_order(), length);
    std::string encoded;
    encode_base64(length.data(), length.size(), encoded);
    text("<" + element + attributes + " format=\"binary\">\n" + encoded);
    tbb::parallel_for(std::size_t{0}, (bytes + piece_bytes - 1) / piece_bytes, [&](std::size_t i) {
      thread_local std::string piece;
      const std::size_t first = i * piece_bytes;
      encode_base64(static_cast<const char*>(data) + first, std::min(piece_bytes, bytes - first), piece);
      write(end_ + encoded_size(first), piece);
    });
    end_ += encoded_size(bytes);
    text("\n</" + element + ">\n");
  }

  void close() {
    if (!file_.close()) fail_to_write();
  }

 private:
  [[noreturn]] void fail_to_write() const {
    fail(path_, "cannot be written: " + std::generic_category().message(errno));
  }

  void write(std::size_t at, const std::string& text) const {
    if (!write_whole_at(file_.get(), text, at)) fail_to_write();
  }

  std::filesystem::path path_;
  Descriptor file_;
  std::size_t end_ = 0;
};

/// As the value of an attribute.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    const std::string entity = c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : "";
    result += entity.empty() ? std::string(1, c) : entity;
  }
  return result + "\"";
}

const char* type_name(double) { return "Float64"; }
const char* type_name(float) { return "Float32"; }
const char* type_name(std::int64_t) { return "Int64"; }
const char* type_name(std::int32_t) { return "Int32"; }
const char* type_name(std::uint8_t) { return "UInt8"; }

template <class Number>
void write_numbers(VtpWriter& file, const std::string& name, const Number* numbers, std::size_t count, int components) {
  std::string attributes = std::string(" type=\"") + type_name(Number()) + "\" Name=" + quoted(name);
  if (components > 1) attributes += " NumberOfComponents=\"" + std::to_string(components) + "\"";
  file.array("DataArray", attributes, numbers, count * sizeof(Number));
}

void write_array(VtpWriter& file, const std::string& name, const std::vector<float>& values) {
  write_numbers(file, name, values.data(), values.size(), 1);
}

template <class Number>
void write_array(VtpWriter& file, const std::string& name, const std::vector<Eigen::Matrix<Number, 3, 1>>& vectors) {
  static_assert(sizeof(Eigen::Matrix<Number, 3, 1>) == 3 * sizeof(Number), "vectors are contiguous");
  write_numbers(file, name, reinterpret_cast<const Number*>(vectors.data()), 3 * vectors.size(), 3);
}

void write_array(VtpWriter& file, const std::string& name, const DataArray& array) {
  std::visit([&](const auto& values) { write_numbers(file, name, values.data(), values.size(), array.components); },
             array.values);
}

template <class Values>
void write_arrays(VtpWriter& file, const std::map<std::string, Values>& arrays) {
  for (const auto& [name, values] : arrays) write_array(file, name, values);
}

void write_texts(VtpWriter& file, const std::string& name, const std::vector<std::string>& texts) {
  std::string bytes;
  for (const std::string& text : texts) bytes.append(text.c_str(), text.size() + 1);
  file.array("Array",
             " type=\"String\" Name=" + quoted(name) + " NumberOfTuples=\"" + std::to_string(texts.size()) + "\"",
             bytes.data(), bytes.size());
}

/// Cells of consecutive points. @param ends  The number of points up to the end of each.
void write_cells(VtpWriter& file, const std::string& element, std::size_t points,
                 const std::vector<std::int64_t>& ends) {
  std::vector<std::int64_t> corners(points);
  std::iota(corners.begin(), corners.end(), std::int64_t{0});
  file.text("<" + element + ">\n");
  write_numbers(file, "connectivity", corners.data(), corners.size(), 1);
  write_numbers(file, "offsets", ends.data(), ends.size(), 1);
  file.text("</" + element + ">\n");
}

/// Names what ParaView shows at first, and what its filters of vectors and tensors take.
template <class... Arrays>
std::string active_arrays(const Arrays&... arrays) {
  const auto attribute = [&](const char* kind, const char* name) {
    return (arrays.count(name) + ...) > 0 ? std::string(" ") + kind + "=\"" + name + "\"" : "";
  };
  const std::string force = attribute("Scalars", "force");
  return attribute("Vectors", "direction") + attribute("Tensors", "tensor") +
         (force.empty() ? attribute("Scalars", "wavelength") : force);
}

/// @param element  Of the cells: "Lines" or "Verts". @param ends  Of each: the number of points up to its end.
/// @param write_notes, write_points, write_lines  Write the arrays of the whole, of points and of lines.
template <class Points, class WriteTexts, class WritePoints, class WriteLines>
void write_poly_data(const std::filesystem::path& path, const Points& points, const std::string& element,
                     const std::vector<std::int64_t>& ends, const std::string& active, const WriteTexts& write_notes,
                     const WritePoints& write_points, const WriteLines& write_lines) {
  const auto count = [&](const char* of) { return "\"" + std::to_string(of == element ? ends.size() : 0) + "\""; };
  const std::string order = host_byte_order() == ByteOrder::little ? "LittleEndian" : "BigEndian";
  VtpWriter file(path);
  file.text("<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"" + order +
            "\" header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n");
  write_notes(file);
  file.text("</FieldData>\n<Piece NumberOfPoints=\"" + std::to_string(points.size()) +
            "\" NumberOfVerts=" + count("Verts") + " NumberOfLines=" + count("Lines") +
            " NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n" + "<PointData" + active + ">\n");
  write_points(file);
  file.text("</PointData>\n<CellData>\n");
  write_lines(file);
  file.text("</CellData>\n<Points>\n");
  write_array(file, "Points", points);
  file.text("</Points>\n");
  write_cells(file, element, points.size(), ends);
  file.text("</Piece>\n</PolyData>\n</VTKFile>\n");
  file.close();
}

/// @throw std::runtime_error with the error that the program printed, or with `on_crash` if it printed none.
void run_vtk_program(const std::vector<std::string>& arguments, const UnnamedFile& shared,
                     const std::string& on_crash) {
  const std::filesystem::path program = sibling_program("tensorray-import");
  std::error_code none;
  if (!std::filesystem::exists(program, none))
    throw std::runtime_error("files of VTK need " + program.string() +
                             ", which is not built; run `tools/setup release import`");
  const ProgramEnd end = run_program(program, arguments, shared);
  if (end.signal != 0) throw std::runtime_error(on_crash);
  if (end.status == 0) return;
  const std::string reason = one_line(end.error);
  throw std::runtime_error(reason.empty() ? on_crash : reason);
}

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

void write_vtp(const std::filesystem::path& path, const PointCloud& cloud) {
  std::vector<std::int64_t> ends(cloud.positions.size());
  std::iota(ends.begin(), ends.end(), std::int64_t{1});
  write_poly_data(
      path, cloud.positions, "Verts", ends, active_arrays(cloud.scalars, cloud.vectors),
      [&](VtpWriter& file) {
        for (const auto& [key, value] : cloud.metadata) write_texts(file, key, {value});
      },
      [&](VtpWriter& file) {
        write_arrays(file, cloud.scalars);
        write_arrays(file, cloud.vectors);
      },
      [](VtpWriter&) {});
}

void write_vtp(const std::filesystem::path& path, const PolylineData& lines) {
  const std::vector<std::int64_t> ends(lines.line_ends.begin(), lines.line_ends.end());
  write_poly_data(
      path, lines.points, "Lines", ends, active_arrays(lines.point_data),
      [&](VtpWriter& file) {
        for (const auto& [name, texts] : lines.texts) write_texts(file, name, texts);
      },
      [&](VtpWriter& file) { write_arrays(file, lines.point_data); },
      [&](VtpWriter& file) { write_arrays(file, lines.line_data); });
}

PolylineData read_vtp_lines(const std::filesystem::path& path, const std::set<std::string>& wanted) {
  const UnnamedFile shared;
  std::vector<std::string> arguments{"--read-vtp", shared_file, path.string()};
  arguments.insert(arguments.end(), wanted.begin(), wanted.end());
  run_vtk_program(arguments, shared,
                  "reading it ended the reader; the file is damaged or cut off, or does not fit in memory");
  return read_poly_lines(shared.path());
}

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
