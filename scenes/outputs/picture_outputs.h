#pragma once
/// @file scenes/outputs/picture_outputs.h
/// The pictures that every method can write, and what the headers of all files say.

#include <vector>

#include "renderer/images/image.h"
#include "scenes/description/method.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// "image" and "exr".
std::vector<Output> picture_outputs();

/// "spectral", of methods whose light has bands.
Output spectral_output();

/// The picture as a display shows it: R, G, B, and A if there is one.
/// @param holds_alpha  Whether colours are not multiplied by alpha, as formats with an alpha want them; otherwise the
///                     picture is seen on black.
Image display_image(const Scene& scene, const Render& render, bool holds_alpha);

/// The exposure, in stops, at which a scene-linear picture is well shown: its brightest hundredth just below white.
double automatic_exposure(const Image& linear);

/// What a file's header tells of its origin: program, scene, seed, scale, colour.
ImageMetadata provenance(const Scene& scene, const Render& render);

/// Writes Render::grids: an Output::write.
void write_grids(const std::filesystem::path& file, const Scene& scene, const Render& render);

}  // namespace tensorray
