#include "renderer/charts/lettering.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "renderer/charts/ink.h"

namespace tensorray {
namespace {

// The grid that letters are drawn on. A capital goes from y = 0 to 28, a small letter to 20, a descender to -6.
constexpr double stroke = 4;  // Width of all strokes.
constexpr double gap = 6;     // Distance between the strokes of neighbouring characters.
constexpr double highest = 28, lowest = -6;
constexpr char first = ' ', last = '~', box = last + 1;

/// A character as text: polylines separated by ";". A point is "x,y", or "x,y/r" for a corner rounded with radius r.
struct Outline {
  int width;  ///< From the middle of the leftmost stroke to the middle of the rightmost one.
  const char* strokes;
};

/// The characters from ' ' to '~', and the box that replaces all others.
// clang-format off
constexpr std::array<Outline, 96> outlines{{
    {2, ""}, {0, "0,28 0,9 ; 0,0 0,0"}, {8, "0,28 0,20 ; 8,28 8,20"},  // space ! "
    {22, "4,0 8,28 ; 14,0 18,28 ; 0,9 21,9 ; 1,19 22,19"},  // #
    {16, "15,19 15,24/4 0,24/5 0,15/5 16,13/5 16,4/5 0,4/4 0,9 ; 8,28 8,0"},  // $
    {26, "21,28 5,0 ; 5,28 10,28/5 10,17/5 0,17/5 0,28/5 5,28 ; 21,11 26,11/5 26,0/5 16,0/5 16,11/5 21,11"},  // %
    {20, "20,0 3,20/4 3,28/6 15,28/6 15,19/5 0,13/6 0,0/7 15,0/8 20,11"}, {0, "0,28 0,20"},  // & '
    {6, "6,28 0,20/14 0,0/14 6,-6"}, {6, "0,28 6,20/14 6,0/14 0,-6"},  // ( )
    {14, "7,28 7,12 ; 0,24 14,16 ; 0,16 14,24"}, {16, "0,12 16,12 ; 8,4 8,20"}, {3, "3,0 0,-6"},  // * + ,
    {10, "0,12 10,12"}, {0, "0,0 0,0"}, {14, "0,0 14,28"}, {16, "8,28 16,28/8 16,0/8 0,0/8 0,28/8 8,28"},  // - . / 0
    {16, "2,22 10,28 10,0"}, {16, "0,20 0,28/8 16,28/8 16,17/8 0,0 16,0"},  // 1 2
    {16, "1,23 1,28/5 15,28/6 15,15/6 7,15 16,15/7 16,0/7 0,0/7 0,7"}, {16, "12,0 12,28 0,8 16,8"},  // 3 4
    {16, "14,28 1,28 0,17 16,17/8 16,0/8 0,0/7 0,7"}, {16, "11,28 0,15/14 0,0/8 16,0/8 16,16/8 0,16/8 0,8"},  // 5 6
    {16, "0,28 16,28 6,0"},  // 7
    {16, "8,28 15,28/6 15,15/6 1,15/6 1,28/6 8,28 ; 8,15 16,15/7 16,0/7 0,0/7 0,15/7 8,15"},  // 8
    {16, "5,0 16,13/14 16,28/8 0,28/8 0,12/8 16,12/8 16,20"}, {0, "0,0 0,0 ; 0,16 0,16"},  // 9 :
    {3, "2,16 2,16 ; 3,0 0,-6"}, {16, "16,21 0,12 16,3"}, {16, "0,16 16,16 ; 0,8 16,8"},  // ; < =
    {16, "0,21 16,12 0,3"}, {14, "0,22 0,28/6 14,28/7 14,17/4 7,14/3 7,9 ; 7,0 7,0"},  // > ?
    {26, "13,18 18,18/5 18,6/5 8,6/5 8,18/5 13,18 ; 18,18 18,6/4 26,6/4 26,26/12 0,26/12 0,-4/12 20,-4"},  // @
    {20, "0,0 10,28 20,0 ; 3,8 17,8"}, {17, "0,0 0,28 15,28/6 15,15/6 0,15 ; 7,15 17,15/7 17,0/7 0,0"},  // A B
    {18, "18,20 18,28/8 0,28/9 0,0/9 18,0/8 18,8"}, {18, "0,0 0,28 18,28/10 18,0/10 0,0"},  // C D
    {14, "14,28 0,28 0,0 14,0 ; 0,15 12,15"}, {14, "14,28 0,28 0,0 ; 0,14 12,14"},  // E F
    {18, "18,21 18,28/7 0,28/9 0,0/9 18,0/9 18,13 11,13"}, {18, "0,0 0,28 ; 18,0 18,28 ; 0,15 18,15"},  // G H
    {0, "0,0 0,28"}, {12, "12,28 12,0/6 0,0/6 0,6"}, {17, "0,0 0,28 ; 16,28 0,10 ; 6,17 17,0"},  // I J K
    {14, "0,28 0,0 14,0"}, {22, "0,0 0,28 11,8 22,28 22,0"}, {18, "0,0 0,28 18,0 18,28"},  // L M N
    {20, "10,28 20,28/10 20,0/10 0,0/10 0,28/10 10,28"}, {17, "0,0 0,28 17,28/7 17,13/7 0,13"},  // O P
    {20, "10,28 20,28/10 20,0/10 0,0/10 0,28/10 10,28 ; 12,8 20,0"},  // Q
    {17, "0,0 0,28 17,28/7 17,13/7 0,13 ; 9,13 17,0"},  // R
    {16, "15,22 15,28/6 0,28/7 0,16/6 16,13/6 16,0/7 0,0/6 0,6"}, {18, "0,28 18,28 ; 9,28 9,0"},  // S T
    {18, "0,28 0,0/9 18,0/9 18,28"}, {20, "0,28 10,0 20,28"}, {28, "0,28 7,0 14,26 21,0 28,28"},  // U V W
    {18, "0,0 18,28 ; 0,28 18,0"}, {20, "0,28 10,13 20,28 ; 10,13 10,0"}, {17, "0,28 17,28 0,0 17,0"},  // X Y Z
    {6, "6,28 0,28 0,-6 6,-6"}, {14, "0,28 14,0"}, {6, "0,28 6,28 6,-6 0,-6"},  // [ backslash ]
    {14, "0,19 7,28 14,19"}, {16, "0,-6 16,-6"}, {5, "0,28 5,23"},  // ^ _ `
    {14, "1,20 14,20/7 14,0 ; 14,12 0,12/6 0,0/6 14,0"},  // a
    {16, "0,28 0,0 ; 8,20 16,20/8 16,0/8 0,0/8 0,20/8 8,20"}, {14, "14,14 14,20/6 0,20/8 0,0/8 14,0/6 14,6"},  // b c
    {16, "16,28 16,0 ; 8,20 16,20/8 16,0/8 0,0/8 0,20/8 8,20"},  // d
    {16, "0,10 16,10 16,20/8 0,20/8 0,0/8 14,0/6 15,4"}, {9, "9,28 3,28/6 3,0 ; 0,20 9,20"},  // e f
    {16, "16,20 16,-6/7 2,-6 ; 8,20 16,20/8 16,0/8 0,0/8 0,20/8 8,20"},  // g
    {14, "0,0 0,28 ; 0,13 0,20/7 14,20/7 14,0"}, {0, "0,0 0,20 ; 0,28 0,28"},  // h i
    {5, "5,20 5,-6/5 0,-6 ; 5,28 5,28"}, {14, "0,0 0,28 ; 13,20 0,7 ; 5,12 14,0"}, {5, "0,28 0,0/5 5,0"},  // j k l
    {24, "0,0 0,20 ; 0,14 0,20/6 12,20/6 12,0 ; 12,14 12,20/6 24,20/6 24,0"},  // m
    {14, "0,0 0,20 ; 0,13 0,20/7 14,20/7 14,0"}, {16, "8,20 16,20/8 16,0/8 0,0/8 0,20/8 8,20"},  // n o
    {16, "0,20 0,-6 ; 8,20 16,20/8 16,0/8 0,0/8 0,20/8 8,20"},  // p
    {16, "16,20 16,-6 ; 8,20 16,20/8 16,0/8 0,0/8 0,20/8 8,20"}, {9, "0,0 0,20 ; 0,13 0,20/7 9,20"},  // q r
    {13, "12,16 12,20/4 0,20/5 0,11/4 13,9/4 13,0/5 0,0/4 0,4"}, {9, "3,26 3,0/6 9,0 ; 0,20 9,20"},  // s t
    {14, "0,20 0,0/7 14,0/7 14,7 ; 14,20 14,0"}, {16, "0,20 8,0 16,20"}, {24, "0,20 6,0 12,18 18,0 24,20"},  // u v w
    {15, "0,0 15,20 ; 0,20 15,0"}, {16, "0,20 8,0 ; 16,20 6,-6"}, {14, "0,20 14,20 0,0 14,0"},  // x y z
    {8, "8,28 4,28/4 4,11/4 0,11 4,11/4 4,-6/4 8,-6"}, {0, "0,28 0,-6"},  // { |
    {8, "0,28 4,28/4 4,11/4 8,11 4,11/4 4,-6/4 0,-6"}, {18, "0,10 4,17/3 14,8/3 18,15"},  // } ~
    {12, "0,0 0,20 12,20 12,0 0,0"},  // box
}};
// clang-format on

struct Segment {
  Eigen::Vector2d from, to;
};

struct Arc {
  Eigen::Vector2d center, middle;  ///< `middle`: unit vector from the centre to the middle of the arc.
  double radius, cos_half;         ///< `cos_half`: cosine of half the opening angle.
};

struct Glyph {
  double width = 0;
  std::vector<Segment> segments;
  std::vector<Arc> arcs;  ///< Both ends of each arc are ends of segments.
};

struct Corner {
  Eigen::Vector2d point;
  double radius;
};

/// Adds the arc of a corner. Returns the points where it touches the lines to the points before and after.
Segment round_corner(const Eigen::Vector2d& before, const Corner& corner, const Eigen::Vector2d& after, Glyph& glyph) {
  const Eigen::Vector2d a = (before - corner.point).normalized(), b = (after - corner.point).normalized();
  const Eigen::Vector2d inwards = (a + b).normalized();
  const double cosine = inwards.dot(a), sine = std::sqrt(1 - cosine * cosine);  // Of half the angle at the corner.
  const double touch = corner.radius * cosine / sine;
  glyph.arcs.push_back({corner.point + corner.radius / sine * inwards, -inwards, corner.radius, sine});
  return {corner.point + touch * a, corner.point + touch * b};
}

void add_polyline(const std::vector<Corner>& corners, Glyph& glyph) {
  Eigen::Vector2d from = corners.front().point;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    Segment corner{corners[i].point, corners[i].point};
    if (corners[i].radius > 0) corner = round_corner(corners[i - 1].point, corners[i], corners[i + 1].point, glyph);
    glyph.segments.push_back({from, corner.from});
    from = corner.to;
  }
}

Glyph make_glyph(const Outline& outline) {
  Glyph glyph;
  glyph.width = outline.width;
  std::istringstream text(outline.strokes);
  text.imbue(std::locale::classic());
  std::vector<Corner> corners;
  Corner corner{};
  for (char comma; text >> corner.point.x() >> comma >> corner.point.y();) {
    corner.radius = 0;
    if (text.peek() == '/') text.ignore() >> corner.radius;
    corners.push_back(corner);
    if (!(text >> std::ws).eof() && text.peek() != ';') continue;
    text.ignore();
    add_polyline(corners, glyph);
    corners.clear();
  }
  return glyph;
}

std::vector<Glyph> make_glyphs() {
  std::vector<Glyph> glyphs;
  for (const Outline& outline : outlines) glyphs.push_back(make_glyph(outline));
  return glyphs;
}

const Glyph& glyph_of(char character) {
  static const std::vector<Glyph> glyphs = make_glyphs();
  return glyphs[character - first];
}

/// Replaces each character of the UTF-8 text that is not printable ASCII by `box`.
std::string drawable(const std::string& text) {
  std::string result;
  for (const char character : text) {
    const bool continues = (static_cast<unsigned char>(character) & 0xC0) == 0x80;
    if (!continues) result += character >= first && character <= last ? character : box;
  }
  return result;
}

double distance(const Segment& segment, const Eigen::Vector2d& point) {
  const Eigen::Vector2d along = segment.to - segment.from;
  const double length = along.squaredNorm();
  const double t = length > 0 ? std::clamp((point - segment.from).dot(along) / length, 0.0, 1.0) : 0.0;
  return (segment.from + t * along - point).norm();
}

/// Distance from a point to the middle of the nearest stroke, in units of the grid.
double distance(const Glyph& glyph, const Eigen::Vector2d& point) {
  double nearest = INFINITY;
  for (const Segment& segment : glyph.segments) nearest = std::min(nearest, distance(segment, point));
  for (const Arc& arc : glyph.arcs) {
    const Eigen::Vector2d offset = point - arc.center;
    const double length = offset.norm();
    if (offset.dot(arc.middle) >= length * arc.cos_half) nearest = std::min(nearest, std::abs(length - arc.radius));
  }
  return nearest;
}

/// @param origin  Position of (0, 0) of the grid. @param unit  Size of a grid unit, in pixels.
/// @param width   Of strokes, in pixels.
void draw_glyph(Image& image, const Glyph& glyph, const Eigen::Vector2d& origin, double unit, double width,
                const Eigen::Vector3d& color) {
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(width / 2 + 1);
  const Eigen::Vector2d upper(origin - Eigen::Vector2d(0, highest * unit)),
      lower(origin + Eigen::Vector2d(glyph.width, -lowest) * unit);
  for_each_pixel(image, {upper - margin, lower + margin}, [&](int x, int y, double) {
    const Eigen::Vector2d point((x + 0.5 - origin.x()) / unit, (origin.y() - y - 0.5) / unit);
    lay_over(image, x, y, color, line_coverage(distance(glyph, point) * unit, width));
  });
}

}  // namespace

void draw_text(Image& image, const Eigen::Vector2d& position, double height, const std::string& text,
               const Eigen::Vector3d& color, double outline) {
  if (!(height > 0) || !std::isfinite(height) || !position.allFinite())
    throw std::invalid_argument("the position and height of lettering must be finite, and the height above 0");
  const double unit = height / (highest + stroke);
  Eigen::Vector2d origin = position + Eigen::Vector2d(stroke / 2, -stroke / 2) * unit;
  for (const char character : drawable(text)) {
    const Glyph& glyph = glyph_of(character);
    draw_glyph(image, glyph, origin, unit, stroke * unit + 2 * outline, color);
    origin.x() += (glyph.width + stroke + gap) * unit;
  }
}

double text_width(const std::string& text, double height) {
  double width = 0;
  for (const char character : drawable(text)) width += glyph_of(character).width + stroke + gap;
  return std::max(width - gap, 0.0) * height / (highest + stroke);
}

}  // namespace tensorray
