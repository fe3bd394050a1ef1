#pragma once
/// The method "polariscope": polarised light through the field, between polarisers. The keys of `integrator` that it
/// has.

#include <filesystem>
#include <memory>
#include <optional>
#include <variant>

#include "integrators/polariscope/elements.h"
#include "scenes/description/method.h"

namespace tensorray {

TENSORRAY_VALUE(Arrangement);

enum class OpticChoice { automatic };

/// C, or a text file of two columns, wavelength (nm) and C; automatic: chosen by the field.
using StressOptic = std::variant<OpticChoice, double, std::filesystem::path>;
TENSORRAY_VALUE(StressOptic);

struct PolariscopeDescription {
  Arrangement arrangement = named_arrangements().front().elements;
  double angle = 0, analyzer = 0;  ///< Degrees.
  StressOptic stress_optic = OpticChoice::automatic;
  std::optional<double> unit_length;  ///< Metres in a unit of world space; none: by the scene's unit, or 1.
  std::optional<int> samples;         ///< Of a pixel along x and y; none: 2.
};

inline void describe(PolariscopeDescription& settings, KeyVisitor& visit) {
  visit("arrangement", settings.arrangement,
        "polariscope: polarisers and quarter-wave plates: circular (dark field), circular_light, plane (crossed), "
        "plane_light, tint (full-wave plate); or lists of elements `before` and `after` the field",
        knob());
  visit("angle", settings.angle, "polariscope: degrees by which all elements are turned", knob(-90, 90));
  visit("analyzer", settings.analyzer, "polariscope: degrees by which the last polariser is turned", knob(-90, 90));
  visit("stress_optic", settings.stress_optic,
        "polariscope: stress-optic coefficient, 1 / unit of the field (1e-12/Pa is a brewster), or a text file of "
        "wavelengths (nm) and coefficients; auto: about four orders in the picture",
        knob());
  visit("unit_length", settings.unit_length,
        "polariscope: metres in one unit of world space; default: by `world.unit` or the field's file, else 1",
        above(0));
  visit("samples", settings.samples, "lens, polariscope: samples of a pixel along x and along y", between(1, 16));
}

std::shared_ptr<Method> polariscope_method();

}  // namespace tensorray
