#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/text/byte_order.h"
#include "base/text/text.h"
#include "renderer/meshes/mesh_readers.h"

namespace tensorray {
namespace {

enum class Encoding { ascii, little_endian, big_endian };

struct NumberType {
  int bytes = 0;
  double (*decoded)(const char* bytes, ByteOrder order) = nullptr;
};

template <class Number>
NumberType stored_as() {
  return {sizeof(Number),
          [](const char* bytes, ByteOrder order) { return static_cast<double>(read_number<Number>(bytes, order)); }};
}

struct Property {
  std::string name;
  NumberType type;
  bool is_list = false;
  NumberType count_type;  ///< Type of the count, if the property is a list.
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t size = 0;  ///< Bytes before the first element.
};

NumberType find_type(const std::string& name) {
  static const std::map<std::string, NumberType> types{
      {"char", stored_as<std::int8_t>()},     {"int8", stored_as<std::int8_t>()},
      {"uchar", stored_as<std::uint8_t>()},   {"uint8", stored_as<std::uint8_t>()},
      {"short", stored_as<std::int16_t>()},   {"int16", stored_as<std::int16_t>()},
      {"ushort", stored_as<std::uint16_t>()}, {"uint16", stored_as<std::uint16_t>()},
      {"int", stored_as<std::int32_t>()},     {"int32", stored_as<std::int32_t>()},
      {"uint", stored_as<std::uint32_t>()},   {"uint32", stored_as<std::uint32_t>()},
      {"float", stored_as<float>()},          {"float32", stored_as<float>()},
      {"double", stored_as<double>()},        {"float64", stored_as<double>()}};
  const auto found = types.find(name);
  if (found == types.end()) throw std::runtime_error("unknown type \"" + name + "\" in its header");
  return found->second;
}

Encoding find_encoding(const std::string& name) {
  if (name == "ascii") return Encoding::ascii;
  if (name == "binary_little_endian") return Encoding::little_endian;
  if (name == "binary_big_endian") return Encoding::big_endian;
  throw std::runtime_error("unknown format \"" + name + "\" in its header");
}

Property parse_property(std::istringstream& words) {
  Property property;
  std::string type, count_type;
  words >> type;
  property.is_list = type == "list";
  if (property.is_list) words >> count_type >> type;
  if (property.is_list) property.count_type = find_type(count_type);
  property.type = find_type(type);
  words >> property.name;
  return property;
}

void parse_header_line(const std::string& line, Header& header) {
  std::istringstream words(line);
  std::string keyword, name;
  words >> keyword;
  if (keyword == "format") {
    words >> name;
    header.encoding = find_encoding(name);
  } else if (keyword == "element") {
    Element element;
    words >> element.name >> element.count;
    if (!words) throw std::runtime_error("an element of its header has no count");
    header.elements.push_back(element);
  } else if (keyword == "property") {
    if (header.elements.empty()) throw std::runtime_error("a property of its header belongs to no element");
    header.elements.back().properties.push_back(parse_property(words));
  }
}

Header parse_header(const std::string& bytes) {
  Header header;
  std::size_t begin = 0;
  for (bool first = true;; first = false) {
    const std::size_t end = bytes.find('\n', begin);
    if (first && bytes.compare(0, 3, "ply") != 0) throw std::runtime_error("it is not a PLY file");
    if (end == std::string::npos) throw std::runtime_error("its header is cut off");
    std::string line = bytes.substr(begin, end - begin);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    begin = end + 1;
    if (line == "end_header") break;
    parse_header_line(line, header);
  }
  header.size = begin;
  return header;
}

/// The numbers after the header, one after another.
class Numbers {
 public:
  Numbers(const std::string& bytes, std::size_t begin, Encoding encoding)
      : position_(bytes.data() + begin), end_(bytes.data() + bytes.size()), encoding_(encoding) {}

  double next(const NumberType& type) { return encoding_ == Encoding::ascii ? next_word() : next_binary(type); }

 private:
  [[noreturn]] static void throw_cut_off() { throw std::runtime_error("the file is cut off"); }

  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

  double next_word() {
    while (position_ != end_ && is_blank(*position_)) ++position_;
    if (position_ == end_) throw_cut_off();
    const char* const begin = position_;
    while (position_ != end_ && !is_blank(*position_)) ++position_;
    const std::string_view word(begin, static_cast<std::size_t>(position_ - begin));
    const std::optional<double> value = parse_number(word);
    if (!value) throw std::runtime_error("\"" + escaped(std::string(word.substr(0, 20))) + "\" is not a number");
    return *value;
  }

  double next_binary(const NumberType& type) {
    if (end_ - position_ < type.bytes) throw_cut_off();
    const ByteOrder order = encoding_ == Encoding::little_endian ? ByteOrder::little : ByteOrder::big;
    const double value = type.decoded(position_, order);
    position_ += type.bytes;
    return value;
  }

  const char* position_;
  const char* end_;
  Encoding encoding_;
};

std::size_t to_count(double value) {
  if (!(value >= 0 && value == std::floor(value) && value < 1e9)) throw std::runtime_error("a list has a bad length");
  return static_cast<std::size_t>(value);
}

/// What the file holds, before polygons are divided.
struct PlyContents {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3f> normals;  ///< For each vertex; zero: it has none.
  std::vector<Eigen::Vector2f> places;   ///< For each vertex, in pictures.
  bool has_normals = false, has_places = false, has_corner_places = false;
  std::vector<std::uint32_t> corners;          ///< Of all faces.
  std::vector<Eigen::Vector2f> corner_places;  ///< Those of a face, which MeshLab writes, for each of its corners.
  std::vector<std::size_t> face_ends;          ///< Corners up to the end of each face.
};

/// Takes a property of the last vertex.
void take_coordinate(const Property& property, const std::vector<double>& values, PlyContents& contents) {
  static const std::map<std::string, int> numbers{
      {"x", 0}, {"y", 1}, {"z", 2}, {"nx", 3},        {"ny", 4},        {"nz", 5},        {"u", 6},
      {"v", 7}, {"s", 6}, {"t", 7}, {"texture_u", 6}, {"texture_v", 7}, {"texture_s", 6}, {"texture_t", 7}};
  const auto found = numbers.find(property.name);
  if (found == numbers.end() || values.empty()) return;
  const int number = found->second;
  if (number < 3) {
    contents.vertices.back()[number] = values.back();
    return;
  }
  (number < 6 ? contents.has_normals : contents.has_places) = true;
  (number < 6 ? contents.normals.back()[number - 3] : contents.places.back()[number - 6]) =
      static_cast<float>(values.back());
}

std::uint32_t to_index(double value) {
  if (!(value >= 0 && value == std::floor(value) && value <= 4294967294.0))
    throw std::runtime_error("a face names a vertex that is not there");
  return static_cast<std::uint32_t>(value);
}

bool is_corners(const Property& property) {
  return property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index");
}

void add_ply_face(const std::vector<double>& corners, PlyContents& contents) {
  if (corners.size() < 3)
    throw std::runtime_error("face " + std::to_string(contents.face_ends.size()) + " has " +
                             std::to_string(corners.size()) + " corners; it needs three");
  for (const double corner : corners) contents.corners.push_back(to_index(corner));
  contents.face_ends.push_back(contents.corners.size());
}

void add_corner_places(const std::vector<double>& numbers, PlyContents& contents) {
  contents.has_corner_places = true;
  for (std::size_t i = 1; i < numbers.size(); i += 2)
    contents.corner_places.emplace_back(static_cast<float>(numbers[i - 1]), static_cast<float>(numbers[i]));
}

/// Makes each corner a vertex, with its place; mesh.cpp joins those that are equal.
PlyContents with_split_corners(PlyContents contents) {
  contents.corner_places.resize(contents.corners.size(), Eigen::Vector2f(NAN, NAN));
  const auto vertices = std::exchange(contents.vertices, {});
  const auto normals = std::exchange(contents.normals, {});
  for (std::uint32_t& corner : contents.corners) {
    contents.vertices.push_back(vertices[corner]);
    contents.normals.push_back(normals[corner]);
    corner = static_cast<std::uint32_t>(contents.vertices.size() - 1);
  }
  contents.places = contents.corner_places;
  contents.has_places = true;
  return contents;
}

/// Adds the triangles of strips: each corner makes one with the two before it, and every second is turned round.
void add_strips(const std::vector<double>& corners, PlyContents& contents) {
  std::vector<std::uint32_t> strip;
  for (const double index : corners) {
    if (index == -1) {
      strip.clear();
      continue;
    }
    strip.push_back(to_index(index));
    const std::size_t size = strip.size();
    if (size < 3) continue;
    const bool turned = size % 2 == 0;
    contents.corners.insert(contents.corners.end(),
                            {strip[size - (turned ? 2 : 3)], strip[size - (turned ? 3 : 2)], strip[size - 1]});
    contents.face_ends.push_back(contents.corners.size());
  }
}

void read_element(const Element& element, Numbers& numbers, PlyContents& contents) {
  if (element.properties.empty()) return;  // Such elements have no bytes, whatever count the header gives.
  const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
  std::vector<double> values;
  for (std::size_t row = 0; row < element.count; ++row) {
    if (is_vertex) contents.vertices.emplace_back(0, 0, 0);
    if (is_vertex) contents.normals.emplace_back(0, 0, 0), contents.places.emplace_back(0, 0);
    if (is_face) contents.corner_places.resize(contents.corners.size(), Eigen::Vector2f(NAN, NAN));
    for (const Property& property : element.properties) {
      values.clear();
      const std::size_t count = property.is_list ? to_count(numbers.next(property.count_type)) : 1;
      for (std::size_t i = 0; i < count; ++i) values.push_back(numbers.next(property.type));
      if (is_vertex)
        take_coordinate(property, values, contents);
      else if (is_face && is_corners(property))
        add_ply_face(values, contents);
      else if (is_face && property.is_list && property.name == "texcoord")
        add_corner_places(values, contents);
      else if (element.name == "tristrips" && is_corners(property))
        add_strips(values, contents);
    }
  }
}

MeshWithNormals mesh_of_ply(PlyContents contents) {
  for (const std::uint32_t corner : contents.corners)
    if (corner >= contents.vertices.size()) throw std::runtime_error("a face names a vertex that is not there");
  if (contents.has_corner_places) contents = with_split_corners(std::move(contents));
  MeshWithNormals result;
  result.mesh.vertices = std::move(contents.vertices);
  if (contents.has_normals) result.normals = std::move(contents.normals);
  if (contents.has_places) result.places = std::move(contents.places);
  std::vector<std::uint32_t> face;
  auto first = contents.corners.begin();
  for (const std::size_t end : contents.face_ends) {
    const auto last = contents.corners.begin() + static_cast<std::ptrdiff_t>(end);
    face.assign(first, last);
    first = last;
    add_polygon(face, result.mesh);
  }
  return result;
}

}  // namespace

MeshWithNormals read_ply(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const Header header = parse_header(bytes);
  Numbers numbers(bytes, header.size, header.encoding);
  PlyContents contents;
  for (const Element& element : header.elements) read_element(element, numbers, contents);
  return mesh_of_ply(std::move(contents));
}

}  // namespace tensorray
