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
#include "renderer/materials/metals.inc"
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
