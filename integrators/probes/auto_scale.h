#pragma once
/// @file integrators/probes/auto_scale.h
/// Chooses a field's scale (BendingSettings::scale) so that light bends visibly but rays do not tangle.

#include "base/progress.h"
#include "integrators/bending/bending.h"
#include "renderer/lights/beam.h"

namespace tensorray {

struct AutoScale {
  double scale = 1;
  double median_turn = 0;    ///< Turn of the median bent ray from start to end, radians, at s = 0.2 and this scale.
  double bent_fraction = 0;  ///< Fraction of the probe rays that the field turns at all.
};

/// Finds the scale at which the median probe ray turns by 0.15 rad at s = 0.2. Rays that do not turn are left out. A
/// field that turns no ray gets scale 1. Deterministic; runs on all threads.
/// @throw Cancelled.
AutoScale choose_scale(const TensorField& field, const Geometry& geometry, const Beam& beam, const Progress& progress);

}  // namespace tensorray
