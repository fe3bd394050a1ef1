#pragma once
/// @file scenes/choices.h
/// The words by which scene files name the alternatives of an enumeration.

#include <array>

#include "integrators/bending/bending.h"
#include "renderer/film/density.h"
#include "renderer/lights/beam.h"
#include "renderer/textures/test_images.h"
#include "scenes/description.h"
#include "volumes/files/tensor_files.h"
#include "volumes/tensors/eigenvalues.h"

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
  return std::array{C{"photon_distribution", IntegratorType::photon_distribution}, C{"lens", IntegratorType::lens},
                    C{"path_tracing", IntegratorType::path_tracing}};
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

inline auto choices(SeedKind) {
  using C = Choice<SeedKind>;
  return std::array{C{"grid", SeedKind::grid},           C{"poisson_disk", SeedKind::poisson_disk},
                    C{"line", SeedKind::line},           C{"sphere", SeedKind::sphere},
                    C{"threshold", SeedKind::threshold}, C{"file", SeedKind::file}};
}

inline auto choices(PathStyle) {
  using C = Choice<PathStyle>;
  return std::array{C{"tube", PathStyle::tube}, C{"wire", PathStyle::wire}, C{"ellipses", PathStyle::ellipses},
                    C{"lines", PathStyle::lines}};
}

inline auto choices(TubeCaps) {
  using C = Choice<TubeCaps>;
  return std::array{C{"open", TubeCaps::open}, C{"flat", TubeCaps::flat}, C{"round", TubeCaps::round}};
}

inline auto choices(PathColor) {
  using C = Choice<PathColor>;
  return std::array{C{"force", PathColor::force},           C{"transverse_force", PathColor::transverse_force},
                    C{"curvature", PathColor::curvature},   C{"length", PathColor::length},
                    C{"wavelength", PathColor::wavelength}, C{"direction", PathColor::direction},
                    C{"invariant", PathColor::invariant},   C{"none", PathColor::none}};
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

inline auto choices(MaterialKind) {
  using C = Choice<MaterialKind>;
  return std::array{C{"diffuse", MaterialKind::diffuse}, C{"principled", MaterialKind::principled},
                    C{"metal", MaterialKind::metal}, C{"glass", MaterialKind::glass}};
}

inline auto choices(Metal) {
  using C = Choice<Metal>;
  return std::array{C{"gold", Metal::gold}, C{"silver", Metal::silver}, C{"copper", Metal::copper},
                    C{"aluminium", Metal::aluminium}};
}

inline auto choices(Shading) {
  using C = Choice<Shading>;
  return std::array{C{"path", Shading::path}, C{"ambient_occlusion", Shading::ambient_occlusion},
                    C{"headlight", Shading::headlight}};
}

inline auto choices(PixelFilterShape) {
  using C = Choice<PixelFilterShape>;
  return std::array{C{"blackman_harris", PixelFilterShape::blackman_harris}, C{"gaussian", PixelFilterShape::gaussian},
                    C{"box", PixelFilterShape::box}};
}

inline auto choices(Background) {
  using C = Choice<Background>;
  return std::array{C{"color", Background::color}, C{"lights", Background::lights},
                    C{"transparent", Background::transparent}};
}

inline auto choices(Projection) {
  using C = Choice<Projection>;
  return std::array{C{"perspective", Projection::perspective}, C{"orthographic", Projection::orthographic}};
}

inline auto choices(LightKind) {
  using C = Choice<LightKind>;
  return std::array{C{"constant", LightKind::constant}, C{"environment", LightKind::environment},
                    C{"directional", LightKind::directional}, C{"area", LightKind::area}};
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
