#pragma once
/// @file scenes/description/choices.h
/// Names in scene files for the enumerations that several methods or the whole scene use (see scenes/keys/values.h).

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

inline Choices<Derive> choices(Derive) {
  return {{"none", Derive::none}, {"gradient", Derive::gradient}, {"hessian", Derive::hessian}};
}

inline Choices<Eigenvalues> choices(Eigenvalues) {
  return {{"auto", Eigenvalues::automatic},
          {"raw", Eigenvalues::raw},
          {"absolute", Eigenvalues::absolute},
          {"positive", Eigenvalues::positive}};
}

inline Choices<Interpolation> choices(Interpolation) {
  return {{"cubic", Interpolation::cubic}, {"linear", Interpolation::linear}};
}

inline Choices<BorderChoice> choices(BorderChoice) {
  return {{"auto", BorderChoice::automatic}, {"fade", BorderChoice::fade}, {"extend", BorderChoice::extend}};
}

inline Choices<BoundsChoice> choices(BoundsChoice) {
  return {{"auto", BoundsChoice::automatic}, {"none", BoundsChoice::none}};
}

inline Choices<BendingMethod> choices(BendingMethod) {
  return {{"auto", BendingMethod::automatic},
          {"euler", BendingMethod::euler},
          {"splitting", BendingMethod::splitting},
          {"splitting4", BendingMethod::splitting4},
          {"rk4", BendingMethod::rk4},
          {"bs23", BendingMethod::bs23},
          {"dopri5", BendingMethod::dopri5}};
}

inline Choices<BeamPattern> choices(BeamPattern) {
  return {{"grid", BeamPattern::grid},
          {"stratified", BeamPattern::stratified},
          {"sobol", BeamPattern::sobol},
          {"random", BeamPattern::random}};
}

inline Choices<Projection> choices(Projection) {
  return {{"perspective", Projection::perspective}, {"orthographic", Projection::orthographic}};
}

inline Choices<LightKind> choices(LightKind) {
  return {{"constant", LightKind::constant},
          {"environment", LightKind::environment},
          {"directional", LightKind::directional},
          {"area", LightKind::area},
          {"point", LightKind::point}};
}

inline Choices<LightCaustic> choices(LightCaustic) {
  return {{"auto", LightCaustic::automatic}, {"map", LightCaustic::map}, {"photons", LightCaustic::photons}};
}

inline Choices<Annotation> choices(Annotation) {
  return {{"scale", Annotation::scale},
          {"axes", Annotation::axes},
          {"legend", Annotation::legend},
          {"body", Annotation::body},
          {"hidden", Annotation::hidden}};
}

inline Choices<Pattern> choices(Pattern) { return {{"none", Pattern::none}, {"checkerboard", Pattern::checkerboard}}; }

inline Choices<Invariant> choices(Invariant) {
  return {{"norm", Invariant::norm},
          {"trace", Invariant::trace},
          {"determinant", Invariant::determinant},
          {"fractional_anisotropy", Invariant::fractional_anisotropy},
          {"mode", Invariant::mode},
          {"largest_eigenvalue", Invariant::largest_eigenvalue},
          {"middle_eigenvalue", Invariant::middle_eigenvalue},
          {"smallest_eigenvalue", Invariant::smallest_eigenvalue},
          {"von_mises", Invariant::von_mises},
          {"max_shear", Invariant::max_shear},
          {"vorticity", Invariant::vorticity},
          {"swirling_strength", Invariant::swirling_strength},
          {"asymmetry", Invariant::asymmetry}};
}

inline Choices<Colormap> choices(Colormap) {
  return {{"viridis", Colormap::viridis},   {"magma", Colormap::magma},     {"inferno", Colormap::inferno},
          {"plasma", Colormap::plasma},     {"cividis", Colormap::cividis}, {"cool_warm", Colormap::cool_warm},
          {"twilight", Colormap::twilight}, {"grey", Colormap::grey}};
}

}  // namespace tensorray
