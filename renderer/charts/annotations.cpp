#include "renderer/charts/annotations.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "base/constants.h"
#include "renderer/charts/color_bar.h"
#include "renderer/charts/ink.h"
#include "renderer/charts/lettering.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox2d, Eigen::Vector2d, Eigen::Vector3d;

constexpr double longest_bar = 0.4;    // Of the picture's shorter side.
constexpr double below_letters = 2.5;  // Room, in heights of a letter.
constexpr double between = 0.38;       // Sine of 22.5 degrees.
constexpr double end_on = 0.1;  // An axis that is shorter than this in the picture points at the viewer, or away.

/// Sizes in pixels.
struct Sizes {
  double letter;   // Height of a capital letter.
  double line;     // Width of lines.
  double outline;  // Width of the outline on each side.
  double margin;   // Distance from the edges of the picture.

  explicit Sizes(const Image& image)
      : letter(letter_height(image.width, image.height)),
        line(std::max(2.0, std::round(letter / 7))),
        outline(std::max(1.0, letter / 11)),
        margin(std::round(letter)) {}
};

struct Mark {
  Vector2d from, to;  // Ends of a line; of a text, `from` is its lower left corner.
  std::string text;   // Empty: a line.
  double width = 0;   // Of a line; of a text, its height.
};

AlignedBox2d extent_of(const std::vector<Mark>& marks) {
  AlignedBox2d box;
  for (const Mark& mark : marks) {
    const Vector2d half = Vector2d::Constant(mark.width / 2);
    if (mark.text.empty())
      box.extend((mark.from.cwiseMin(mark.to) - half).eval()).extend((mark.from.cwiseMax(mark.to) + half).eval());
    else
      box.extend(mark.from).extend(Vector2d(mark.from + Vector2d(text_width(mark.text, mark.width), -mark.width)));
  }
  return box;
}

void shift(const Vector2d& by, std::vector<Mark>& marks) {
  for (Mark& mark : marks) {
    mark.from += by;
    mark.to += by;
  }
}

/// Draws the outlines of all marks, and then the marks: an outline never covers a mark.
/// @param on_light  Whether ink is black.
void draw_marks(Image& image, const std::vector<Mark>& marks, double outline, bool on_light) {
  for (const bool is_ink : {false, true}) {
    const Vector3d color = Vector3d::Constant(is_ink != on_light);
    const double wider = is_ink ? 0 : outline;
    for (const Mark& mark : marks)
      if (mark.text.empty())
        draw_stroke(image, mark.from, mark.to, mark.width + 2 * wider, color);
      else
        draw_text(image, mark.from, mark.width, mark.text, color, wider);
  }
}

/// The letter of an axis, centred. Small letters have three quarters of the height of capital ones.
Mark axis_letter(int axis, const Vector2d& center, double letter) {
  const std::string text(1, "xyz"[axis]);
  return {center + Vector2d(-text_width(text, letter), 0.75 * letter) / 2, {}, text, letter};
}

/// The marks of an axis from the origin. @param direction  To the right, upwards, and towards the viewer.
std::vector<Mark> axis_marks(int axis, const Vector3d& direction, const Sizes& sizes) {
  const Vector2d origin = Vector2d::Zero(), along(direction.x(), -direction.y());
  if (along.norm() >= end_on) {
    const Vector2d tip = 3 * sizes.letter * along;
    return {{origin, tip, "", sizes.line},
            axis_letter(axis, tip + 0.9 * sizes.letter * along.normalized(), sizes.letter)};
  }
  const Mark letter = axis_letter(axis, Vector2d(-0.9, 0.9) * sizes.letter, sizes.letter);
  if (direction.z() > 0) return {{origin, origin, "", 3 * sizes.line}, letter};
  const Vector2d a = Vector2d(0.35, 0.35) * sizes.letter, b(a.x(), -a.y());
  return {{-a, a, "", sizes.line}, {-b, b, "", sizes.line}, letter};
}

/// The picture in the upper left corner of a larger one, by an even number of pixels, as films need it.
Image enlarged(const Image& image, double right, double below) {
  const auto even = [](double pixels) { return 2 * static_cast<int>(std::ceil(pixels / 2)); };
  Image result(image.width + even(right), image.height + even(below), image.channels);
  const bool is_white = is_light(image, {Vector2d(0, 0), Vector2d(image.width, image.height)});
  fill_box(result, {Vector2d(0, 0), Vector2d(result.width, result.height)}, Vector3d::Constant(is_white));
  for (int y = 0; y < image.height; ++y)
    std::copy_n(image.pixel(0, y), image.channels.size() * static_cast<std::size_t>(image.width), result.pixel(0, y));
  return result;
}

/// The dashes of a stroke. They follow the picture's columns or rows, so that those of its neighbours go on.
void add_dashes(const OutlineStroke& stroke, double dash, double width, std::vector<Mark>& marks) {
  const Vector2d way = stroke.to - stroke.from;
  const int axis = std::abs(way.x()) > std::abs(way.y()) ? 0 : 1;
  const double first = std::min(stroke.from[axis], stroke.to[axis]),
               last = std::max(stroke.from[axis], stroke.to[axis]);
  for (double i = std::floor(first / (2 * dash)); 2 * i * dash < last; ++i) {
    const double begin = std::max(2 * i * dash, first), end = std::min((2 * i + 1) * dash, last);
    const auto at = [&](double place) -> Vector2d {
      return stroke.from + (place - stroke.from[axis]) / way[axis] * way;
    };
    if (begin < end) marks.push_back({at(begin), at(end), "", width});
  }
}

}  // namespace

double round_length(double limit) {
  const double decade = std::pow(10.0, std::floor(std::log10(limit)));
  for (const double factor : {5.0, 2.0})
    if (factor * decade <= limit) return factor * decade;
  return decade;
}

Image with_room_beside(const Image& image, int coarseness) {
  const int width = coarseness * image.width, height = coarseness * image.height;
  int room = 0;
  for (int i = 0; i < 8; ++i) room = legend_width(width + room, height);  // Letters may grow with it.
  return enlarged(image, static_cast<double>(room) / coarseness, 0);
}

Image with_room_below(const Image& image, int coarseness) {
  const double letter = letter_height(coarseness * image.width, coarseness * image.height);
  return enlarged(image, 0, below_letters * letter / coarseness);
}

void draw_scale_bar(Image& image, double pixel_size, const std::string& unit) {
  const Sizes sizes(image);
  const double length = round_length(longest_bar * std::min(image.width, image.height) * pixel_size);
  const std::string number = round_ticks({0, length}, 2).back().label, none = number == "1" ? "unit" : "units";
  const Vector2d left(sizes.margin, image.height - sizes.margin), right(left + Vector2d(length / pixel_size, 0));
  const Vector2d end(0, sizes.letter / 2), thick(0, sizes.line), wide(sizes.line, 0);
  // They do not overlap: ink that lies twice on a pixel at the end would make the bar longer.
  const std::array<AlignedBox2d, 3> bars{AlignedBox2d(left - thick, right),
                                         AlignedBox2d(left - end, Vector2d(left + wide - thick)),
                                         AlignedBox2d(Vector2d(right - wide - end), Vector2d(right - thick))};
  const std::vector<Mark> text{{left - 1.5 * end, {}, number + " " + (unit.empty() ? none : unit), sizes.letter}};
  const AlignedBox2d whole = extent_of(text).merged(bars[0]);
  const bool on_light = is_light(image, whole);
  const Vector2d outline = Vector2d::Constant(sizes.outline);
  for (const AlignedBox2d& bar : bars)
    fill_box(image, {bar.min() - outline, bar.max() + outline}, Vector3d::Constant(on_light));
  for (const AlignedBox2d& bar : bars) fill_box(image, bar, Vector3d::Constant(!on_light));
  draw_marks(image, text, sizes.outline, on_light);
}

void draw_caption(Image& image, const std::string& text) {
  const Sizes sizes(image);
  const Vector2d right(image.width - sizes.margin, image.height - sizes.margin);
  const double room = std::max(1.0, image.width - 2 * sizes.margin);
  const double letter = std::min(sizes.letter, room / text_width(text, 1));
  const std::vector<Mark> marks{{right - Vector2d(text_width(text, letter), 0), {}, text, letter}};
  draw_marks(image, marks, sizes.outline, is_light(image, extent_of(marks)));
}

void draw_axes(Image& image, const Vector3d& right, const Vector3d& up) {
  const Sizes sizes(image);
  const Vector3d towards = right.cross(up);
  std::vector<Mark> marks;
  for (int axis = 0; axis < 3; ++axis)
    for (Mark& mark : axis_marks(axis, {right[axis], up[axis], towards[axis]}, sizes)) marks.push_back(std::move(mark));
  shift(Vector2d::Constant(sizes.margin) - extent_of(marks).min(), marks);
  draw_marks(image, marks, sizes.outline, is_light(image, extent_of(marks)));
}

void draw_directions(Image& image, const std::vector<std::pair<std::string, double>>& directions) {
  const Sizes sizes(image);
  const double from_corner = sizes.margin + 4 * sizes.letter;
  const Vector2d center(image.width - legend_width(image.width, image.height) - from_corner, from_corner);
  std::vector<Mark> marks;
  for (const auto& [text, angle] : directions) {
    const Vector2d along(std::cos(angle * pi / 180), -std::sin(angle * pi / 180)), tip = 2 * sizes.letter * along;
    const Vector2d corner(-text_width(text, sizes.letter) / 2, sizes.letter / 2);
    marks.push_back({center - tip, center + tip, "", sizes.line});
    marks.push_back({center + 1.5 * tip + corner, {}, text, sizes.letter});
  }
  if (!marks.empty()) draw_marks(image, marks, sizes.outline, is_light(image, extent_of(marks)));
}

std::string anatomical_letters(const Vector3d& direction) {
  std::array<int, 3> axes{0, 1, 2};
  std::sort(axes.begin(), axes.end(), [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
  std::string letters;
  for (const int axis : axes)
    if (letters.empty() || std::abs(direction[axis]) > between) letters += (direction[axis] > 0 ? "RAS" : "LPI")[axis];
  return letters;
}

void draw_anatomy(Image& image, const Vector3d& right, const Vector3d& up, int room) {
  const Sizes sizes(image);
  const Vector2d size(image.width - room, image.height);
  for (const Vector2d& side : {Vector2d(1, 0), Vector2d(-1, 0), Vector2d(0, 1), Vector2d(0, -1)}) {
    std::vector<Mark> marks{{{0, 0}, {}, anatomical_letters(side.x() * right - side.y() * up), sizes.letter}};
    const Vector2d free = size - extent_of(marks).sizes() - Vector2d::Constant(2 * sizes.margin);
    shift((size + side.cwiseProduct(free)) / 2 - extent_of(marks).center(), marks);
    draw_marks(image, marks, sizes.outline, is_light(image, extent_of(marks)));
  }
}

void draw_outline(Image& image, const std::vector<OutlineStroke>& strokes, bool visible, bool hidden) {
  const Sizes sizes(image);
  std::vector<Mark> marks;
  for (const OutlineStroke& stroke : strokes)
    if (stroke.is_hidden && hidden)
      add_dashes(stroke, sizes.letter / 2, sizes.line / 2, marks);
    else if (!stroke.is_hidden && visible)
      marks.push_back({stroke.from, stroke.to, "", sizes.line});
  if (!marks.empty()) draw_marks(image, marks, sizes.outline / 2, is_light(image, extent_of(marks)));
}

}  // namespace tensorray
