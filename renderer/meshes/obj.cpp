#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/text/text.h"
#include "renderer/meshes/mesh_readers.h"

namespace tensorray {
namespace {

using Words = std::vector<std::string>;

constexpr std::uint32_t none = 0xffffffff, missing = none - 1;

/// A corner of a face: its vertex, place and normal, from 0.
struct ObjCorner {
  std::uint32_t vertex = none, place = none, normal = none;  ///< `missing`: of a place that is not there.
};

struct ObjFace {
  std::size_t line, end;  ///< `end`: corners of it and all faces before.
};

struct ObjContents {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3f> normals;
  std::vector<Eigen::Vector2f> places;
  std::vector<ObjCorner> corners;  ///< Of all faces.
  std::vector<ObjFace> faces;
};

bool is_without_surface(const std::string& keyword) {
  static const std::set<std::string> keywords{"p",   "l",        "vp",       "o",         "g",         "s",
                                              "mg",  "usemtl",   "mtllib",   "usemap",    "maplib",    "bevel",
                                              "lod", "c_interp", "d_interp", "trace_obj", "shadow_obj"};
  return keywords.count(keyword) > 0;
}

double component_of(const std::string& word) {
  const std::optional<double> value = parse_number(word);
  if (!value) throw std::runtime_error("\"" + escaped(word.substr(0, 20)) + "\" is not a number");
  return *value;
}

Eigen::Vector3d vector_of(const Words& words) {
  if (words.size() < 4) throw std::runtime_error("\"" + words[0] + "\" needs three numbers");
  return {component_of(words[1]), component_of(words[2]), component_of(words[3])};
}

/// A vertex x y z, x y z w (homogeneous) or x y z r g b.
Eigen::Vector3d vertex_of(const Words& words) {
  const Eigen::Vector3d position = vector_of(words);
  const double weight = words.size() == 5 ? component_of(words[4]) : 1;
  if (weight == 0) throw std::runtime_error("the vertex has the weight 0");
  return position / weight;
}

/// An index, which counts from 1, or backwards from -1, the last of `count`. @param must  Else it may be `missing`.
std::uint32_t index_of(const std::string& word, std::size_t count, const char* what, bool must = true) {
  std::int64_t index = 0;
  const std::from_chars_result result = std::from_chars(word.data(), word.data() + word.size(), index);
  if (result.ec != std::errc() || result.ptr != word.data() + word.size())
    throw std::runtime_error("the face has \"" + escaped(word.substr(0, 20)) + "\" where it should name a " + what);
  const std::int64_t from_zero = index < 0 ? static_cast<std::int64_t>(count) + index : index - 1;
  if (from_zero >= 0 && from_zero < missing) return static_cast<std::uint32_t>(from_zero);
  if (must) throw std::runtime_error("the face names " + std::string(what) + " " + word + ", which is not there");
  return missing;
}

/// u, u v or u v w.
Eigen::Vector2f place_of(const Words& words) {
  if (words.size() < 2) throw std::runtime_error("\"vt\" needs a number");
  return {static_cast<float>(component_of(words[1])),
          words.size() > 2 ? static_cast<float>(component_of(words[2])) : 0.0f};
}

/// v, v/vt, v//vn or v/vt/vn. Texture coordinates need not exist: only pictures ask for them.
ObjCorner obj_corner_of(const std::string& word, const ObjContents& contents) {
  const std::size_t first = word.find('/');
  const std::size_t second = first == std::string::npos ? first : word.find('/', first + 1);
  ObjCorner corner;
  corner.vertex = index_of(word.substr(0, first), contents.vertices.size(), "vertex");
  if (first != std::string::npos && first + 1 < std::min(second, word.size()))
    corner.place =
        index_of(word.substr(first + 1, second - first - 1), contents.places.size(), "texture coordinate", false);
  if (second != std::string::npos && second + 1 < word.size())
    corner.normal = index_of(word.substr(second + 1), contents.normals.size(), "normal");
  return corner;
}

void read_obj_face(const Words& words, std::size_t line, ObjContents& contents) {
  if (words.size() < 4) throw std::runtime_error("a face needs at least three corners");
  for (std::size_t i = 1; i < words.size(); ++i) contents.corners.push_back(obj_corner_of(words[i], contents));
  contents.faces.push_back({line, contents.corners.size()});
}

void read_obj_statement(const Words& words, std::size_t line, ObjContents& contents) {
  const std::string& keyword = words[0];
  if (keyword == "v")
    contents.vertices.push_back(vertex_of(words));
  else if (keyword == "vn")
    contents.normals.push_back(vector_of(words).cast<float>());
  else if (keyword == "vt")
    contents.places.push_back(place_of(words));
  else if (keyword == "f" || keyword == "fo")
    read_obj_face(words, line, contents);
  else if (!is_without_surface(keyword))
    throw std::runtime_error("\"" + escaped(keyword.substr(0, 20)) +
                             "\" is not read; of an .obj file only polygons are (v, vn, f)");
}

/// The words of a statement, up to a comment. A backslash at a line's end continues it. @return whether there was one.
bool next_statement(std::istream& file, Words& words, std::size_t& line) {
  words.clear();
  std::string text;
  for (bool goes_on = true; goes_on;) {
    if (!std::getline(file, text)) return !words.empty();
    ++line;
    if (line == 1 && starts_with(text, "\xef\xbb\xbf")) text.erase(0, 3);  // The mark of UTF-8.
    text.erase(std::min(text.find('#'), text.size()));
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
    goes_on = !text.empty() && text.back() == '\\';
    if (goes_on) text.pop_back();
    std::istringstream stream(text);
    for (std::string word; stream >> word;) words.push_back(word);
  }
  return true;
}

ObjContents read_contents(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  ObjContents contents;
  Words words;
  std::size_t line = 0;
  try {
    while (next_statement(file, words, line))
      if (!words.empty()) read_obj_statement(words, line, contents);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error("line " + std::to_string(line) + ": " + error.what());
  }
  return contents;
}

void check_corner(const ObjCorner& corner, const ObjContents& contents) {
  const auto check = [](std::uint32_t index, std::size_t count, const std::string& what) {
    if (index != none && index >= count)
      throw std::runtime_error("the face names " + what + " " + std::to_string(index + 1) + " of " +
                               std::to_string(count));
  };
  check(corner.vertex, contents.vertices.size(), "vertex");
  check(corner.normal, contents.normals.size(), "normal");
}

/// Not finite if the corner names one that is not there.
Eigen::Vector2f place_at(const ObjCorner& corner, const ObjContents& contents) {
  if (corner.place == none) return {0, 0};
  return corner.place < contents.places.size() ? contents.places[corner.place] : Eigen::Vector2f(NAN, NAN);
}

/// Adds the face whose corners are [first, end). Each corner becomes a vertex; mesh.cpp joins those that are equal.
void add_obj_face(const ObjContents& contents, std::size_t first, std::size_t end, MeshWithNormals& result) {
  std::vector<std::uint32_t> vertices;
  for (std::size_t i = first; i < end; ++i) {
    const ObjCorner& corner = contents.corners[i];
    check_corner(corner, contents);
    vertices.push_back(static_cast<std::uint32_t>(result.mesh.vertices.size()));
    result.mesh.vertices.push_back(contents.vertices[corner.vertex]);
    const bool has_normal = corner.normal != none;
    if (!contents.normals.empty())
      result.normals.push_back(has_normal ? contents.normals[corner.normal] : Eigen::Vector3f(0, 0, 0));
    if (!contents.places.empty()) result.places.push_back(place_at(corner, contents));
  }
  add_polygon(vertices, result.mesh);
}

}  // namespace

MeshWithNormals read_obj(const std::filesystem::path& path) {
  const ObjContents contents = read_contents(path);
  MeshWithNormals result;
  std::size_t first = 0;
  for (const ObjFace& face : contents.faces) {
    try {
      add_obj_face(contents, first, face.end, result);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("line " + std::to_string(face.line) + ": " + error.what());
    }
    first = face.end;
  }
  return result;
}

}  // namespace tensorray
