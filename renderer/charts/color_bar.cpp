#include "renderer/charts/color_bar.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <Eigen/Geometry>

#include "renderer/charts/ink.h"
#include "renderer/charts/lettering.h"

namespace tensorray {
namespace {

using Box = Eigen::AlignedBox2d;  // In pixels from the upper left corner, continuous.

/// Tolerance at the ends of the range, as a fraction of a step: a tick this close outside is still in the range.
constexpr double bar_rounding = 1e-9;

std::string fixed(double value, int decimals) {
  std::array<char, 400> text;
  const auto end = std::to_chars(text.begin(), text.end(), value, std::chars_format::fixed, decimals);
  return {text.begin(), end.ptr};
}

int decade_of(double value) { return static_cast<int>(std::floor(std::log10(std::abs(value)) + bar_rounding)); }

/// @param largest  Decade of the largest number of the scale. @param last  Decade of the last digit to be written.
std::string label_of(double value, int largest, int last) {
  if (value == 0) return "0";
  if (largest < 5 && last >= -4) return fixed(value, std::max(0, -last));
  return fixed(value / std::pow(10.0, largest), std::max(0, largest - last)) + "e" + std::to_string(largest);
}

/// The smallest step of the form 1, 2 or 5 times a power of ten that divides `size` into at most `most` steps.
double round_step(double size, int most) {
  const double raw = size / most * (1 - bar_rounding), decade = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * decade >= raw) return factor * decade;
  return 10 * decade;
}

std::vector<Tick> linear_ticks(const ValueRange& range, int most) {
  const double step = round_step(range.high - range.low, most - 1);
  const double first = std::ceil(range.low / step - bar_rounding), last = std::floor(range.high / step + bar_rounding);
  const int largest = decade_of(std::max(std::abs(first), std::abs(last)) * step);
  std::vector<Tick> ticks;
  for (double i = first; i <= last; ++i) ticks.push_back({i * step, label_of(i * step, largest, decade_of(step))});
  return ticks;
}

/// Ticks at `factors` times powers of ten within the range. Only every `stride`-th power is used.
std::vector<Tick> decades(const ValueRange& range, const std::vector<double>& factors, int stride) {
  std::vector<Tick> ticks;
  for (int decade = decade_of(range.low); decade <= decade_of(range.high); ++decade)
    for (const double factor : factors) {
      const double value = factor * std::pow(10.0, decade);
      if (decade % stride != 0 || value < range.low * (1 - bar_rounding) || value > range.high * (1 + bar_rounding))
        continue;
      ticks.push_back({value, label_of(value, decade, decade)});
    }
  return ticks;
}

std::vector<Tick> logarithmic_ticks(const ValueRange& range, int most) {
  const auto few = static_cast<std::size_t>(most);
  std::vector<Tick> ticks = decades(range, {1}, 1);
  for (int stride = 2; ticks.size() > few; ++stride) ticks = decades(range, {1}, stride);
  if (ticks.size() < 2) ticks = decades(range, {1, 2, 5}, 1);
  return ticks.size() < 2 || ticks.size() > few ? linear_ticks(range, most) : ticks;
}

void frame(Image& image, const Box& box, double width, const Eigen::Vector3d& color) {
  const Eigen::Vector2d a = box.min(), b = box.max();
  const Eigen::Vector2d w(width, width);
  fill_box(image, {a - w, Eigen::Vector2d(b.x() + width, a.y())}, color);
  fill_box(image, {Eigen::Vector2d(a.x() - width, b.y()), b + w}, color);
  fill_box(image, {Eigen::Vector2d(a.x() - width, a.y()), Eigen::Vector2d(a.x(), b.y())}, color);
  fill_box(image, {Eigen::Vector2d(b.x(), a.y()), Eigen::Vector2d(b.x() + width, b.y())}, color);
}

/// Sizes in pixels. All are proportional to the height of a capital letter.
struct Layout {
  double letter;  ///< Height of a capital letter.
  double line;    ///< Width of lines; a whole number of pixels, so that lines are sharp.

  explicit Layout(const Image& image)
      : letter(letter_height(image.width, image.height)), line(std::max(1.0, std::round(0.09 * letter))) {}

  double padding() const { return 0.6 * letter; }
  double gap() const { return 0.5 * letter; }  ///< Distance between a mark and its label, or a title and the contents.
  double row() const { return 1.6 * letter; }  ///< Distance between the lines of a title.
  double swatch() const { return std::round(1.5 * letter); }  ///< Width of the colour bar and of the squares of a key.
  double above(const std::string& title) const {              ///< Height of a title and the gap below it.
    const auto lines = title.empty() ? 0 : 1 + std::count(title.begin(), title.end(), '\n');
    return std::round(row() * static_cast<double>(lines) + (lines == 0 ? 0 : gap()));
  }
};

struct Panel {
  Box inside;  ///< The panel without padding; its corners lie on whole pixels.
  Eigen::Vector3d ink;
};

/// Draws a panel at the right edge of the picture, with room for contents of the given size, and writes the title.
/// @return with the place of the contents.
Panel lay_panel(Image& image, const Layout& layout, Eigen::Vector2d size, const std::string& title,
                const LegendPlace& place) {
  std::vector<std::string> lines;
  std::istringstream text(title);
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  for (const std::string& line : lines) size.x() = std::max(size.x(), text_width(line, layout.letter));
  const double top = layout.above(title);
  const double padding = std::round(layout.padding());
  const Eigen::Vector2d full = (size + Eigen::Vector2d(2 * padding, top + 2 * padding)).array().ceil();
  const double middle = (static_cast<double>(place.part) + 0.5) / static_cast<double>(place.parts) * image.height;
  const Eigen::Vector2d corner(image.width - full.x() - padding, std::floor(middle - full.y() / 2));
  const Box outside(corner, Eigen::Vector2d(corner + full));
  const bool on_light = is_light(image, outside);
  fill_box(image, outside, Eigen::Vector3d::Constant(on_light), on_light ? 0.75 : 0.6);
  const Eigen::Vector2d inset = Eigen::Vector2d::Constant(padding);
  Panel panel{Box(outside.min() + inset, outside.max() - inset), Eigen::Vector3d::Constant(!on_light)};
  Eigen::Vector2d at = panel.inside.min() + Eigen::Vector2d(0, layout.letter);
  for (const std::string& line : lines) {
    draw_text(image, at, layout.letter, line, panel.ink);
    at.y() += layout.row();
  }
  panel.inside.min().y() += top;
  return panel;
}

void check(const Image& image) {
  if (!begins_with_rgb(image))
    throw std::invalid_argument("a legend needs a picture that begins with channels R, G, B");
}

void check(const ValueRange& range) {
  if (!(range.low < range.high) || !std::isfinite(range.high - range.low) || (range.logarithmic && range.low <= 0))
    throw std::invalid_argument("a scale needs a finite range that rises, and on a logarithmic one values above 0");
}

template <class Items>
double widest_text(const Items& items, double height) {
  double width = 0;
  for (const auto& item : items) width = std::max(width, text_width(item.label, height));
  return width;
}

/// Writes to the right of `left`. Small letters are centred vertically on `middle`.
void write_label(Image& image, const Layout& layout, double left, double middle, const std::string& label,
                 const Eigen::Vector3d& ink) {
  draw_text(image, {left, middle + layout.letter / 2}, layout.letter, label, ink);
}

}  // namespace

int legend_width(int width, int height) { return static_cast<int>(10 * letter_height(width, height)); }

std::vector<Tick> round_ticks(const ValueRange& range, int most) {
  check(range);
  if (most < 2) throw std::invalid_argument("a scale needs at least two ticks");
  return range.logarithmic ? logarithmic_ticks(range, most) : linear_ticks(range, most);
}

void draw_color_bar(Image& image, const ColorBar& bar, const LegendPlace& place) {
  check(image);
  check(bar.range);
  if (!bar.color) throw std::invalid_argument("a colour bar needs colours");
  const Layout layout(image);
  const double part = image.height / static_cast<double>(place.parts), end = layout.letter / 2;
  const double room = part - layout.above(bar.title) - 4 * layout.padding() - 2 * end;
  const double height = std::round(std::max(2 * layout.letter, std::min(0.6 * part, room)));
  const std::vector<Tick> ticks = round_ticks(bar.range, std::clamp(static_cast<int>(height / layout.row()), 2, 7));
  const double mark = std::round(0.4 * layout.letter), labels = layout.swatch() + 2 * layout.line + mark + layout.gap();
  const Panel panel =
      lay_panel(image, layout, {labels + widest_text(ticks, layout.letter), height + 2 * end}, bar.title, place);

  const Eigen::Vector2d corner = panel.inside.min() + Eigen::Vector2d(layout.line, std::round(end));
  const Box box(corner, Eigen::Vector2d(corner + Eigen::Vector2d(layout.swatch(), height)));
  for_each_pixel(image, box, [&](int x, int y, double coverage) {
    lay_over(image, x, y, bar.color(std::clamp((box.max().y() - y - 0.5) / height, 0.0, 1.0)), coverage);
  });
  frame(image, box, layout.line, panel.ink);
  for (const Tick& tick : ticks) {
    const double y = box.max().y() - bar.range.position(tick.value) * height;
    const double line = std::round(y - layout.line / 2), right = box.max().x() + layout.line;
    fill_box(image, {Eigen::Vector2d(right, line), Eigen::Vector2d(right + mark, line + layout.line)}, panel.ink);
    write_label(image, layout, right + mark + layout.gap(), line + layout.line / 2, tick.label, panel.ink);
  }
}

void draw_color_key(Image& image, const ColorKey& key, const LegendPlace& place) {
  check(image);
  if (key.entries.empty()) throw std::invalid_argument("a key of colours needs entries");
  const Layout layout(image);
  const double row = std::round(2.1 * layout.letter);
  const double label = layout.swatch() + 2 * layout.line + layout.gap();
  const double rows = row * static_cast<double>(key.entries.size() - 1) + layout.swatch() + 2 * layout.line;
  const Panel panel =
      lay_panel(image, layout, {label + widest_text(key.entries, layout.letter), rows}, key.title, place);
  Eigen::Vector2d corner = panel.inside.min() + Eigen::Vector2d::Constant(layout.line);
  for (const ColorKeyEntry& entry : key.entries) {
    const Box square(corner, Eigen::Vector2d(corner + Eigen::Vector2d::Constant(layout.swatch())));
    fill_box(image, square, entry.color);
    frame(image, square, layout.line, panel.ink);
    write_label(image, layout, panel.inside.min().x() + label, square.center().y(), entry.label, panel.ink);
    corner.y() += row;
  }
}

}  // namespace tensorray
