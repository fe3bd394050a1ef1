#include "renderer/materials/microfacet.h"

#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include "base/constants.h"
#include "renderer/materials/metal_and_glass.h"
#include "renderer/sampling/random.h"

namespace tensorray {
namespace {

Eigen::Vector3d direction_at(double cosine, double azimuth) {
  const double sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

/// ∫ over the hemisphere by the midpoint rule. Steps are small near the pole, where highlights are.
template <class Function>
double hemisphere(const Function& function) {
  constexpr int rows = 1000, columns = 200;
  double sum = 0;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const double t = (row + 0.5) / rows;
      sum += 2 * t * function(direction_at(1 - t * t, (column + 0.5) / columns * 2 * pi));
    }
  return sum * 2 * pi / rows / columns;
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
