// The XML of VTK's file formats, docs.vtk.org, "VTK XML Formats". The file is not XML once raw data are appended, so
// that the few kinds of tags that matter are found by a scanner of its own.

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "volumes/files/vtk_files.h"

namespace tensorray {
namespace {

using Numbers = std::vector<double>;

[[noreturn]] void fail_damaged(const std::string& what) {
  throw std::runtime_error(what + ": the file is damaged or cut off; write it again");
}

/// What stands between < and >, and the place behind it.
struct Tag {
  std::string_view text;
  std::size_t end = 0;

  bool is(std::string_view name) const {
    return text.substr(0, name.size()) == name &&
           (text.size() == name.size() || !std::isalnum(static_cast<unsigned char>(text[name.size()])));
  }

  /// The value of an attribute; empty if there is none.
  std::string attribute(const std::string& name) const {
    for (std::size_t at = 0; (at = text.find(name, at)) != std::string_view::npos; at += name.size()) {
      const std::size_t quote = at + name.size() + 1;
      if (at == 0 || !std::isspace(static_cast<unsigned char>(text[at - 1])) || quote >= text.size()) continue;
      if (text[quote - 1] != '=' || (text[quote] != '"' && text[quote] != '\'')) continue;
      const std::size_t end_quote = text.find(text[quote], quote + 1);
      if (end_quote == std::string_view::npos) break;
      return std::string(text.substr(quote + 1, end_quote - quote - 1));
    }
    return "";
  }

  /// A count or an offset: no greater than `greatest`.
  std::size_t number(const std::string& name, std::size_t otherwise, std::size_t greatest) const {
    const std::string value = attribute(name);
    if (value.empty()) return otherwise;
    std::size_t number = 0;
    const char* const end_of_value = value.data() + value.size();
    const auto result = std::from_chars(value.data(), end_of_value, number);
    if (result.ec == std::errc::result_out_of_range || number > greatest)
      fail_damaged("its " + name + " is more than it can hold");
    if (result.ec != std::errc() || result.ptr != end_of_value) fail_damaged("its " + name + " is not a number");
    return number;
  }
};

/// The next tag from `begin` on.
std::optional<Tag> next_tag(std::string_view bytes, std::size_t begin) {
  begin = bytes.find('<', begin);
  if (begin == std::string_view::npos) return std::nullopt;
  const std::size_t end = bytes.find('>', begin);
  if (end == std::string_view::npos) fail_damaged("it ends within a tag");
  return Tag{bytes.substr(begin + 1, end - begin - 1), end + 1};
}

struct Array {
  std::string section, name, type, format;
  std::size_t components = 1;
  std::size_t offset = 0;     ///< Of appended data.
  std::string_view contents;  ///< Data that are inline.
};

struct Piece {
  std::size_t points = 0, vertices = 0, lines = 0, cells = 0;
  std::vector<Array> arrays;

  const Array* find(const std::string& section, const std::string& name) const {
    for (const Array& array : arrays)
      if (array.section == section && (array.name == name || name.empty())) return &array;
    return nullptr;
  }
};

struct File {
  bool long_lengths = false;  ///< Of data: 64 bits, not 32.
  std::vector<Piece> pieces;
  std::string_view appended;  ///< Behind the underscore.
  bool appended_raw = false;
};

void parse_file_tag(const Tag& tag, File& file) {
  if (tag.attribute("type") != "PolyData")
    throw std::runtime_error("it is not VTK polydata but \"" + tag.attribute("type") + "\"");
  if (tag.attribute("byte_order") == "BigEndian")
    throw std::runtime_error("it is big-endian; write it on or for a little-endian machine, or as ASCII");
  if (!tag.attribute("compressor").empty())
    throw std::runtime_error("it is compressed; write it without (ParaView: compressor type \"None\")");
  file.long_lengths = tag.attribute("header_type") == "UInt64";
}

Piece parse_piece(const Tag& tag, std::size_t greatest) {
  Piece piece;
  piece.points = tag.number("NumberOfPoints", 0, greatest);
  piece.vertices = tag.number("NumberOfVerts", 0, greatest);
  piece.lines = tag.number("NumberOfLines", 0, greatest);
  piece.cells = piece.vertices + piece.lines + tag.number("NumberOfPolys", 0, greatest) +
                tag.number("NumberOfStrips", 0, greatest);
  return piece;
}

Array parse_array(const Tag& tag, std::string_view bytes, const std::string& section) {
  constexpr std::size_t greatest_components = 1024;
  Array array;
  array.section = section;
  array.name = tag.attribute("Name");
  array.type = tag.attribute("type");
  array.format = tag.attribute("format");
  array.components = std::max<std::size_t>(1, tag.number("NumberOfComponents", 1, greatest_components));
  array.offset = tag.number("offset", 0, bytes.size());
  array.contents = bytes.substr(tag.end, std::min(bytes.find('<', tag.end), bytes.size()) - tag.end);
  return array;
}

void parse_appended(const Tag& tag, std::string_view bytes, File& file) {
  const std::size_t begin = bytes.find('_', tag.end);
  if (begin == std::string_view::npos) fail_damaged("its appended data are missing");
  file.appended = bytes.substr(begin + 1);
  file.appended_raw = tag.attribute("encoding") == "raw";
}

/// Appended data have no other sign that they are all there.
bool is_complete(std::string_view bytes) {
  constexpr std::string_view end = "</VTKFile>";
  while (!bytes.empty() && std::isspace(static_cast<unsigned char>(bytes.back()))) bytes.remove_suffix(1);
  return bytes.size() >= end.size() && bytes.substr(bytes.size() - end.size()) == end;
}

File parse(std::string_view bytes) {
  static const std::vector<std::string> sections{"PointData", "CellData", "Points", "Verts",
                                                 "Lines",     "Strips",   "Polys",  "FieldData"};
  File file;
  std::string section;
  bool begun = false;
  std::optional<Tag> tag;
  for (std::size_t at = 0; (tag = next_tag(bytes, at)); at = tag->end) {
    if (tag->is("VTKFile")) {
      parse_file_tag(*tag, file);
      begun = true;
    }
    if (!begun && !tag->is("?xml") && tag->text.substr(0, 1) != "!") break;
    for (const std::string& name : sections)
      if (tag->is(name)) section = name;
    if (tag->is("Piece")) file.pieces.push_back(parse_piece(*tag, bytes.size()));
    if (tag->is("DataArray") && !file.pieces.empty())
      file.pieces.back().arrays.push_back(parse_array(*tag, bytes, section));
    if (tag->is("AppendedData")) {
      parse_appended(*tag, bytes, file);
      return file;
    }
    if (tag->is("/VTKFile")) return file;
  }
  if (!begun) throw std::runtime_error("it is not VTK polydata in VTK's XML format");
  fail_damaged("its data are missing");
}

/// Six bits; none if it is no letter of base64.
int base64_value(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/// The first `size` bytes of base64. Groups may end with padding anywhere: some programs encode the length by itself.
std::string decoded_base64(std::string_view text, std::size_t size) {
  std::string bytes;
  int letters = 0;
  std::uint32_t group = 0;
  for (std::size_t i = 0; i < text.size() && bytes.size() < size; ++i) {
    if (std::isspace(static_cast<unsigned char>(text[i]))) continue;
    const int value = base64_value(text[i]);
    if (value < 0 && text[i] != '=') break;
    if (value < 0) {  // A group of two or three letters has one byte or two.
      for (int k = 0; k + 1 < letters; ++k) bytes += static_cast<char>(group >> (6 * letters - 8 * (k + 1)) & 0xff);
      letters = 0;
      group = 0;
      continue;
    }
    group = group << 6 | static_cast<std::uint32_t>(value);
    if (++letters < 4) continue;
    for (const int shift : {16, 8, 0}) bytes += static_cast<char>(group >> shift & 0xff);
    letters = 0;
    group = 0;
  }
  if (bytes.size() < size) fail_damaged("its base64 data are too short");
  bytes.resize(size);
  return bytes;
}

template <class Number>
Number little_endian(const char* bytes) {
  Number number;
  std::memcpy(&number, bytes, sizeof number);  // All machines that the program is built for are little-endian.
  return number;
}

template <class Number>
double to_double(const char* bytes) {
  return static_cast<double>(little_endian<Number>(bytes));
}

struct NumberType {
  std::size_t size;
  double (*read)(const char*);
};

NumberType number_type(const std::string& name) {
  static const std::map<std::string, NumberType> types{
      {"Int8", {1, to_double<std::int8_t>}},   {"UInt8", {1, to_double<std::uint8_t>}},
      {"Int16", {2, to_double<std::int16_t>}}, {"UInt16", {2, to_double<std::uint16_t>}},
      {"Int32", {4, to_double<std::int32_t>}}, {"UInt32", {4, to_double<std::uint32_t>}},
      {"Int64", {8, to_double<std::int64_t>}}, {"UInt64", {8, to_double<std::uint64_t>}},
      {"Float32", {4, to_double<float>}},      {"Float64", {8, to_double<double>}}};
  const auto found = types.find(name);
  if (found == types.end()) fail_damaged("an array has the unknown type \"" + name + "\"");
  return found->second;
}

Numbers parse_ascii(std::string_view text, std::size_t count) {
  Numbers numbers;
  const char *at = text.data(), *const end = text.data() + text.size();
  while (true) {
    while (at != end && std::isspace(static_cast<unsigned char>(*at))) ++at;
    if (at == end || numbers.size() == count) return numbers;
    double number = 0;
    const auto result = std::from_chars(at, end, number);
    if (result.ec != std::errc()) fail_damaged("its ASCII data hold what is not a number");
    numbers.push_back(number);
    at = result.ptr;
  }
}

/// The bytes of an array that is not ASCII, of which there must be `size`.
std::string binary_data(const File& file, const Array& array, std::size_t size) {
  const bool appended = array.format == "appended", raw = appended && file.appended_raw;
  if (appended && array.offset > file.appended.size()) fail_damaged("an offset points behind its data");
  const std::string_view data = appended ? file.appended.substr(array.offset) : array.contents;
  const std::size_t length_size = file.long_lengths ? 8 : 4;
  const auto first = [&](std::size_t count) {
    if (raw && data.size() < count) fail_damaged("the array \"" + array.name + "\" is too short");
    return raw ? std::string(data.substr(0, count)) : decoded_base64(data, count);
  };
  const std::string header = first(length_size);
  const std::uint64_t length =
      file.long_lengths ? little_endian<std::uint64_t>(header.data()) : little_endian<std::uint32_t>(header.data());
  if (length != size) fail_damaged("the array \"" + array.name + "\" has not one value for each of what it describes");
  return first(length_size + size).substr(length_size);
}

/// All numbers of an array, which must be `count` values.
Numbers read(const File& file, const Array& array, std::size_t count) {
  const NumberType type = number_type(array.type);
  const std::size_t expected = count * array.components;
  Numbers numbers;
  if (array.format == "ascii") {
    numbers = parse_ascii(array.contents, expected);
    if (numbers.size() != expected) fail_damaged("the array \"" + array.name + "\" is too short");
    return numbers;
  }
  const std::string bytes = binary_data(file, array, expected * type.size);
  numbers.reserve(expected);
  for (std::size_t i = 0; i < expected; ++i) numbers.push_back(type.read(&bytes[i * type.size]));
  return numbers;
}

Numbers read_required(const File& file, const Piece& piece, const std::string& section, const std::string& name,
                      std::size_t count) {
  const Array* const array = piece.find(section, name);
  if (!array) fail_damaged("its " + section + " have no array " + name);
  return read(file, *array, count);
}

/// A whole number below `end`.
std::size_t to_index(double value, std::size_t end, const char* error) {
  if (!(value >= 0 && value < static_cast<double>(end) && value == std::floor(value))) fail_damaged(error);
  return static_cast<std::size_t>(value);
}

/// For each line, how many points it and those before have.
std::vector<std::size_t> line_ends(const File& file, const Piece& piece, std::size_t greatest) {
  std::vector<std::size_t> ends;
  for (const double value : read_required(file, piece, "Lines", "offsets", piece.lines)) {
    ends.push_back(to_index(value, greatest + 1, "an offset of its lines is more than it can hold"));
    if (ends.size() > 1 && ends[ends.size() - 2] > ends.back()) fail_damaged("the offsets of its lines do not grow");
  }
  return ends;
}

void gather(const File& file, const Array& array, std::size_t count, const std::vector<std::size_t>& selected,
            std::map<std::string, DataArray>& result) {
  if (array.type == "String") return;
  const Numbers numbers = read(file, array, count);
  DataArray& data = result[array.name];
  data.components = static_cast<int>(array.components);
  auto& values = std::get<Numbers>(data.values);
  for (const std::size_t i : selected)
    for (std::size_t k = 0; k < array.components; ++k) values.push_back(numbers[array.components * i + k]);
}

void add_piece(const File& file, const Piece& piece, const std::set<std::string>& wanted, std::size_t greatest,
               PolylineData& result) {
  if (piece.lines == 0) return;
  const std::vector<std::size_t> ends = line_ends(file, piece, greatest);
  std::vector<std::size_t> points, cells;
  for (const double value : read_required(file, piece, "Lines", "connectivity", ends.back()))
    points.push_back(to_index(value, piece.points, "a line names a point that is not there"));
  const Array* const position = piece.find("Points", "");
  if (!position || position->components != 3) fail_damaged("its points have not three coordinates");
  const Numbers positions = read(file, *position, piece.points);

  const std::size_t before = result.points.size();
  for (const std::size_t i : points) result.points.emplace_back(&positions[3 * i]);
  for (const std::size_t end : ends) result.line_ends.push_back(before + end);
  for (std::size_t line = 0; line < piece.lines; ++line) cells.push_back(piece.vertices + line);
  for (const std::string& name : wanted) {
    if (const Array* array = piece.find("PointData", name))
      gather(file, *array, piece.points, points, result.point_data);
    if (const Array* array = piece.find("CellData", name)) gather(file, *array, piece.cells, cells, result.line_data);
  }
}

/// Drops arrays that not all pieces have, or not alike.
void drop_partial(std::map<std::string, DataArray>& arrays, std::size_t count) {
  for (auto entry = arrays.begin(); entry != arrays.end();) {
    const DataArray& data = entry->second;
    const bool whole = std::get<Numbers>(data.values).size() == count * static_cast<std::size_t>(data.components);
    entry = whole ? std::next(entry) : arrays.erase(entry);
  }
}

}  // namespace

PolylineData read_vtp_lines(const std::filesystem::path& path, const std::set<std::string>& wanted) {
  std::ifstream stream(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  const File file = parse(bytes);
  if (!is_complete(bytes)) fail_damaged("its end is missing");
  PolylineData result;
  for (const Piece& piece : file.pieces) add_piece(file, piece, wanted, bytes.size(), result);
  drop_partial(result.point_data, result.points.size());
  drop_partial(result.line_data, result.line_ends.size());
  return result;
}

}  // namespace tensorray
