#include "renderer/materials/material.h"

#include <complex>
#include <numeric>

#include "base/constants.h"
#include "renderer/materials/metal_and_glass.h"
#include "renderer/materials/microfacet.h"
#include "renderer/sampling/random.h"
#include "tests/renderer/statistics.h"

namespace tensorray {
namespace {

Vector3d direction(double cosine, double azimuth) {
  const double sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

Vector3d random_direction(int i) {
  return direction(2 * random_uniform(1, i, 0) - 1, 2 * pi * random_uniform(1, i, 1));
}

Vector3d random_point(std::uint64_t seed, int i) {
  return {random_uniform(seed, i, 0), random_uniform(seed, i, 1), random_uniform(seed, i, 2)};
}

struct Named {
  std::string name;
  Material material;
};

/// A material of each kind and roughness, with one band.
std::vector<Named> materials(const std::vector<double>& roughnesses, double reflectance) {
  std::vector<Named> result;
  for (const double roughness : roughnesses) {
    const auto add = [&](const std::string& name, const MaterialSettings& settings) {
      const Material material = make_material(settings, BandValues::Constant(1, reflectance));
      result.push_back({name + " of roughness " + std::to_string(roughness), material});
    };
    add("diffuse", Diffuse{});
    add("metal", RoughConductor{roughness, {BandValues::Zero(1), BandValues::Ones(1)}});
    add("glass", RoughDielectric{roughness, 1.5});
    add("bubble", RoughDielectric{roughness, 0.8});
    add("plastic", Principled{0, roughness, 0.5, 0, 0.1});
    add("coated plastic", Principled{0, roughness, 1, 1, 0.03});
    add("half metal", Principled{0.5, roughness, 0.5, 0.7, 0.6});
    add("coated metal", Principled{1, roughness, 0.5, 1, 0.3});
  }
  return result;
}

ViewedMaterial viewed(const Material& material, const Vector3d& wo) {
  return viewed(material, material.reflectance, wo);
}

double f(const Material& material, const Vector3d& wi, const Vector3d& wo) {
  BandValues value(1);
  evaluate(material, viewed(material, wo), material.reflectance, wi, value);
  return value[0];
}

double pdf(const Material& material, const Vector3d& wi, const Vector3d& wo) {
  return pdf(material, viewed(material, wo), material.reflectance, wi);
}

auto sample(const Material& material, const Vector3d& wo, const Vector3d& u, BandValues& weight) {
  return sample(material, viewed(material, wo), material.reflectance, u, weight);
}

/// The scattered part of uniform light (radiance in proportion to n²). The points of a Sobol sequence make a smaller
/// error than independent ones.
Mean albedo(const Material& material, const Vector3d& wo) {
  BandValues weight(1);
  Mean mean;
  for (int i = 0; i < 4096; ++i) {
    const auto scattered = sample(material, wo, {sobol(5, i, 0), sobol(5, i, 1), sobol(5, i, 2)}, weight);
    mean.add(scattered ? weight[0] / scattered->refraction : 0);
  }
  return mean;
}

TEST(MaterialFurnaceTest, WhiteMaterialsReturnAllLight) {
  for (const Named& white : materials({0.0, 0.15, 0.4, 0.7, 1.0}, 1))
    for (const double cosine : {1.0, 0.75, 0.5, 0.2, 0.03, 1e-3, -1e-3, -0.2, -0.72, -0.8, -1.0}) {
      if (cosine < 0 && !is_glass(white.material)) continue;
      const Mean part = albedo(white.material, direction(cosine, 1));
      EXPECT_NEAR(part.mean(), 1, 2e-3 + 3 * part.error()) << white.name << " " << cosine;
    }
}

TEST(MaterialFurnaceTest, SmoothMetalsReflectAsFresnelSays) {
  const ConductorIndex gold = metal_index("gold", {600});
  const auto material = make_material(RoughConductor{0, gold}, BandValues::Ones(1));
  for (const double cosine : {1.0, 0.5, 0.2})
    EXPECT_NEAR(albedo(material, direction(cosine, 0)).mean(), fresnel_conductor(cosine, gold.n[0], gold.k[0]), 2e-3);
}

TEST(MaterialFurnaceTest, WithoutSpecularThePrincipledMaterialIsLambert) {
  const auto material = make_material(Principled{0, 0.3, 0, 0, 0.1}, BandValues::Constant(1, 0.6));
  for (int i = 0; i < 100; ++i) {
    const Vector3d wi = random_direction(2 * i), wo = random_direction(2 * i + 1);
    EXPECT_NEAR(f(material, wi, wo), wi.z() * wo.z() > 0 ? 0.6 / pi : 0, 1e-12);
  }
}

TEST(MaterialTest, IsReciprocal) {
  for (const Named& any : materials({0.3, 0.8}, 0.7)) {
    const auto* glass = std::get_if<DielectricScattering>(&any.material.scattering);
    const auto index = [&](const Vector3d& w) { return glass != nullptr && w.z() < 0 ? glass->index : 1; };
    double sum = 0;
    for (int i = 0; i < 500; ++i) {
      const Vector3d wi = random_direction(2 * i), wo = random_direction(2 * i + 1);
      const double forwards = f(any.material, wi, wo) / std::pow(index(wo), 2);
      const double backwards = f(any.material, wo, wi) / std::pow(index(wi), 2);
      EXPECT_NEAR(forwards, backwards, 1e-9 * (forwards + backwards)) << any.name;
      sum += forwards;
    }
    EXPECT_GT(sum, 0) << any.name;
  }
}

TEST(MaterialTest, OpaqueOnesAreTheSameFromBothSides) {
  for (const Named& any : materials({0.4}, 0.7)) {
    if (is_glass(any.material)) continue;
    for (int i = 0; i < 50; ++i) {
      const Vector3d wi = random_direction(2 * i), wo = random_direction(2 * i + 1);
      const Vector3d wi_below(wi.x(), wi.y(), -wi.z()), wo_below(wo.x(), wo.y(), -wo.z());
      EXPECT_EQ(f(any.material, wi, wo), f(any.material, wi_below, wo_below)) << any.name;
      EXPECT_TRUE(wi.z() * wo.z() > 0 || f(any.material, wi, wo) == 0) << any.name;
    }
  }
}

TEST(MaterialTest, SmoothGlassObeysSnellAndFresnel) {
  const auto glass = make_material(RoughDielectric{0, 1.5}, BandValues::Ones(1));
  for (const double cosine : {0.9, 0.5, -0.9}) {
    const Vector3d wo = direction(cosine, 0);
    const double index = cosine > 0 ? 1.5 : 1 / 1.5;
    BandValues weight(1);
    int refracted = 0, near = 0;
    for (int i = 0; i < 4096; ++i) {
      const auto scattered = sample(glass, wo, {sobol(2, i, 0), sobol(2, i, 1), sobol(2, i, 2)}, weight);
      if (!scattered || scattered->wi.z() * wo.z() > 0) continue;
      ++refracted;
      near += std::hypot(scattered->wi.x() + wo.x() / index, scattered->wi.y()) < 0.02;
      EXPECT_NEAR(scattered->refraction, 1 / (index * index), 1e-12);
    }
    EXPECT_NEAR(refracted / 4096.0, 1 - fresnel_dielectric(std::abs(cosine), index), 5e-3);
    // GGX has long tails: alpha² / (alpha² + tan²) of the facets lie beyond an angle.
    EXPECT_GT(near, 0.995 * refracted);
  }
}

constexpr int rows = 24, columns = 16;

int bin_of(const Vector3d& w) {
  const double azimuth = std::atan2(w.y(), w.x()) / (2 * pi);
  const int row = std::min(rows - 1, static_cast<int>((w.z() + 1) / 2 * rows));
  return row * columns + std::min(columns - 1, static_cast<int>((azimuth < 0 ? azimuth + 1 : azimuth) * columns));
}

/// ∫ pdf over each bin, by the midpoint rule.
std::vector<double> bin_probabilities(const Material& material, const Vector3d& wo) {
  constexpr int fine = 12;
  std::vector<double> result(rows * columns);
  for (int row = 0; row < rows * fine; ++row)
    for (int column = 0; column < columns * fine; ++column) {
      const Vector3d wi = direction((row + 0.5) / (rows * fine) * 2 - 1, (column + 0.5) / (columns * fine) * 2 * pi);
      result[row / fine * columns + column / fine] += pdf(material, wi, wo) * 4 * pi / (rows * columns * fine * fine);
    }
  return result;
}

TEST(MaterialSamplingTest, DirectionsHaveTheirDensity) {
  for (const Named& any : materials({0.45, 1.0}, 0.7))
    for (const double cosine : {0.95, 0.3, -0.6}) {
      if (any.name.find("coated plastic") == 0) continue;  // Its coat has highlights that are too sharp for these bins.
      const Vector3d wo = direction(cosine, 0.4);
      std::vector<double> expected = bin_probabilities(any.material, wo);
      const double total = std::accumulate(expected.begin(), expected.end(), 0.0);
      EXPECT_LT(total, 1 + 2e-3) << any.name << " " << cosine;
      expected.push_back(std::max(0.0, 1 - total));
      std::vector<int> counts(expected.size());
      BandValues weight(1);
      for (int i = 0; i < 20000; ++i) {
        const auto scattered = sample(any.material, wo, random_point(3, i), weight);
        ++counts[scattered ? bin_of(scattered->wi) : counts.size() - 1];
      }
      EXPECT_LT(chi_square_score(counts, expected), 5) << any.name << " " << cosine;
    }
}

TEST(MaterialSamplingTest, TheWeightIsWhatItSays) {
  for (const Named& any : materials({0.0, 0.3, 1.0}, 0.7))
    for (int i = 0; i < 200; ++i) {
      const Vector3d wo = random_direction(i);
      BandValues weight(1);
      const auto scattered = sample(any.material, wo, random_point(4, i), weight);
      EXPECT_TRUE(scattered || weight[0] == 0) << any.name;
      if (!scattered) continue;
      EXPECT_NEAR(scattered->wi.norm(), 1, 1e-9) << any.name;
      EXPECT_EQ(scattered->pdf, pdf(any.material, scattered->wi, wo));
      const double expected = f(any.material, scattered->wi, wo) * std::abs(scattered->wi.z()) / scattered->pdf;
      EXPECT_NEAR(weight[0], expected, 1e-12 * expected) << any.name;
      EXPECT_LT(weight[0] / scattered->refraction, 10) << any.name << " " << wo.z();
    }
}

TEST(MaterialSamplingTest, BandsDoNotMix) {
  const BandValues color = (BandValues(3) << 0.9, 0, 0.2).finished();
  const ConductorIndex gold = metal_index("gold", {450, 550, 650});
  const std::vector<MaterialSettings> all = {Diffuse{}, RoughConductor{0.4, gold}, RoughDielectric{0.4, 1.5},
                                             Principled{0.4, 0.4, 0.5, 0.5, 0.2}};
  for (const MaterialSettings& settings : all) {
    const Material material = make_material(settings, color);
    const Vector3d wi = direction(0.6, 1), wo = direction(0.5, 3);
    BandValues together(3);
    evaluate(material, viewed(material, wo), color, wi, together);
    for (int band = 0; band < 3; ++band) {
      MaterialSettings single = settings;
      if (auto* metal = std::get_if<RoughConductor>(&single))
        metal->index = {BandValues::Constant(1, gold.n[band]), BandValues::Constant(1, gold.k[band])};
      EXPECT_NEAR(together[band], f(make_material(single, color.segment(band, 1)), wi, wo), 1e-12);
    }
  }
}

TEST(MaterialSamplingTest, ThePointsReflectanceReplacesTheMaterials) {
  const Material red = make_material(Principled{}, BandValues::Constant(2, 0.1));
  const Material blue = make_material(Principled{}, BandValues::Constant(2, 0.8));
  const Vector3d wi = direction(0.6, 1), wo = direction(0.5, 3);
  BandValues painted(2), own(2);
  evaluate(red, viewed(red, blue.reflectance, wo), blue.reflectance, wi, painted);
  evaluate(blue, viewed(blue, wo), blue.reflectance, wi, own);
  EXPECT_TRUE((painted == own).all());
}

TEST(MaterialTest, GrazingAnglesAreFinite) {
  const std::vector<double> cosines = {1, 0.5, 1e-3, 1e-8, 1e-16, 1e-200, 0, -1e-200, -1e-8, -0.5, -1};
  for (const Named& any : materials({0.0, 0.5, 1.0}, 0.7))
    for (const double cosine_o : cosines) {
      const Vector3d wo = direction(cosine_o, 0);
      BandValues weight(1);
      for (const double azimuth : {0.0, 1.0, pi})
        for (const double cosine_i : cosines) {
          const Vector3d wi = direction(cosine_i, azimuth);
          const double value = f(any.material, wi, wo), density = pdf(any.material, wi, wo);
          const bool is_sound = std::isfinite(value + density) && value >= 0 && density >= 0;
          ASSERT_TRUE(is_sound) << any.name << " " << cosine_i << " " << cosine_o << ": " << value << " " << density;
        }
      for (int i = 0; i < 50; ++i) {
        sample(any.material, wo, random_point(6, i), weight);
        ASSERT_TRUE(std::isfinite(weight[0]) && weight[0] >= 0) << any.name << " " << cosine_o;
      }
    }
}

TEST(MicrofacetTest, DielectricFresnelHasItsClosedForms) {
  EXPECT_NEAR(fresnel_dielectric(1, 1.5), 0.04, 1e-15);
  EXPECT_NEAR(fresnel_dielectric(1, 1 / 1.5), 0.04, 1e-15);
  EXPECT_EQ(fresnel_dielectric(0.7, 1), 0);
  EXPECT_NEAR(fresnel_dielectric(0, 1.5), 1, 1e-15);
  const double critical = std::sqrt(1 - 1 / (1.5 * 1.5));
  EXPECT_EQ(fresnel_dielectric(critical - 1e-9, 1 / 1.5), 1);
  EXPECT_LT(fresnel_dielectric(critical + 1e-3, 1 / 1.5), 1);
  // At Brewster's angle only one polarisation is reflected, by ((n² - 1) / (n² + 1))².
  const double n2 = 1.5 * 1.5;
  EXPECT_NEAR(fresnel_dielectric(1 / std::sqrt(1 + n2), 1.5), std::pow((n2 - 1) / (n2 + 1), 2) / 2, 1e-15);
}

TEST(MicrofacetTest, ConductorFresnelIsThatOfComplexNumbers) {
  const std::complex<double> indices[] = {{0.2, 3.3}, {1.3, 7.4}, {1.5, 0}, {0.05, 0.4}, {3, 1}};
  for (const auto& index : indices)
    for (const double cosine : {1.0, 0.8, 0.3, 0.01}) {
      const std::complex<double> refracted = std::sqrt(1.0 - (1 - cosine * cosine) / (index * index));
      const double across = std::norm((cosine - index * refracted) / (cosine + index * refracted));
      const double along = std::norm((index * cosine - refracted) / (index * cosine + refracted));
      EXPECT_NEAR(fresnel_conductor(cosine, index.real(), index.imag()), (across + along) / 2, 1e-12)
          << index << " " << cosine;
    }
  for (const double cosine : {0.0, 1e-9, 0.5, 1.0}) EXPECT_EQ(fresnel_conductor(cosine, 0, 1), 1);
}

TEST(MetalTest, HasThePublishedValuesAndTheirMeans) {
  const ConductorIndex gold = metal_index("gold", {548.6, (548.6 + 582.1) / 2, 100, 2000});
  EXPECT_NEAR(gold.n[0], 0.43, 1e-12);
  EXPECT_NEAR(gold.k[0], 2.455, 1e-12);
  EXPECT_NEAR(gold.n[1], 0.36, 1e-12);
  EXPECT_NEAR(gold.k[2], 1.871, 1e-12);
  EXPECT_NEAR(gold.k[3], 5.663, 1e-12);
}

}  // namespace
}  // namespace tensorray
