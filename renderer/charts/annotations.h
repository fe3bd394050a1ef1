#pragma once
/// @file renderer/charts/annotations.h
/// Small drawings in the corners of a picture that say how to read it: a scale bar, a caption, the axes of the
/// world, a strip of colours. And the lines of bodies over it.

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "renderer/images/image.h"

namespace tensorray {

// All functions draw over the first three channels of a picture; a channel "A" becomes opaque under what they draw. The
// picture may be scene-linear or display-referred; 1 is taken as white. They draw black on light grounds and white on
// dark ones, with a thin outline of the other. Capital letters have 0.024 of the shorter side, 11 pixels at least.

/// The greatest length of the form 1, 2 or 5 times a power of ten that is not above `limit` (finite, > 0).
double round_length(double limit);

/// Draws a scale bar in the lower left corner: a round length of at most 0.4 of the picture's shorter side, and its
/// number. @param pixel_size  World units along x; finite, > 0.
void draw_scale_bar(Image& image, double pixel_size);

/// Draws a line of text in the lower right corner.
void draw_caption(Image& image, const std::string& text);

/// Draws the axes of the world as the picture shows them, in the upper left corner, with the letters x, y, z. An axis
/// that points at the viewer is a dot, one that points away is a cross.
/// @param right, up  Directions of the picture in the world; unit, normal to each other.
void draw_axes(Image& image, const Eigen::Vector3d& right, const Eigen::Vector3d& up);

/// Draws lines through one point in the upper right corner, each with a text at one end, and its angle from right to
/// up, degrees.
void draw_directions(Image& image, const std::vector<std::pair<std::string, double>>& directions);

/// Colours from left to right, and what they mean.
struct ColorStrip {
  std::string left, right;                       ///< What stands before and behind them. May be empty.
  std::function<Eigen::Vector3d(double)> color;  ///< At a position from 0 to 1, in the colour space of the picture.
  std::string note;                              ///< A line below. May be empty.
};

/// Draws it in the upper right corner.
void draw_color_strip(Image& image, const ColorStrip& strip);

/// A straight part of a line of a body, in pixels.
struct OutlineStroke {
  Eigen::Vector2d from, to;
  bool is_hidden = false;
};

/// Draws the lines that are visible, those that are hidden (thinner, and dashed), or both.
void draw_outline(Image& image, const std::vector<OutlineStroke>& strokes, bool visible, bool hidden);

}  // namespace tensorray
