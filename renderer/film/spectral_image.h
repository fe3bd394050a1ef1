#pragma once
/// Conversion of the light on a film to RGB and spectral pictures; how far two pictures are apart.

#include <vector>

#include <Eigen/Core>

#include "renderer/film/film.h"
#include "renderer/images/image.h"
#include "renderer/spectra/spectrum.h"

namespace tensorray {

/// Converts a film whose channel k is `bands[k]` to colours relative to the undisturbed beam (1: undisturbed). The
/// picture has the channels R, G, B; each pixel is `xyz_to_rgb` times Σ_k film_k xyz_k. Runs on all threads.
/// @throw std::invalid_argument unless the film has one channel per band.
Image linear_image(const Film& film, const std::vector<Band>& bands, const Eigen::Matrix3d& xyz_to_rgb);

/// The picture of a film whose channels are red, green and blue of the working space.
Image color_image(const Film& color);

enum class SpectralQuantity { irradiance, radiance };

struct SpectralImage {
  Image image;             ///< Three channels of colour, then one for each band.
  ImageMetadata metadata;  ///< The metadata that the layout requires; callers may add more.
  std::vector<Band> bands;
  SpectralQuantity quantity = SpectralQuantity::irradiance;
};

/// The film as spectral irradiance or radiance, in the layout of Fichet et al. 2021 ("An OpenEXR Layout for Spectral
/// Images", JCGT 10(3)). The first channels are R, G, B as in `linear_image`, which let other programs show the
/// picture. Then follows one channel per band, such as "S0.550,000000nm", with film_k · beam · power_k / width_k.
/// @param film             Relative to the undisturbed beam (1: undisturbed), one channel per band.
/// @param quantity         Decides the unit in the header.
/// @param beam  What a film of 1 means, over all bands, in W.m^-2 or W.m^-2.sr^-1. The result is
///                         in that unit per nm.
/// @throw std::invalid_argument unless the film has one channel per band.
SpectralImage spectral_image(const Film& film, const std::vector<Band>& bands, SpectralQuantity quantity, double beam,
                             const Eigen::Matrix3d& xyz_to_rgb);

/// The root of the sum of squared differences, as a part of that of `exact`, in the first three channels (the colours)
/// or as many as there are; 0 if `exact` is black.
/// @throw std::invalid_argument if the pictures differ in size or in their number of colours.
double relative_distance(const Image& image, const Image& exact);

}  // namespace tensorray
