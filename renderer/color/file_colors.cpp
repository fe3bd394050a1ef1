#include "renderer/color/file_colors.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/LU>

#include "renderer/color/chromaticities.h"
#include "renderer/color/icc_profile.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

std::array<TransferCurve, 3> alike(const TransferCurve& curve) { return {curve, curve, curve}; }

/// Whether the primaries are those of XYZ.
bool is_xyz(const Chromaticities& c) {
  return (c.red - Vector2d(1, 0)).norm() + (c.green - Vector2d(0, 1)).norm() + c.blue.norm() < 1e-4;
}

Matrix3d matrix_of(const Chromaticities& colors, const std::optional<std::array<double, 2>>& neutral) {
  const Matrix3d to_xyz = rgb_to_xyz(colors);
  if (!to_xyz.allFinite() || !(std::abs(to_xyz.determinant()) > 1e-9))
    throw std::runtime_error("its chromaticities are no colours");
  if (is_xyz(colors) && !neutral) return to_xyz;
  const Vector2d white = neutral ? Vector2d((*neutral)[0], (*neutral)[1]) : colors.white;
  const std::optional<Matrix3d> adapted = adaptation(xyz_of(white), xyz_of(d65_white()));
  if (!adapted || !adapted->allFinite()) throw std::runtime_error("its white is no white");
  return *adapted * to_xyz;
}

/// ITU-T H.273, as far as pictures of standard range use it.
FileColors colors_of_code_points(int primaries, int curve) {
  FileColors colors;
  Chromaticities chromaticities = rec709_chromaticities();
  if (primaries == 9) chromaticities = {{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, d65_white()};
  if (primaries == 12) chromaticities = {{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, d65_white()};
  const bool is_known = (primaries == 1 || primaries == 9 || primaries == 12) && (curve == 8 || curve == 13);
  if (!is_known)
    throw std::runtime_error("its code points (primaries " + std::to_string(primaries) + ", curve " +
                             std::to_string(curve) + ") are not read");
  colors.rgb_to_xyz = matrix_of(chromaticities, std::nullopt);
  colors.curves = alike(curve == 8 ? TransferCurve() : srgb_curve());
  return colors;
}

/// The gamma that PNGs of sRGB name for readers that know no sRGB.
bool is_gamma_of_srgb(double gamma) { return std::abs(gamma - 0.45455) < 1e-4; }

std::optional<FileColors> colors_of(const ColorTags& tags, bool integer, bool grey) {
  if (tags.code_points) return colors_of_code_points((*tags.code_points)[0], (*tags.code_points)[1]);
  if (!tags.icc_profile.empty()) {
    const IccProfile profile = parse_icc_profile(tags.icc_profile, grey);
    return FileColors{profile.curves, profile.rgb_to_xyz};
  }
  if (tags.is_srgb || (!tags.gamma && !tags.chromaticities)) return std::nullopt;
  FileColors colors;
  const Chromaticities chromaticities =
      tags.chromaticities ? chromaticities_of(*tags.chromaticities) : rec709_chromaticities();
  colors.rgb_to_xyz = matrix_of(chromaticities, tags.adopted_neutral);
  const bool is_srgb_curve = !tags.gamma || is_gamma_of_srgb(*tags.gamma);
  if (integer) colors.curves = alike(is_srgb_curve ? srgb_curve() : power_curve(1 / *tags.gamma));
  return colors;
}

}  // namespace

bool is_srgb(const FileColors& colors) {
  constexpr double rounding = 2e-3;  // Profiles of sRGB differ by so much.
  const TransferCurve expected = srgb_curve();
  double difference = (colors.rgb_to_xyz - rgb_to_xyz(rec709_chromaticities())).cwiseAbs().maxCoeff();
  for (const TransferCurve& curve : colors.curves)
    for (float x = 0; x <= 1; x += 1.0f / 64)
      difference = std::max(difference, static_cast<double>(std::abs(curve.at(x) - expected.at(x))));
  return difference < rounding;
}

std::optional<FileColors> file_colors(const ColorTags& tags, bool integer, bool grey) {
  const std::optional<FileColors> colors = colors_of(tags, integer, grey);
  if (colors && integer && is_srgb(*colors)) return std::nullopt;
  return colors;
}

}  // namespace tensorray
