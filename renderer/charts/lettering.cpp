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
#include "renderer/charts/outlines.inc"
}};
// clang-format on

struct Stroke {
  Eigen::Vector2d from, to;
};

struct Arc {
  Eigen::Vector2d center, middle;  ///< `middle`: unit vector from the centre to the middle of the arc.
  double radius, cos_half;         ///< `cos_half`: cosine of half the opening angle.
};

struct Glyph {
  double width = 0;
  std::vector<Stroke> segments;
  std::vector<Arc> arcs;  ///< Both ends of each arc are ends of segments.
};

struct Corner {
  Eigen::Vector2d point;
  double radius;
};

/// Adds the arc of a corner. Returns the points where it touches the lines to the points before and after.
Stroke round_corner(const Eigen::Vector2d& before, const Corner& corner, const Eigen::Vector2d& after, Glyph& glyph) {
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
    Stroke corner{corners[i].point, corners[i].point};
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

double distance(const Stroke& segment, const Eigen::Vector2d& point) {
  const Eigen::Vector2d along = segment.to - segment.from;
  const double length = along.squaredNorm();
  const double t = length > 0 ? std::clamp((point - segment.from).dot(along) / length, 0.0, 1.0) : 0.0;
  return (segment.from + t * along - point).norm();
}

/// Distance from a point to the middle of the nearest stroke, in units of the grid.
double distance(const Glyph& glyph, const Eigen::Vector2d& point) {
  double nearest = INFINITY;
  for (const Stroke& segment : glyph.segments) nearest = std::min(nearest, distance(segment, point));
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

double letter_height(int width, int height) { return std::max(13.0, 0.028 * std::min(width, height)); }

double text_width(const std::string& text, double height) {
  double width = 0;
  for (const char character : drawable(text)) width += glyph_of(character).width + stroke + gap;
  return std::max(width - gap, 0.0) * height / (highest + stroke);
}

}  // namespace tensorray
