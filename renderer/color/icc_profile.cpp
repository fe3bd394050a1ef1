#include "renderer/color/icc_profile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include "base/text/byte_order.h"
#include "base/text/text.h"
#include "renderer/color/chromaticities.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Vector3d profile_white(0.9642, 1, 0.8249);  // D50, as the format rounds it.
constexpr std::size_t header_bytes = 128;

/// The contents of each tag by its signature. They may overlap, and are not copied.
using Tags = std::map<std::string, std::string_view>;

std::string_view bytes_at(std::string_view bytes, std::size_t at, std::size_t count) {
  if (at > bytes.size() || count > bytes.size() - at) throw std::runtime_error("it is cut off");
  return bytes.substr(at, count);
}

template <class Number>
Number big_endian_at(std::string_view bytes, std::size_t at) {
  return read_number<Number>(bytes_at(bytes, at, sizeof(Number)).data(), ByteOrder::big);
}

double fixed_at(std::string_view bytes, std::size_t at) { return big_endian_at<std::int32_t>(bytes, at) / 65536.0; }

Tags tags_of(std::string_view bytes) {
  constexpr std::uint32_t most_tags = 1000;
  if (bytes_at(bytes, 36, 4) != "acsp") throw std::runtime_error("it is no ICC profile");
  const auto count = big_endian_at<std::uint32_t>(bytes, header_bytes);
  if (count > most_tags) throw std::runtime_error("it is damaged");
  Tags tags;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::size_t entry = header_bytes + 4 + 12 * i;
    tags[std::string(bytes_at(bytes, entry, 4))] =
        bytes_at(bytes, big_endian_at<std::uint32_t>(bytes, entry + 4), big_endian_at<std::uint32_t>(bytes, entry + 8));
  }
  return tags;
}

/// curveType: nothing, an exponent, or a table.
TransferCurve parse_table(std::string_view tag) {
  const auto count = big_endian_at<std::uint32_t>(tag, 8);
  if (count == 0) return {};
  if (count == 1) return power_curve(big_endian_at<std::uint16_t>(tag, 12) / 256.0);
  TransferCurve curve;
  const std::string_view values = bytes_at(tag, 12, 2 * std::size_t{count});
  for (std::size_t i = 0; i < count; ++i)
    curve.table.push_back(static_cast<float>(big_endian_at<std::uint16_t>(values, 2 * i) / 65535.0));
  return curve;
}

/// parametricCurveType, of which all kinds are special cases of the last.
TransferCurve parse_function(std::string_view tag) {
  const auto kind = big_endian_at<std::uint16_t>(tag, 8);
  const int counts[] = {1, 3, 4, 5, 7};
  if (kind > 4) throw std::runtime_error("it has an unknown kind of curve");
  std::vector<double> p(7, 0.0);
  for (int i = 0; i < counts[kind]; ++i)
    p[static_cast<std::size_t>(i)] = fixed_at(tag, 12 + 4 * static_cast<std::size_t>(i));
  TransferCurve curve;
  curve.g = p[0];
  if (kind == 0) return curve;
  curve.a = p[1];
  curve.b = p[2];
  if (curve.a == 0) throw std::runtime_error("it has a curve that does not rise");
  if (kind <= 2) {
    curve.d = -curve.b / curve.a;
    curve.e = curve.f = p[3];  // 0 for kind 1.
  } else {
    curve.c = p[3];
    curve.d = p[4];
    curve.e = p[5];
    curve.f = p[6];
  }
  return curve;
}

TransferCurve parse_any_curve(std::string_view tag) {
  const std::string_view type = bytes_at(tag, 0, 4);
  if (type == "curv") return parse_table(tag);
  if (type == "para") return parse_function(tag);
  throw std::runtime_error("it has an unknown kind of curve");
}

TransferCurve parse_curve(const Tags& tags, const std::string& name) {
  constexpr float most_light = 100;  // Damaged exponents give more, or nothing finite.
  const auto found = tags.find(name);
  if (found == tags.end()) throw std::runtime_error("it consists of tables, not of curves and a matrix");
  const TransferCurve curve = parse_any_curve(found->second);
  for (float x = 0; x <= 1; x += 1.0f / 64)
    if (!(std::abs(curve.at(x)) < most_light)) throw std::runtime_error("it has a curve that is damaged");
  if (!(curve.at(1) > curve.at(0))) throw std::runtime_error("it has a curve that does not rise");
  return curve;
}

Vector3d parse_xyz(const Tags& tags, const std::string& name) {
  const auto found = tags.find(name);
  if (found == tags.end()) throw std::runtime_error("it consists of tables, not of curves and a matrix");
  return {fixed_at(found->second, 8), fixed_at(found->second, 12), fixed_at(found->second, 16)};
}

std::string big_endian(std::uint32_t number, int bytes) {
  std::string result;
  for (int i = bytes - 1; i >= 0; --i) result += static_cast<char>(number >> (8 * i));
  return result;
}

std::string fixed(double number) {
  return big_endian(static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(number * 65536))), 4);
}

std::string xyz_tag(const Vector3d& xyz) {
  return std::string("XYZ \0\0\0\0", 8) + fixed(xyz.x()) + fixed(xyz.y()) + fixed(xyz.z());
}

std::string text_tag(const std::string& text) { return std::string("text\0\0\0\0", 8) + text + '\0'; }

/// textDescriptionType, without its texts in other scripts.
std::string description_tag(const std::string& text) {
  return std::string("desc\0\0\0\0", 8) + big_endian(static_cast<std::uint32_t>(text.size() + 1), 4) + text + '\0' +
         std::string(4 + 4 + 2 + 1 + 67, '\0');
}

/// An exponent if the curve is a power that the format can hold, otherwise a table.
std::string curve_tag(const TransferCurve& curve) {
  const std::string head("curv\0\0\0\0", 8);
  const double exponent = std::round(curve.g * 256);
  const bool is_power = curve.table.empty() && curve.a == 1 && curve.b == 0 && curve.d <= 0 && curve.e == 0;
  if (is_power && std::abs(exponent / 256 - curve.g) < 1e-3)
    return head + big_endian(1, 4) + big_endian(static_cast<std::uint32_t>(exponent), 2);
  constexpr std::uint32_t count = 4096;
  std::string tag = head + big_endian(count, 4);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double value = std::clamp(static_cast<double>(curve.at(static_cast<float>(i) / (count - 1))), 0.0, 1.0);
    tag += big_endian(static_cast<std::uint32_t>(std::lround(65535 * value)), 2);
  }
  return tag;
}

}  // namespace

IccProfile parse_icc_profile(const std::string& bytes, bool grey) {
  const std::string space(bytes_at(bytes, 16, 4));
  const Tags tags = tags_of(bytes);
  if (space != (grey ? "GRAY" : "RGB ")) throw std::runtime_error("it is for colours \"" + escaped(space) + "\"");
  if (bytes_at(bytes, 20, 4) != "XYZ ") throw std::runtime_error("it consists of tables, not of curves and a matrix");
  IccProfile profile;
  const Vector3d d65 = xyz_of(d65_white());
  if (grey) {
    profile.curves.fill(parse_curve(tags, "kTRC"));
    profile.rgb_to_xyz = rgb_to_xyz(rec709_chromaticities());
    return profile;
  }
  profile.curves = {parse_curve(tags, "rTRC"), parse_curve(tags, "gTRC"), parse_curve(tags, "bTRC")};
  Matrix3d matrix;
  // Not by <<, which must not be left by an exception.
  matrix.col(0) = parse_xyz(tags, "rXYZ");
  matrix.col(1) = parse_xyz(tags, "gXYZ");
  matrix.col(2) = parse_xyz(tags, "bXYZ");
  if (!(std::abs(matrix.determinant()) > 1e-6)) throw std::runtime_error("its primaries are no colours");
  profile.rgb_to_xyz = *adaptation(profile_white, d65) * matrix;
  return profile;
}

std::string make_icc_profile(const std::string& name, const IccProfile& profile) {
  const Matrix3d matrix = *adaptation(xyz_of(d65_white()), profile_white) * profile.rgb_to_xyz;
  const std::vector<std::pair<std::string, std::string>> tags{
      {"desc", description_tag(name)},        {"cprt", text_tag("No copyright, use freely")},
      {"wtpt", xyz_tag(profile_white)},       {"rXYZ", xyz_tag(matrix.col(0))},
      {"gXYZ", xyz_tag(matrix.col(1))},       {"bXYZ", xyz_tag(matrix.col(2))},
      {"rTRC", curve_tag(profile.curves[0])}, {"gTRC", curve_tag(profile.curves[1])},
      {"bTRC", curve_tag(profile.curves[2])}};
  std::string table = big_endian(static_cast<std::uint32_t>(tags.size()), 4), contents;
  const std::size_t begin = header_bytes + 4 + 12 * tags.size();
  for (const auto& [signature, content] : tags) {
    table += signature + big_endian(static_cast<std::uint32_t>(begin + contents.size()), 4) +
             big_endian(static_cast<std::uint32_t>(content.size()), 4);
    contents += content + std::string((4 - content.size() % 4) % 4, '\0');
  }
  std::string header = big_endian(static_cast<std::uint32_t>(begin + contents.size()), 4) + std::string(4, '\0') +
                       big_endian(0x02400000, 4) + "mntrRGB XYZ ";
  for (const int part : {2000, 1, 1, 0, 0, 0}) header += big_endian(static_cast<std::uint32_t>(part), 2);
  header +=
      "acsp" + std::string(28, '\0') + fixed(profile_white.x()) + fixed(profile_white.y()) + fixed(profile_white.z());
  header.resize(header_bytes, '\0');
  return header + table + contents;
}

}  // namespace tensorray
