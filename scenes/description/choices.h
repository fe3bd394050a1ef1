#pragma once
/// Names in scene files for the enumerations that several methods or the whole scene use (see scenes/keys/values.h).

#include <string>

#include "renderer/camera/camera.h"
#include "renderer/charts/colormap.h"
#include "renderer/lights/beam.h"
#include "scenes/description/description.h"
#include "scenes/keys/values.h"
#include "tracing/bending/bending.h"
#include "volumes/files/tensor_files.h"
#include "volumes/tensors/eigenvalues.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {

inline Words words(Derive) { return {"none", "gradient", "hessian", "viscous_stress", "-viscous_stress"}; }
inline Words words(Eigenvalues) { return {"auto", "raw", "absolute", "positive"}; }

inline Choices<Interpolation> choices(Interpolation) {
  return {{"cubic", Interpolation::cubic}, {"linear", Interpolation::linear}};
}

inline Words words(BorderChoice) { return {"auto", "fade", "extend"}; }
inline Words words(BoundsChoice) { return {"auto", "none"}; }
inline Words words(BendingMethod) { return {"auto", "euler", "splitting", "splitting4", "rk4", "bs23", "dopri5"}; }
inline Words words(BeamPattern) { return {"grid", "stratified", "sobol", "random"}; }
inline Words words(BeamReach) { return {"plate", "volume"}; }
inline Words words(Projection) { return {"perspective", "orthographic"}; }
inline Words words(LightKind) { return {"constant", "environment", "directional", "area", "point"}; }
inline Words words(LightCaustic) { return {"auto", "map", "photons"}; }
inline Words words(Annotation) { return {"scale", "axes", "legend", "body", "hidden"}; }
inline Words words(UpAxis) { return {"z", "y"}; }
inline Words words(ExrType) { return {"float", "half"}; }
inline Words words(Pattern) { return {"none", "checkerboard"}; }

inline Words words(Invariant) {
  Words all;
  for (const std::string& name : invariant_names()) all.push_back(name.c_str());
  return all;
}

inline Words words(Colormap) {
  return {"viridis", "magma", "inferno", "plasma", "cividis", "cool_warm", "twilight", "grey"};
}

}  // namespace tensorray
