#pragma once
/// @file scenes/description/choices.h
/// Names in scene files for the enumerations that several methods or the whole scene use (see scenes/keys/choice.h).

#include <array>

#include "renderer/camera/camera.h"
#include "renderer/charts/colormap.h"
#include "renderer/lights/beam.h"
#include "scenes/description/description.h"
#include "scenes/keys/choice.h"
#include "tracing/bending/bending.h"
#include "volumes/files/tensor_files.h"
#include "volumes/tensors/eigenvalues.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {

inline auto choices(Derive) {
  using C = Choice<Derive>;
  return std::array{C{"none", Derive::none}, C{"gradient", Derive::gradient}, C{"hessian", Derive::hessian}};
}

inline auto choices(Eigenvalues) {
  using C = Choice<Eigenvalues>;
  return std::array{C{"auto", Eigenvalues::automatic}, C{"raw", Eigenvalues::raw}, C{"absolute", Eigenvalues::absolute},
                    C{"positive", Eigenvalues::positive}};
}

inline auto choices(Interpolation) {
  using C = Choice<Interpolation>;
  return std::array{C{"cubic", Interpolation::cubic}, C{"linear", Interpolation::linear}};
}

inline auto choices(BorderChoice) {
  using C = Choice<BorderChoice>;
  return std::array{C{"auto", BorderChoice::automatic}, C{"fade", BorderChoice::fade},
                    C{"extend", BorderChoice::extend}};
}

inline auto choices(BendingMethod) {
  using C = Choice<BendingMethod>;
  return std::array{C{"auto", BendingMethod::automatic},
                    C{"euler", BendingMethod::euler},
                    C{"splitting", BendingMethod::splitting},
                    C{"splitting4", BendingMethod::splitting4},
                    C{"rk4", BendingMethod::rk4},
                    C{"bs23", BendingMethod::bs23},
                    C{"dopri5", BendingMethod::dopri5}};
}

inline auto choices(BeamPattern) {
  using C = Choice<BeamPattern>;
  return std::array{C{"grid", BeamPattern::grid}, C{"stratified", BeamPattern::stratified},
                    C{"sobol", BeamPattern::sobol}, C{"random", BeamPattern::random}};
}

inline auto choices(Projection) {
  using C = Choice<Projection>;
  return std::array{C{"perspective", Projection::perspective}, C{"orthographic", Projection::orthographic}};
}

inline auto choices(LightKind) {
  using C = Choice<LightKind>;
  return std::array{C{"constant", LightKind::constant}, C{"environment", LightKind::environment},
                    C{"directional", LightKind::directional}, C{"area", LightKind::area}, C{"point", LightKind::point}};
}

inline auto choices(LightCaustic) {
  using C = Choice<LightCaustic>;
  return std::array{C{"auto", LightCaustic::automatic}, C{"map", LightCaustic::map},
                    C{"photons", LightCaustic::photons}};
}

inline auto choices(Annotation) {
  using C = Choice<Annotation>;
  return std::array{C{"scale", Annotation::scale}, C{"axes", Annotation::axes}, C{"legend", Annotation::legend}};
}

inline auto choices(Pattern) {
  return std::array{Choice<Pattern>{"none", Pattern::none}, Choice<Pattern>{"checkerboard", Pattern::checkerboard}};
}

inline auto choices(Invariant) {
  using C = Choice<Invariant>;
  return std::array{C{"norm", Invariant::norm},
                    C{"trace", Invariant::trace},
                    C{"determinant", Invariant::determinant},
                    C{"fractional_anisotropy", Invariant::fractional_anisotropy},
                    C{"mode", Invariant::mode},
                    C{"largest_eigenvalue", Invariant::largest_eigenvalue},
                    C{"middle_eigenvalue", Invariant::middle_eigenvalue},
                    C{"smallest_eigenvalue", Invariant::smallest_eigenvalue},
                    C{"von_mises", Invariant::von_mises},
                    C{"max_shear", Invariant::max_shear},
                    C{"vorticity", Invariant::vorticity},
                    C{"swirling_strength", Invariant::swirling_strength},
                    C{"asymmetry", Invariant::asymmetry}};
}

inline auto choices(Colormap) {
  using C = Choice<Colormap>;
  return std::array{C{"viridis", Colormap::viridis},   C{"magma", Colormap::magma},
                    C{"inferno", Colormap::inferno},   C{"plasma", Colormap::plasma},
                    C{"cividis", Colormap::cividis},   C{"cool_warm", Colormap::cool_warm},
                    C{"twilight", Colormap::twilight}, C{"grey", Colormap::grey}};
}

}  // namespace tensorray
