#include "renderer/materials/metal_and_glass.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include <Eigen/Geometry>

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

double squared(double x) { return x * x; }

/// The surface seen from wo, turned so that wo has z > 0.
struct View {
  double index;               ///< Index of the far side relative to the side of wo.
  const CosineTable& near;    ///< Fraction that is missing on the side of wo.
  const CosineTable& far;     ///< Fraction that is missing on the other side.
  double refracted;           ///< Fraction of the missing light that is refracted; the rest is reflected.
  double refracted_radiance;  ///< The factor of near · far / π in the lobe.
};

View view_of(const DielectricScattering& glass, bool outside) {
  // The refracting lobe is near · far · c / π. By reciprocity, it is n² times larger for light that leaves to the
  // inside than for light that leaves to the outside. A cone of light is compressed by the same factor.
  const double index2 = squared(glass.index);
  if (outside)
    return {glass.index, glass.missing_outside, glass.missing_inside,
            glass.refracted * index2 * glass.missing_inside.mean(), glass.refracted};
  return {1 / glass.index, glass.missing_inside, glass.missing_outside, glass.refracted * glass.missing_outside.mean(),
          glass.refracted * index2};
}

Eigen::Vector3d turned(const Eigen::Vector3d& w, bool outside) {
  return outside ? w : Eigen::Vector3d(w.x(), w.y(), -w.z());
}

/// The refracted direction; zero for total reflection. `index` is as for Fresnel; wo and m are on the same side.
Eigen::Vector3d refracted(const Eigen::Vector3d& wo, const Eigen::Vector3d& m, double index) {
  const double cosine = wo.dot(m);
  const double cosine2 = 1 - (1 - squared(cosine)) / squared(index);
  if (cosine2 <= 0) return Eigen::Vector3d::Zero();
  return ((cosine / index - std::sqrt(cosine2)) * m - wo / index).normalized();
}

double fresnel(const Eigen::Vector3d& wo, const Eigen::Vector3d& m, double index) {
  return fresnel_dielectric(std::clamp(wo.dot(m), 0.0, 1.0), index);
}

/// A facet that refracts wi to wo, and the density of its normals over wi: d(m) / d(wi).
struct Refraction {
  Eigen::Vector3d m;
  double jacobian = 0;  ///< 0 if there is no such facet.
};

Refraction refraction_between(const Eigen::Vector3d& wi, const Eigen::Vector3d& wo, double index) {
  Eigen::Vector3d m = wo + index * wi;
  if (m.z() < 0) m = -m;
  const double length = m.norm();
  if (length == 0) return {};
  m /= length;
  const double o = wo.dot(m), i = wi.dot(m);
  if (o <= 0 || i >= 0) return {m, 0};
  return {m, squared(index) * -i / squared(o + index * i)};
}

double single_bounce_share(const View& view, const Eigen::Vector3d& wo) { return 1 - view.near.at(wo.z()); }

/// The fraction of the light along wo that leaves a facet and is visible from outside the facets.
double single_bounce(double alpha, double index, const Eigen::Vector3d& wo, const Eigen::Vector3d& m) {
  const double reflected = fresnel(wo, m, index);
  const Eigen::Vector3d above = mirrored(wo, m), below = refracted(wo, m, index);
  double sum = 0;
  if (above.z() > 0) sum += reflected * ggx_shadowing(alpha, wo.z(), above.z());
  if (below.z() < 0) sum += (1 - reflected) * ggx_shadowing(alpha, wo.z(), -below.z());
  return sum;
}

CosineTable missing_table(double alpha, double index) {
  return make_cosine_table(alpha, [=](double cosine) {
    return 1 - visible_mean(alpha, cosine, [=](const Eigen::Vector3d& wo, const Eigen::Vector3d& m) {
             return single_bounce(alpha, index, wo, m);
           });
  });
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

DielectricScattering prepare(const RoughDielectric& settings) {
  const double index = settings.index;
  if (!(index >= 0.2 && index <= 5 && std::abs(index - 1) >= 0.01))
    throw std::invalid_argument("the dielectric's index is " + std::to_string(index) +
                                "; give a value in 0.2..5, at least 0.01 from 1, which has no surface");
  DielectricScattering glass;
  glass.alpha = ggx_alpha(settings.roughness, "the dielectric's roughness");
  glass.index = index;
  glass.missing_outside = missing_table(glass.alpha, index);
  glass.missing_inside = missing_table(glass.alpha, 1 / index);

  // From outside the lobes refract the fraction refracted · n² · mean(missing_inside), from inside refracted ·
  // mean(missing_outside). Smooth glass refracts the fractions 1 - F and 1 - F inside = (1 - F) / n² of uniform light.
  // `refracted` is the largest factor with which neither fraction exceeds that of smooth glass.
  const double smooth = 1 - hemispherical_mean([=](double cosine) { return fresnel_dielectric(cosine, index); });
  const double missing = std::max(glass.missing_outside.mean(), glass.missing_inside.mean());
  glass.refracted = missing > 0 ? smooth / (squared(index) * missing) : 0;
  return glass;
}

double evaluate(const DielectricScattering& glass, const BandsIn& reflectance, const Eigen::Vector3d& wi,
                const Eigen::Vector3d& wo, BandsOut f) {
  const bool outside = wo.z() > 0;
  const View view = view_of(glass, outside);
  const Eigen::Vector3d o = turned(wo, outside), i = turned(wi, outside);
  const double missing = view.near.at(o.z()), share = single_bounce_share(view, o);
  double value = 0, density = 0;
  if (i.z() > 0) {
    const double reflected = fresnel_dielectric(facet_cosine(i, o), view.index), rest = 1 - view.refracted;
    const GgxReflection single = ggx_reflection(glass.alpha, i, o);
    value = reflected * single.f + rest * fill(missing, view.near.at(i.z()), view.near.mean());
    density = share * reflected * single.pdf + (1 - share) * rest * view.near.pdf(i.z());
  } else {
    value = view.refracted_radiance * fill(missing, view.far.at(-i.z()), 1);
    density = (1 - share) * view.refracted * view.far.pdf(-i.z());
    const auto [m, jacobian] = refraction_between(i, o, view.index);
    if (jacobian > 0) {
      const double single = (1 - fresnel(o, m, view.index)) * ggx_visible_pdf(glass.alpha, o, m) * jacobian;
      value += single * ggx_shadowing(glass.alpha, o.z(), -i.z()) / (-i.z() * squared(view.index));
      density += share * single;
    }
  }
  f = reflectance.head(f.size()) * value;
  return density;
}

Eigen::Vector3d sample(const DielectricScattering& glass, const Eigen::Vector3d& wo, const Eigen::Vector3d& u) {
  const bool outside = wo.z() > 0;
  const View view = view_of(glass, outside);
  const Eigen::Vector3d o = turned(wo, outside);
  Eigen::Vector2d place = u.head<2>();
  if (choose(single_bounce_share(view, o), place.x())) {
    const Eigen::Vector3d m = ggx_sample_visible(glass.alpha, o, place);
    const bool reflects = u.z() < fresnel(o, m, view.index);
    // Light that leaves a facet to the wrong side has no density.
    const Eigen::Vector3d wi = reflects ? mirrored(o, m) : refracted(o, m, view.index);
    return (reflects ? wi.z() > 0 : wi.z() < 0) ? turned(wi, outside) : Eigen::Vector3d::Zero();
  }
  if (u.z() >= view.refracted) return turned(view.near.sample(place), outside);
  return turned(view.far.sample(place), !outside);
}

}  // namespace tensorray
