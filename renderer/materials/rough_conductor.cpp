#include "renderer/materials/rough_conductor.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "base/text/text.h"
#include "renderer/sampling/sampling.h"

namespace tensorray {
namespace {

struct MetalSample {
  double wavelength;  ///< nm
  double n;
  double k;
};

struct Metal {
  const char* name;
  std::vector<MetalSample> samples;
};

// clang-format off
const std::vector<Metal> metals{
    {"gold", {
        {342.5, 1.48, 1.871}, {354.2, 1.50, 1.866}, {367.9, 1.48, 1.895}, {381.5, 1.46, 1.933}, {397.4, 1.47, 1.952},
        {413.3, 1.46, 1.958}, {430.5, 1.45, 1.948}, {450.9, 1.38, 1.914}, {471.4, 1.31, 1.849}, {495.9, 1.04, 1.833},
        {520.9, 0.62, 2.081}, {548.6, 0.43, 2.455}, {582.1, 0.29, 2.863}, {616.8, 0.21, 3.272}, {659.5, 0.14, 3.697},
        {704.5, 0.13, 4.103}, {756.0, 0.14, 4.542}, {821.1, 0.16, 5.083}, {892.0, 0.17, 5.663},
    }},
    {"silver", {
        {342.5, 0.14, 1.142}, {354.2, 0.10, 1.419}, {367.9, 0.07, 1.657}, {381.5, 0.05, 1.864}, {397.4, 0.05, 2.070},
        {413.3, 0.05, 2.275}, {430.5, 0.04, 2.462}, {450.9, 0.04, 2.657}, {471.4, 0.05, 2.869}, {495.9, 0.05, 3.093},
        {520.9, 0.05, 3.324}, {548.6, 0.06, 3.586}, {582.1, 0.05, 3.858}, {616.8, 0.06, 4.152}, {659.5, 0.05, 4.483},
        {704.5, 0.04, 4.838}, {756.0, 0.03, 5.242}, {821.1, 0.04, 5.727}, {892.0, 0.04, 6.312},
    }},
    {"copper", {
        {342.5, 1.36, 1.864}, {354.2, 1.37, 1.916}, {367.9, 1.36, 1.975}, {381.5, 1.33, 2.045}, {397.4, 1.32, 2.116},
        {413.3, 1.28, 2.207}, {430.5, 1.25, 2.305}, {450.9, 1.24, 2.397}, {471.4, 1.25, 2.483}, {495.9, 1.22, 2.564},
        {520.9, 1.18, 2.608}, {548.6, 1.02, 2.577}, {582.1, 0.70, 2.704}, {616.8, 0.30, 3.205}, {659.5, 0.22, 3.747},
        {704.5, 0.21, 4.205}, {756.0, 0.24, 4.665}, {821.1, 0.26, 5.180}, {892.0, 0.30, 5.768},
    }},
    {"aluminium", {
        {326.28, 0.31474, 3.9165}, {364.66, 0.39877, 4.3957}, {413.28, 0.52135, 5.0008}, {442.80, 0.60790, 5.3676},
        {476.87, 0.72780, 5.7781}, {516.60, 0.87340, 6.2418}, {563.57, 1.0728, 6.7839},  {619.93, 1.3660, 7.4052},
        {652.25, 1.5724, 7.7354},  {688.81, 1.8301, 8.0601},  {729.32, 2.1606, 8.3565},  {774.91, 2.6154, 8.4914},
        {794.78, 2.7675, 8.3866},  {815.69, 2.7668, 8.2573},  {837.74, 2.6945, 8.1878},  {885.61, 2.2802, 8.1134},
    }},
};
// clang-format on

MetalSample interpolate(const std::vector<MetalSample>& samples, double wavelength) {
  if (wavelength <= samples.front().wavelength) return samples.front();
  if (wavelength >= samples.back().wavelength) return samples.back();
  const auto above = std::lower_bound(samples.begin(), samples.end(), wavelength,
                                      [](const MetalSample& s, double value) { return s.wavelength < value; });
  const auto below = std::prev(above);
  const double t = (wavelength - below->wavelength) / (above->wavelength - below->wavelength);
  return {wavelength, below->n + t * (above->n - below->n), below->k + t * (above->k - below->k)};
}

/// The probability of each lobe is that for perfect mirrors, since both lobes have nearly the same colour.
double single_bounce_share(const ConductorScattering& metal, const Eigen::Vector3d& wo) {
  return 1 - metal.missing.at(wo.z());
}

}  // namespace

ConductorIndex metal_index(const std::string& name, const std::vector<double>& wavelengths) {
  const auto metal = std::find_if(metals.begin(), metals.end(), [&](const Metal& m) { return name == m.name; });
  if (metal == metals.end()) {
    std::vector<std::string> known;
    for (const Metal& each : metals) known.emplace_back(each.name);
    throw std::invalid_argument("there is no metal \"" + name + "\"; known are: " + joined(known));
  }
  const auto bands = static_cast<Eigen::Index>(wavelengths.size());
  ConductorIndex index{BandValues(bands), BandValues(bands)};
  for (Eigen::Index band = 0; band < bands; ++band) {
    const MetalSample sample = interpolate(metal->samples, wavelengths[static_cast<std::size_t>(band)]);
    index.n[band] = sample.n;
    index.k[band] = sample.k;
  }
  return index;
}

ConductorScattering prepare(const RoughConductor& settings) {
  const ConductorIndex& index = settings.index;
  if (index.n.size() != index.k.size())
    throw std::invalid_argument("the metal has " + std::to_string(index.n.size()) + " values of n and " +
                                std::to_string(index.k.size()) + " of k; give one of each for every band");
  if (!index.n.allFinite() || !index.k.allFinite() || (index.n < 0).any() || (index.k < 0).any())
    throw std::invalid_argument("the metal's n and k must be finite and not negative");

  ConductorScattering metal;
  metal.alpha = ggx_alpha(settings.roughness, "the metal's roughness");
  metal.index = index;
  metal.mean_fresnel.resize(index.n.size());
  for (Eigen::Index band = 0; band < index.n.size(); ++band)
    metal.mean_fresnel[band] =
        hemispherical_mean([&](double cosine) { return fresnel_conductor(cosine, index.n[band], index.k[band]); });
  metal.missing = make_cosine_table(metal.alpha, [&metal](double cosine) {
    return 1 - visible_mean(metal.alpha, cosine, [&metal](const Eigen::Vector3d& wo, const Eigen::Vector3d& m) {
             const Eigen::Vector3d wi = mirrored(wo, m);
             return wi.z() > 0 ? ggx_shadowing(metal.alpha, wo.z(), wi.z()) : 0;
           });
  });
  return metal;
}

double evaluate(const ConductorScattering& metal, const BandsIn& reflectance, const Eigen::Vector3d& wi,
                const Eigen::Vector3d& wo, BandsOut f, Eigen::Index first_band) {
  const GgxReflection single = ggx_reflection(metal.alpha, wi, wo);
  const double share = single_bounce_share(metal, wo), missing = metal.missing.mean();
  const double several = fill(metal.missing.at(wo.z()), metal.missing.at(wi.z()), missing);
  const double cosine = facet_cosine(wi, wo);
  const auto index_n = metal.index.n.segment(first_band, f.size()),
             index_k = metal.index.k.segment(first_band, f.size());
  const auto mean_fresnel = metal.mean_fresnel.segment(first_band, f.size());
  for (Eigen::Index band = 0; band < f.size(); ++band) {
    const double fresnel = fresnel_conductor(cosine, index_n[band], index_k[band]);
    f[band] =
        reflectance[band] * fresnel * single.f + fill_color(reflectance[band] * mean_fresnel[band], missing) * several;
  }
  return share * single.pdf + (1 - share) * metal.missing.pdf(wi.z());
}

Eigen::Vector3d sample(const ConductorScattering& metal, const Eigen::Vector3d& wo, const Eigen::Vector2d& u) {
  Eigen::Vector2d place = u;
  if (choose(single_bounce_share(metal, wo), place.x()))
    return mirrored(wo, ggx_sample_visible(metal.alpha, wo, place));
  return metal.missing.sample(place);
}

}  // namespace tensorray
