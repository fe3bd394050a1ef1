#pragma once
/// @file renderer/materials/scattering.h
/// What all models of scattering at a surface share.
///
/// Frame: local, the surface's normal is +z. `wi` (towards the light) and `wo` (towards the viewer) are unit vectors
/// that point away from the surface. f(wi, wo) is the radiance that leaves along wo for each unit of irradiance that
/// arrives along wi, in 1/sr, without a cosine.
///
/// Bands: every function works on all bands of a path at once. No index depends on the wavelength in a way that would
/// bend a path (no dispersion), so all bands share every direction: a path gives each of them a sample, picture noise
/// has no colour, and the geometry, which is the larger part of the cost, is paid once. Hero wavelengths would gain
/// nothing here. There may be any number of bands, so the caller owns the memory: no function allocates.

#include <Eigen/Core>

namespace tensorray {

using BandValues = Eigen::ArrayXd;             ///< One value for each band.
using BandsIn = Eigen::Ref<const BandValues>;  ///< Contiguous; a BandValues or a segment of one.
using BandsOut = Eigen::Ref<BandValues>;

}  // namespace tensorray
