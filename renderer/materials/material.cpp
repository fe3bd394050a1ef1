#include "renderer/materials/material.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "base/constants.h"
#include "base/overloaded.h"
#include "renderer/sampling/sampling.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

static_assert(std::variant_size_v<decltype(Material::scattering)> == 4, "the functions below name the kinds");

Diffuse prepare(const Diffuse& settings) { return settings; }

/// The model of glass; null if the material is another one.
const DielectricScattering* glass_of(const Material& material) {
  return std::get_if<DielectricScattering>(&material.scattering);
}

/// Mirrors `w` in z if the material is opaque and wo is below the surface: opaque models need wo above it.
Vector3d seen(const Material& material, const Vector3d& w, const Vector3d& wo) {
  return wo.z() < 0 && !is_glass(material) ? Vector3d(w.x(), w.y(), -w.z()) : w;
}

/// False if f is 0 because of the directions alone.
bool scatters(const Material& material, const Vector3d& wi, const Vector3d& wo) {
  const double sides = wi.z() * wo.z();
  return sides > 0 || (sides < 0 && is_glass(material));
}

double refraction(const Material& material, const Vector3d& wi, const Vector3d& wo) {
  const DielectricScattering* const glass = glass_of(material);
  if (glass == nullptr || wi.z() * wo.z() > 0) return 1;
  const double index2 = glass->index * glass->index;
  return wo.z() > 0 ? 1 / index2 : index2;
}

}  // namespace

bool is_glass(const Material& material) { return glass_of(material) != nullptr; }

bool is_diffuse(const Material& material) { return std::holds_alternative<Diffuse>(material.scattering); }

const BandValues* mean_fresnel(const Material& material) {
  const auto* const metal = std::get_if<ConductorScattering>(&material.scattering);
  return metal ? &metal->mean_fresnel : nullptr;
}

Material make_material(const MaterialSettings& settings, const BandValues& reflectance) {
  if (!(reflectance.allFinite() && (reflectance >= 0).all() && (reflectance <= 1).all()))
    throw std::invalid_argument("a material's reflectance must be in 0..1 in every band");
  if (const auto* metal = std::get_if<RoughConductor>(&settings))
    if (metal->index.n.size() != reflectance.size())
      throw std::invalid_argument("the metal's index has " + std::to_string(metal->index.n.size()) +
                                  " bands and its reflectance " + std::to_string(reflectance.size()) +
                                  "; give both for the bands of the film");
  Material material;
  std::visit([&](const auto& model) { material.scattering = prepare(model); }, settings);
  material.reflectance = reflectance;
  return material;
}

ViewedMaterial viewed(const Material& material, const BandsIn& reflectance, const Vector3d& wo,
                      Eigen::Index first_band) {
  ViewedMaterial view{wo, first_band, {}};
  if (const auto* principled = std::get_if<PrincipledScattering>(&material.scattering))
    view.principled = viewed(*principled, reflectance, std::abs(wo.z()));
  return view;
}

double evaluate(const Material& material, const ViewedMaterial& view, const BandsIn& reflectance, const Vector3d& wi,
                BandsOut f) {
  if (!scatters(material, wi, view.wo)) {
    f.setZero();
    return 0;
  }
  const Vector3d i = seen(material, wi, view.wo), o = seen(material, view.wo, view.wo);
  return std::visit(
      Overloaded{
          [&](const Diffuse&) {
            f = reflectance.head(f.size()) / pi;
            return i.z() / pi;
          },
          [&](const ConductorScattering& metal) { return evaluate(metal, reflectance, i, o, f, view.first_band); },
          [&](const DielectricScattering& glass) { return evaluate(glass, reflectance, i, o, f); },
          [&](const PrincipledScattering& layers) { return evaluate(layers, view.principled, reflectance, i, o, f); }},
      material.scattering);
}

double pdf(const Material& material, const ViewedMaterial& view, const BandsIn& reflectance, const Vector3d& wi) {
  BandValues none;
  return evaluate(material, view, reflectance, wi, none);
}

std::optional<ScatteringSample> sample(const Material& material, const ViewedMaterial& view, const BandsIn& reflectance,
                                       const Vector3d& u, BandsOut weight) {
  const Vector3d& wo = view.wo;
  weight.setZero();
  if (wo.z() == 0) return std::nullopt;
  const Vector3d o = seen(material, wo, wo);
  const Eigen::Vector2d place = u.head<2>();
  const Vector3d direction = std::visit(
      Overloaded{[&](const Diffuse&) { return square_to_cosine_hemisphere(place); },
                 [&](const ConductorScattering& metal) { return sample(metal, o, place); },
                 [&](const DielectricScattering& glass) { return sample(glass, o, u); },
                 [&](const PrincipledScattering& layers) { return sample(layers, view.principled, o, place); }},
      material.scattering);
  ScatteringSample result;
  result.wi = seen(material, direction, wo);
  result.pdf = evaluate(material, view, reflectance, result.wi, weight);
  if (!(result.pdf > 0)) {
    weight.setZero();
    return std::nullopt;
  }
  weight *= std::abs(result.wi.z()) / result.pdf;
  result.refraction = refraction(material, result.wi, wo);
  return result;
}

}  // namespace tensorray
