#include "renderer/materials/material.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "base/constants.h"
#include "renderer/sampling/sampling.h"

namespace tensorray {
namespace {

Diffuse prepare(const Diffuse& settings) { return settings; }

double evaluate(const Diffuse&, const BandsIn& reflectance, const Eigen::Vector3d& wi, const Eigen::Vector3d&,
                BandsOut f) {
  f = reflectance.head(f.size()) / pi;
  return wi.z() / pi;
}

Eigen::Vector3d sample(const Diffuse&, const BandsIn&, const Eigen::Vector3d&, const Eigen::Vector2d& u) {
  return square_to_cosine_hemisphere(u);
}

/// Opaque models need only two numbers, and one of them needs the view.
template <class Model>
Eigen::Vector3d sample(const Model& model, const ViewedMaterial& view, const BandsIn& reflectance,
                       const Eigen::Vector3d& wo, const Eigen::Vector3d& u) {
  const Eigen::Vector2d place = u.head<2>();
  if constexpr (std::is_same_v<Model, PrincipledScattering>)
    return tensorray::sample(model, view.principled, wo, place);
  else if constexpr (std::is_same_v<Model, DielectricScattering>)
    return tensorray::sample(model, reflectance, wo, u);
  else
    return sample(model, reflectance, wo, place);
}

/// Mirrors `w` in z if the material is opaque and wo is below the surface: opaque models need wo above it.
Eigen::Vector3d seen(const Material& material, const Eigen::Vector3d& w, const Eigen::Vector3d& wo) {
  return wo.z() < 0 && !is_glass(material) ? Eigen::Vector3d(w.x(), w.y(), -w.z()) : w;
}

/// False if f is 0 because of the directions alone.
bool scatters(const Material& material, const Eigen::Vector3d& wi, const Eigen::Vector3d& wo) {
  const double sides = wi.z() * wo.z();
  return sides > 0 || (sides < 0 && is_glass(material));
}

/// Metals alone have values of each band.
template <class Model>
double evaluate(const Model& model, const ViewedMaterial& view, const BandsIn& reflectance, const Eigen::Vector3d& wi,
                const Eigen::Vector3d& wo, BandsOut f) {
  if constexpr (std::is_same_v<Model, ConductorScattering>)
    return tensorray::evaluate(model, reflectance, wi, wo, f, view.first_band);
  else if constexpr (std::is_same_v<Model, PrincipledScattering>)
    return tensorray::evaluate(model, view.principled, reflectance, wi, wo, f);
  else
    return evaluate(model, reflectance, wi, wo, f);
}

double refraction(const Material& material, const Eigen::Vector3d& wi, const Eigen::Vector3d& wo) {
  const auto* glass = std::get_if<DielectricScattering>(&material.scattering);
  if (glass == nullptr || wi.z() * wo.z() > 0) return 1;
  const double index2 = glass->index * glass->index;
  return wo.z() > 0 ? 1 / index2 : index2;
}

}  // namespace

bool is_glass(const Material& material) { return std::holds_alternative<DielectricScattering>(material.scattering); }

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

ViewedMaterial viewed(const Material& material, const BandsIn& reflectance, const Eigen::Vector3d& wo,
                      Eigen::Index first_band) {
  ViewedMaterial view{wo, first_band, {}};
  if (const auto* principled = std::get_if<PrincipledScattering>(&material.scattering))
    view.principled = viewed(*principled, reflectance, std::abs(wo.z()));
  return view;
}

double evaluate(const Material& material, const ViewedMaterial& view, const BandsIn& reflectance,
                const Eigen::Vector3d& wi, BandsOut f) {
  const Eigen::Vector3d& wo = view.wo;
  if (!scatters(material, wi, wo)) {
    f.setZero();
    return 0;
  }
  const Eigen::Vector3d i = seen(material, wi, wo), o = seen(material, wo, wo);
  const auto of = [&](const auto& model) { return evaluate(model, view, reflectance, i, o, f); };
  return std::visit(of, material.scattering);
}

double evaluate(const Material& material, const BandsIn& reflectance, const Eigen::Vector3d& wi,
                const Eigen::Vector3d& wo, BandsOut f, Eigen::Index first_band) {
  return evaluate(material, viewed(material, reflectance, wo, first_band), reflectance, wi, f);
}

double pdf(const Material& material, const BandsIn& reflectance, const Eigen::Vector3d& wi, const Eigen::Vector3d& wo) {
  BandValues none;
  return evaluate(material, reflectance, wi, wo, none);
}

std::optional<ScatteringSample> sample(const Material& material, const ViewedMaterial& view, const BandsIn& reflectance,
                                       const Eigen::Vector3d& u, BandsOut weight) {
  const Eigen::Vector3d& wo = view.wo;
  weight.setZero();
  if (wo.z() == 0) return std::nullopt;
  const Eigen::Vector3d o = seen(material, wo, wo);
  const auto direction = [&](const auto& model) { return sample(model, view, reflectance, o, u); };
  ScatteringSample result;
  result.wi = seen(material, std::visit(direction, material.scattering), wo);
  result.pdf = evaluate(material, view, reflectance, result.wi, weight);
  if (!(result.pdf > 0)) {
    weight.setZero();
    return std::nullopt;
  }
  weight *= std::abs(result.wi.z()) / result.pdf;
  result.refraction = refraction(material, result.wi, wo);
  return result;
}

std::optional<ScatteringSample> sample(const Material& material, const BandsIn& reflectance, const Eigen::Vector3d& wo,
                                       const Eigen::Vector3d& u, BandsOut weight, Eigen::Index first_band) {
  return sample(material, viewed(material, reflectance, wo, first_band), reflectance, u, weight);
}

}  // namespace tensorray
