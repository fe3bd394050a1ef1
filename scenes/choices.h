#pragma once
/// @file scenes/choices.h
/// The words by which scene files name the alternatives of an enumeration.

#include <array>

#include "integrators/bending.h"
#include "renderer/beam.h"
#include "renderer/density.h"
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
  return std::array{C{"photon_distribution", IntegratorType::photon_distribution}};
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
