#pragma once
/// @file scenes/outputs/annotations.h
/// What is drawn over display pictures (`output.annotations`), so that they can be read alone.

#include <functional>

#include "renderer/camera/camera.h"
#include "renderer/images/image.h"
#include "renderer/surfaces/plate.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// The view of a picture whose pixels are those of a plate.
PictureView picture_view(const Plate& plate);

/// The view of a picture of a camera.
PictureView picture_view(const Camera& camera);

/// A legend of the light of a scene, for Render::draw_legend: its wavelengths (in RGB mode, its flexibilities) and the
/// exposure.
std::function<void(Image&, double exposure)> light_legend(const Scene& scene);

/// Draws the caption, the scale bar and the axes that `output` asks for, if the picture has them.
void draw_annotations(const OutputDescription& output, const Render& render, Image& image);

/// The colour of light of one wavelength (nm) for the eye, linear Rec. 709, as saturated as a display can show it; grey
/// if the eye does not see it.
Eigen::Vector3d wavelength_color(double wavelength);

}  // namespace tensorray
