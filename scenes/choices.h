#pragma once
/// @file scenes/choices.h
/// The words by which scene files name the alternatives of an enumeration.

#include <array>

#include "integrators/bending.h"
#include "renderer/beam.h"
#include "renderer/density.h"
#include "renderer/test_images.h"
#include "scenes/description.h"
#include "volumes/eigenvalues.h"
#include "volumes/tensor_files.h"

namespace tensorray {

template <class Enum>
struct Choice {
  const char* name;
  Enum value;
};

// `choices(Enum{})` is an array of all alternatives; the argument only selects the overload.

inline auto choices(Derive) {
  using C = Choice<Derive>;
  return std::array{C{"none", Derive::none}, C{"gradient", Derive::gradient}, C{"hessian", Derive::hessian}};
}

inline auto choices(Eigenvalues) {
  using C = Choice<Eigenvalues>;
  return std::array{C{"auto", Eigenvalues::automatic}, C{"raw", Eigenvalues::raw}, C{"absolute", Eigenvalues::absolute},
                    C{"positive", Eigenvalues::positive}};
}

inline auto choices(BendingMethod) {
  using C = Choice<BendingMethod>;
  return std::array{C{"euler", BendingMethod::euler}, C{"splitting", BendingMethod::splitting},
                    C{"rk4", BendingMethod::rk4}, C{"bs23", BendingMethod::bs23}, C{"dopri5", BendingMethod::dopri5}};
}

inline auto choices(BeamPattern) {
  using C = Choice<BeamPattern>;
  return std::array{C{"grid", BeamPattern::grid}, C{"stratified", BeamPattern::stratified},
                    C{"sobol", BeamPattern::sobol}, C{"random", BeamPattern::random}};
}

inline auto choices(DensityKind) {
  using C = Choice<DensityKind>;
  return std::array{C{"gaussian", DensityKind::gaussian}, C{"histogram", DensityKind::histogram}};
}

inline auto choices(IntegratorType) {
  using C = Choice<IntegratorType>;
  return std::array{C{"photon_distribution", IntegratorType::photon_distribution}, C{"lens", IntegratorType::lens}};
}

inline auto choices(LensMode) {
  using C = Choice<LensMode>;
  return std::array{C{"gather", LensMode::gather}, C{"scatter", LensMode::scatter}};
}

inline auto choices(Wrap) {
  using C = Choice<Wrap>;
  return std::array{C{"none", Wrap::none}, C{"clamp", Wrap::clamp}, C{"repeat", Wrap::repeat},
                    C{"mirror", Wrap::mirror}};
}

inline auto choices(Overlay) {
  using C = Choice<Overlay>;
  return std::array{C{"none", Overlay::none}, C{"grid", Overlay::grid}};
}

/// The built-in images, as `integrator.image` names them.
inline auto choices(TestImage) {
  using C = Choice<TestImage>;
  return std::array{C{"checkerboard", TestImage::checkerboard}, C{"grid", TestImage::grid},
                    C{"color_wheel", TestImage::color_wheel}, C{"line", TestImage::line}};
}

/// The word for an alternative.
template <class Enum>
const char* choice_name(Enum value) {
  for (const auto& choice : choices(value)) {
    if (choice.value == value) return choice.name;
  }
  return "";
}

}  // namespace tensorray
