#pragma once
/// @file integrators/bending/radiance_change.h
/// How much the radiance of light changes where photons keep their power. The flow of Eq. 5 does not preserve volume in
/// phase space: its divergence is σ (tr T − 3 VᵀTV). Along light of strength σ, L_end = L_start e^(−Λ), with
///   Λ = ∫ σ (tr T − 3 VᵀTV) dt.
/// A ray that is traced backwards, from the viewer, has −σ; the radiance that it finds is multiplied by e^(+Λ).

#include "integrators/bending/bending.h"

namespace tensorray {

/// Λ along a recorded ray: one tensor sample for each piece of about 1.5 voxels (less where light turns), at its
/// middle, with the direction of its chord. The error falls with the square of a voxel. Pieces outside the volume do
/// not count.
/// @param strength  σ = s · scale of the ray as it was traced.
double log_radiance_change(const TensorField& field, const Geometry& geometry, const Track& track, double strength);

}  // namespace tensorray
