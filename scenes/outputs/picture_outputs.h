#pragma once
/// @file scenes/outputs/picture_outputs.h
/// The pictures that every method can write, and the header entries of all files.

#include <optional>
#include <vector>

#include "renderer/images/image.h"
#include "scenes/description/method.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// "image" and "exr", and more.
std::vector<Output> picture_outputs(const std::vector<Output>& more = {});

/// "spectral", for methods whose light has bands.
Output spectral_output();

/// The picture as a display shows it: R, G, B, and A if there is one.
/// @param holds_alpha  Whether the file format has an alpha. Colours are then divided by alpha, as such formats need
///                     them. Otherwise they stay multiplied by it, which shows the picture on black.
Image display_image(const Scene& scene, const Render& render, bool holds_alpha);

/// The exposure of the picture that a display shows, in stops: the scene's, or the one that "auto" chooses.
double display_exposure(const Scene& scene, const Render& render);

/// The value of R, G or B that 99% of the lit pixels of a scene-linear picture do not exceed; nothing if it is black.
std::optional<double> brightest_hundredth(const Image& linear);

/// Header entries about the origin of a file: program, scene, seed, scale, colour, and Render::metadata.
ImageMetadata provenance(const Scene& scene, const Render& render);

/// Writes Render::grids; for Output::write.
void write_grids(const std::filesystem::path& file, const Scene& scene, const Render& render);

}  // namespace tensorray
