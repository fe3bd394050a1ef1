#pragma once
/// The pictures that every method can write, and the header entries of all files.

#include <functional>
#include <vector>

#include "renderer/camera/camera.h"
#include "renderer/images/image.h"
#include "renderer/surfaces/plate.h"
#include "scenes/description/method.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// "image" and "exr", and more.
std::vector<Output> picture_outputs(const std::vector<Output>& more = {});

/// "spectral", for methods whose light has bands.
Output spectral_output();

/// "maps", for methods whose pixels are those of a plate.
Output maps_output();

/// The picture as a display shows it: R, G, B, and A if there is one.
/// @param holds_alpha  Whether the file format has an alpha. Colours are then divided by alpha, as such formats need
///                     them. Otherwise they stay multiplied by it, which shows the picture on black.
/// @param coarseness   Pixels of the finished picture along an edge of this one's: a preview (> 1) has lines of bodies,
///                     and room for other annotations.
Image display_image(const Scene& scene, const Render& render, bool holds_alpha, int coarseness = 1);

/// The exposure of the picture that a display shows, in stops: the scene's, or the one that "auto" chooses.
double display_exposure(const Scene& scene, const Render& render);

/// Header entries about the origin of a file: program, scene, seed, scale, colour, and Render::metadata.
ImageMetadata provenance(const Scene& scene, const Render& render);

/// Writes Render::grids; for Output::write.
void write_grids(const std::filesystem::path& file, const Scene& scene, const Render& render);

/// The view of a picture whose pixels are those of a plate.
PictureView picture_view(const Plate& plate);

/// The view of a picture of a camera.
PictureView picture_view(const Camera& camera);

/// A legend of a scene's light, for Render::draw_legend: wavelengths (RGB mode: flexibilities) and exposure.
std::function<void(Image&, double exposure)> light_legend(const Scene& scene);

/// The colour of a wavelength (nm), linear Rec. 709, as saturated as a display can show it; grey if the eye sees none.
Eigen::Vector3d wavelength_color(double wavelength);

}  // namespace tensorray
