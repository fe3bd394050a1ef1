#pragma once
/// @file renderer/film/spectral_image.h
/// From the light on a film to pictures: RGB, and spectra.

#include <vector>

#include <Eigen/Core>

#include "renderer/color/spectrum.h"
#include "renderer/film/film.h"
#include "renderer/images/image.h"

namespace tensorray {

/// The colours of a film whose channel k is `bands[k]`, relative to the undisturbed beam (1: undisturbed): a picture
/// with the channels R, G, B, each pixel `xyz_to_rgb` times the sum of film_k xyz_k. Undisturbed light has Y = 1.
/// A film that holds R, G and B themselves is one of bands whose xyz are the unit vectors, and the identity.
/// Runs on all threads; the result does not depend on their number.
/// @throw std::invalid_argument unless the film has a channel for each band.
Image linear_image(const Film& film, const std::vector<Band>& bands, const Eigen::Matrix3d& xyz_to_rgb);

struct SpectralImage {
  Image image;
  ImageMetadata metadata;  ///< What the layout asks for; more may be added.
};

/// The film as spectral irradiance, in the layout of Fichet et al. 2021 ("An OpenEXR Layout for Spectral Images", JCGT
/// 10(3)): for other programs to show, R, G, B as by `linear_image`; then a channel for each band, "S0.550,000000nm",
/// which holds film_k · beam_irradiance · power_k / width_k. To be written as EXR.
/// @param film             Relative to the undisturbed beam (1: undisturbed), a channel for each band.
/// @param beam_irradiance  Of the undisturbed beam over all bands; the spectral irradiance is in its unit per nm.
/// @throw std::invalid_argument unless the film has a channel for each band.
SpectralImage spectral_image(const Film& film, const std::vector<Band>& bands, double beam_irradiance,
                             const Eigen::Matrix3d& xyz_to_rgb);

}  // namespace tensorray
