#include "renderer/materials/microfacet.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>

#include "base/constants.h"
#include "renderer/sampling/sampling.h"

namespace tensorray {
namespace {

double square(double x) { return x * x; }

/// The projected area of the visible facets is (cosine + spread) / 2, where Smith's Λ = (spread / cosine - 1) / 2. G1
/// and G2 in terms of it need no division by a cosine.
double spread(double alpha, double cosine) { return std::sqrt(square(alpha) + (1 - square(alpha)) * square(cosine)); }

/// D(m): the area of facets with the normal m, per unit of surface and steradian.
double ggx_facets(double alpha, const Eigen::Vector3d& m) {
  if (m.z() <= 0) return 0;
  const double stretched = (square(m.x()) + square(m.y())) / square(alpha) + square(m.z());
  return 1 / (pi * square(alpha * stretched));
}

/// Greatest `horizon` of a table. Fresnel's reflectance changes near the horizon even where masking does not.
constexpr double widest_horizon = 0.02;

/// Knots are equally spaced in x: half of x is the cosine, the other half rises fast up to the cosine `horizon`.
double to_knot(double horizon, double cosine) { return (cosine + cosine * (1 + horizon) / (cosine + horizon)) / 2; }
double to_cosine(double horizon, double x) {
  // Solves cosine² + linear · cosine = 2 horizon x without cancellation.
  const double linear = 1 + 2 * horizon - 2 * x, root = std::sqrt(square(linear) + 8 * horizon * x);
  return linear > 0 ? 4 * horizon * x / (linear + root) : (root - linear) / 2;
}

int segment_of(double horizon, double cosine) {
  return std::clamp(static_cast<int>(to_knot(horizon, cosine) * CosineTable::segments), 0, CosineTable::segments - 1);
}

double knot_cosine(double horizon, int knot) {
  return to_cosine(horizon, static_cast<double>(knot) / CosineTable::segments);
}

}  // namespace

double ggx_alpha(double roughness, const char* parameter) {
  if (!(roughness >= 0 && roughness <= 1))
    throw std::invalid_argument(std::string(parameter) + " is " + std::to_string(roughness) + "; give a value in 0..1");
  return square(std::max(roughness, min_roughness));
}

Eigen::Vector3d ggx_sample_visible(double alpha, const Eigen::Vector3d& wo, const Eigen::Vector2d& u) {
  // Stretched by 1 / alpha, the facets form a hemisphere. From wo it is a disk whose lower part is squeezed.
  const Eigen::Vector3d view = Eigen::Vector3d(alpha * wo.x(), alpha * wo.y(), wo.z()).normalized();
  const double across = view.head<2>().norm();
  const Eigen::Vector3d right =
      across > 0 ? Eigen::Vector3d(-view.y() / across, view.x() / across, 0) : Eigen::Vector3d(1, 0, 0);
  const Eigen::Vector3d up = view.cross(right);

  const Eigen::Vector2d place = std::sqrt(u.x()) * circle_at(u.y());
  const double x = place.x();
  const double visible = (1 + view.z()) / 2;
  const double y = (1 - visible) * std::sqrt(std::max(0.0, 1 - square(x))) + visible * place.y();
  const double z = std::sqrt(std::max(0.0, 1 - square(x) - square(y)));

  const Eigen::Vector3d normal = x * right + y * up + z * view;
  return Eigen::Vector3d(alpha * normal.x(), alpha * normal.y(), std::max(1e-12, normal.z())).normalized();
}

double ggx_visible_pdf(double alpha, const Eigen::Vector3d& wo, const Eigen::Vector3d& m) {
  return 2 * ggx_facets(alpha, m) * std::max(0.0, wo.dot(m)) / (wo.z() + spread(alpha, wo.z()));
}

double ggx_shadowing(double alpha, double cosine_o, double cosine_i) {
  const double o = spread(alpha, cosine_o), i = spread(alpha, cosine_i);
  return cosine_i * (cosine_o + o) / (cosine_o * i + cosine_i * o);
}

GgxReflection ggx_reflection(double alpha, const Eigen::Vector3d& wi, const Eigen::Vector3d& wo) {
  // As ggx_facets of the normal that wi + wo has when its length is 1, without a square root for it.
  const Eigen::Vector3d sum = wi + wo;
  const double alpha2 = square(alpha), stretched = sum.head<2>().squaredNorm() + alpha2 * square(sum.z());
  const double facets = alpha2 * square(sum.squaredNorm() / stretched) / (2 * pi), o = spread(alpha, wo.z());
  return {facets / (wo.z() * spread(alpha, wi.z()) + wi.z() * o), facets / (wo.z() + o)};
}

double fresnel_dielectric(double cosine, double index) {
  const double sine2 = (1 - square(cosine)) / square(index);
  if (sine2 >= 1) return 1;
  const double refracted = std::sqrt(1 - sine2);
  const double across = (cosine - index * refracted) / (cosine + index * refracted);
  const double along = (index * cosine - refracted) / (index * cosine + refracted);
  return (square(across) + square(along)) / 2;
}

double fresnel_conductor(double cosine, double n, double k) {
  // In real arithmetic: a + ib is the root of (n + ik)² - sine².
  const double c2 = square(cosine), s2 = 1 - c2;
  const double difference = square(n) - square(k) - s2;
  const double a2_b2 = std::sqrt(square(difference) + 4 * square(n * k));
  const double a = std::sqrt(std::max(0.0, (a2_b2 + difference) / 2));
  const double across_even = a2_b2 + c2, odd = 2 * cosine * a;
  const double along_even = c2 * a2_b2 + square(s2);
  if (across_even <= 0 || along_even <= 0) return 1;
  const double across = (across_even - odd) / (across_even + odd);
  const double along = across * (along_even - odd * s2) / (along_even + odd * s2);
  return (across + along) / 2;
}

double fresnel_schlick(double cosine, double normal_reflectance) {
  const double x = 1 - cosine;
  return normal_reflectance + (1 - normal_reflectance) * square(square(x)) * x;
}

double hemispherical_mean(const std::function<double(double cosine)>& fresnel) {
  constexpr int steps = 256;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double cosine = (i + 0.5) / steps;
    sum += cosine * fresnel(cosine);
  }
  return sum * 2 / steps;  // Exact for constants: the cosines add up to steps / 2.
}

double visible_mean(double alpha, double cosine,
                    const std::function<double(const Eigen::Vector3d& wo, const Eigen::Vector3d& m)>& weight) {
  // The radius in the disk is the sine of an angle, which makes the integrand smooth at the rim. One half of the disk
  // mirrors the other. The radii shift by the golden ratio from one angle to the next, so that they sample all phases
  // of a circle at which the weight jumps (total reflection).
  constexpr int radii = 32, angles = 34;
  constexpr double golden = 0.6180339887498949;
  const Eigen::Vector3d wo(std::sqrt(std::max(0.0, 1 - square(cosine))), 0, cosine);
  double sum = 0, total = 0;
  for (int j = 0; j < angles; ++j) {
    const double turn = ((j + 0.5) / angles - 0.5) / 2, shift = j * golden - std::floor(j * golden);
    for (int i = 0; i < radii; ++i) {
      const double latitude = (i + shift) / radii * pi / 2, area = std::sin(2 * latitude);
      sum += area * weight(wo, ggx_sample_visible(alpha, wo, {square(std::sin(latitude)), turn < 0 ? turn + 1 : turn}));
      total += area;
    }
  }
  return sum / total;
}

double CosineTable::at(double cosine) const {
  const int segment = segment_of(horizon, cosine);
  const double fraction = to_knot(horizon, cosine) * segments - segment;
  return values[segment] + fraction * (values[segment + 1] - values[segment]);
}

double CosineTable::pdf(double cosine) const {
  return mean() > 0 ? means[segment_of(horizon, cosine)] / mean() * cosine / pi : 0;
}

Eigen::Vector3d CosineTable::sample(const Eigen::Vector2d& u) const {
  // cosine² is uniform within a segment.
  const double wanted = u.x() * mean();
  const auto above = std::upper_bound(cumulative.begin() + 1, cumulative.end() - 1, wanted);
  const int segment = static_cast<int>(above - cumulative.begin()) - 1;
  const double low = square(knot_cosine(horizon, segment)), high = square(knot_cosine(horizon, segment + 1));
  const double share = means[segment] > 0 ? (wanted - cumulative[segment]) / means[segment] : u.x() * (high - low);
  const double cosine2 = std::clamp(low + share, low, high);
  const Eigen::Vector2d place = std::sqrt(1 - cosine2) * circle_at(u.y());
  return {place.x(), place.y(), std::sqrt(cosine2)};
}

CosineTable make_cosine_table(double alpha, const std::function<double(double cosine)>& function) {
  CosineTable table;
  table.horizon = std::min(alpha, widest_horizon);
  const double horizon = table.horizon;
  for (int knot = 0; knot <= CosineTable::segments; ++knot)
    table.values[knot] = std::clamp(function(knot_cosine(horizon, knot)), 0.0, 1.0);
  for (int segment = 0; segment < CosineTable::segments; ++segment) {
    // Simpson's rule over x of value · d(cosine²). The weights are normalised so that the constant 1 is exact.
    const double first = knot_cosine(horizon, segment), last = knot_cosine(horizon, segment + 1);
    const double middle = to_cosine(horizon, (segment + 0.5) / CosineTable::segments);
    const auto density = [horizon](double cosine) {
      return cosine / (1 + (1 + horizon) * horizon / square(cosine + horizon));
    };
    const double a = density(first), b = 4 * density(middle), c = density(last);
    const double low = table.values[segment], high = table.values[segment + 1];
    table.means[segment] = (a * low + b * (low + high) / 2 + c * high) / (a + b + c);
    table.cumulative[segment + 1] = table.cumulative[segment] + table.means[segment] * (square(last) - square(first));
  }
  return table;
}

double fill(double missing_o, double missing_i, double mean) {
  return mean > 0 ? missing_o * missing_i / (pi * mean) : 0;
}

double fill_color(double mean_fresnel, double missing) {
  const double once = 1 - missing;
  return square(mean_fresnel) * once / std::max(1e-12, 1 - mean_fresnel * missing);
}

}  // namespace tensorray
