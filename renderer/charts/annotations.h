#pragma once
/// Small drawings that say how to read a picture: a scale bar and the axes of the world in its corners, directions of a
/// patient at its edges, a caption below it. And the lines of bodies over it.

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "renderer/images/image.h"

namespace tensorray {

// All functions draw over the first three channels of a picture; a channel "A" becomes opaque under what they draw. The
// picture may be scene-linear or display-referred; 1 is taken as white. They draw black on light grounds and white on
// dark ones, with a thin outline of the other. Letters are as high as letter_height says.

/// The greatest length of the form 1, 2 or 5 times a power of ten that is not above `limit` (finite, > 0).
double round_length(double limit);

/// Draws a scale bar in the lower left corner: a round length of at most 0.4 of the picture's shorter side, and its
/// number. @param pixel_size  World units along x; finite, > 0. @param unit  Of world space; empty: not known.
void draw_scale_bar(Image& image, double pixel_size, const std::string& unit);

/// A picture with room at its right or below it, as a legend or a line of text needs it: black or white, as the picture
/// is dark or light. The room depends on the size of the picture alone, so that all frames of a film have one size.
/// @param coarseness  Pixels of the finished picture along an edge of this one's: its room has the same part of it.
Image with_room_beside(const Image& image, int coarseness = 1);
Image with_room_below(const Image& image, int coarseness = 1);

/// Draws a line of text in the lower right corner; a long one is smaller.
void draw_caption(Image& image, const std::string& text);

/// Draws the axes of the world as the picture shows them, in the upper left corner, with the letters x, y, z. An axis
/// that points at the viewer is a dot, one that points away is a cross.
/// @param right, up  Directions of the picture in the world; unit, normal to each other.
void draw_axes(Image& image, const Eigen::Vector3d& right, const Eigen::Vector3d& up);

/// Draws lines through one point in the upper right corner of what is beside a legend (with_room_beside), each with a
/// text at one end, and its angle from right to up, degrees.
void draw_directions(Image& image, const std::vector<std::pair<std::string, double>>& directions);

/// The letters of a direction of a patient in RAS: R, L (right, left: +x, -x), A, P (anterior, posterior: y), S, I
/// (superior, inferior: z). A direction between them has several letters, the nearest one first.
std::string anatomical_letters(const Eigen::Vector3d& direction);

/// Draws them at the four edges. @param room  Pixels at the right of the picture that belong to a legend.
void draw_anatomy(Image& image, const Eigen::Vector3d& right, const Eigen::Vector3d& up, int room);

/// A straight part of a line of a body, in pixels.
struct OutlineStroke {
  Eigen::Vector2d from, to;
  bool is_hidden = false;
};

/// Draws the lines that are visible, those that are hidden (thinner, and dashed), or both.
void draw_outline(Image& image, const std::vector<OutlineStroke>& strokes, bool visible, bool hidden);

}  // namespace tensorray
