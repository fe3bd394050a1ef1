#pragma once
/// Conventions that all models of scattering at a surface share.
///
/// Frame: local; +z is the surface's normal. `wi` (towards the light) and `wo` (towards the viewer) are unit vectors
/// that point away from the surface. f(wi, wo) is the radiance along wo per unit of irradiance along wi, in 1/sr.
///
/// Bands: every function works on all bands of a path at once. No index varies with wavelength in a way that bends a
/// path (no dispersion), so all bands share every direction. Each path gives one sample to every band, so noise has no
/// colour, and the geometry, which is most of the cost, is computed once. The caller owns the memory: no function
/// allocates. A path whose light was bent has one band left.

#include <Eigen/Core>

namespace tensorray {

using BandValues = Eigen::ArrayXd;             ///< One value for each band.
using BandsIn = Eigen::Ref<const BandValues>;  ///< Contiguous; a BandValues or a segment of one.
using BandsOut = Eigen::Ref<BandValues>;

}  // namespace tensorray
