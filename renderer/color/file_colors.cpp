#include "renderer/color/file_colors.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <stdexcept>

#include <Eigen/LU>
#include <lcms2.h>

#include "base/text/text.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3f;
using Eigen::Vector2d;
using Eigen::Vector3f;

/// From the values that a picture stores to light.
using TransferCurve = std::function<double(double value)>;

double linear_light(double value) { return value; }

TransferCurve power_curve(double gamma) {
  return [gamma](double value) { return std::copysign(std::pow(std::abs(value), gamma), value); };
}

/// Values that are not finite, or beyond single precision, become 0.
void multiply(const Matrix3f& matrix, float* rgba) {
  Eigen::Map<Vector3f> color(rgba);
  color = (matrix * color).eval();
  if (!color.allFinite()) color.setZero();
}

ColorConversion curve_and_matrix(const TransferCurve& curve, const Matrix3d& matrix) {
  return [curve, to_xyz = Matrix3f(matrix.cast<float>())](float* rgba, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i, rgba += 4) {
      for (int c = 0; c < 3; ++c) rgba[c] = static_cast<float>(curve(rgba[c]));
      multiply(to_xyz, rgba);
    }
  };
}

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
ColorConversion code_points_to_xyz(int primaries, int curve) {
  Chromaticities chromaticities = rec709_chromaticities();
  if (primaries == 9) chromaticities = {{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, d65_white()};
  if (primaries == 12) chromaticities = {{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, d65_white()};
  const bool is_known = (primaries == 1 || primaries == 9 || primaries == 12) && (curve == 8 || curve == 13);
  if (!is_known)
    throw std::runtime_error("its code points (primaries " + std::to_string(primaries) + ", curve " +
                             std::to_string(curve) + ") are not read");
  return curve_and_matrix(curve == 8 ? linear_light : srgb_light, matrix_of(chromaticities, std::nullopt));
}

/// The gamma that PNGs of sRGB name for readers that know no sRGB.
bool is_gamma_of_srgb(double gamma) { return std::abs(gamma - 0.45455) < 1e-4; }

/// Empty if the tags say nothing.
ColorConversion tags_to_xyz(const ColorTags& tags, bool integer, bool grey) {
  if (tags.code_points) return code_points_to_xyz((*tags.code_points)[0], (*tags.code_points)[1]);
  if (!tags.icc_profile.empty()) return icc_to_xyz(tags.icc_profile, grey);
  if (tags.is_srgb || (!tags.gamma && !tags.chromaticities)) return {};
  const Chromaticities chromaticities =
      tags.chromaticities ? chromaticities_of(*tags.chromaticities) : rec709_chromaticities();
  const Matrix3d matrix = matrix_of(chromaticities, tags.adopted_neutral);
  if (!integer) return curve_and_matrix(linear_light, matrix);
  const bool is_srgb_curve = !tags.gamma || is_gamma_of_srgb(*tags.gamma);
  return curve_and_matrix(is_srgb_curve ? TransferCurve(srgb_light) : power_curve(1 / *tags.gamma), matrix);
}

/// The greatest difference between what two conversions make of the colours from 0 to 1; the second may be empty.
double difference(const ColorConversion& a, const ColorConversion& b, bool grey) {
  constexpr int steps = 16;
  std::vector<float> colors;
  for (int i = 0; i <= steps; ++i)
    for (int j = grey ? i : 0; j <= (grey ? i : steps); ++j)
      for (int k = grey ? i : 0; k <= (grey ? i : steps); ++k)
        for (const int step : {i, j, k, steps}) colors.push_back(static_cast<float>(step) / steps);
  std::vector<float> others = colors;
  a(colors.data(), colors.size() / 4);
  if (b) b(others.data(), others.size() / 4);
  double greatest = 0;
  for (std::size_t i = 0; i < colors.size(); ++i)
    greatest = std::max(greatest, static_cast<double>(std::abs(colors[i] - others[i])));
  return greatest;
}

const Eigen::Vector3d profile_white(0.9642, 1, 0.8249);  // D50, as the format rounds it.

struct FreeIcc {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
  void operator()(cmsToneCurve* curve) const { cmsFreeToneCurve(curve); }
  void operator()(cmsMLU* text) const { cmsMLUfree(text); }
};
using Profile = std::unique_ptr<void, FreeIcc>;
using ToneCurve = std::unique_ptr<cmsToneCurve, FreeIcc>;

Profile open_profile(const std::string& bytes, bool grey) {
  Profile profile(cmsOpenProfileFromMem(bytes.data(), static_cast<cmsUInt32Number>(bytes.size())));
  if (!profile) throw std::runtime_error("it is no ICC profile, or is cut off");
  if (cmsGetColorSpace(profile.get()) != (grey ? cmsSigGrayData : cmsSigRgbData))
    throw std::runtime_error("it is for colours \"" + escaped(bytes.substr(16, 4)) + "\"");
  return profile;
}

/// Light of white and black, as numbers that are neither must not be followed.
void require_light(const ColorConversion& to_xyz) {
  constexpr float max_light = 100;
  float colors[8] = {0, 0, 0, 1, 1, 1, 1, 1};
  to_xyz(colors, 2);
  for (const float value : {colors[0], colors[1], colors[2], colors[4], colors[5], colors[6]})
    if (!(std::abs(value) < max_light)) throw std::runtime_error("it is damaged");
  if (!(colors[5] > colors[1])) throw std::runtime_error("its white is not brighter than its black");
}

cmsCIExyY to_icc(const Eigen::Vector2d& color) { return {color.x(), color.y(), 1}; }

}  // namespace

double srgb_light(double value) { return value >= 0.04045 ? std::pow((value + 0.055) / 1.055, 2.4) : value / 12.92; }

std::optional<ColorConversion> file_colors(const ColorTags& tags, bool integer, bool grey,
                                           const Matrix3d& xyz_to_working) {
  constexpr double profiles_of_srgb = 2e-3;  // By so much they differ.
  constexpr double same_space = 2e-4;        // Published numbers have four digits.
  const ColorConversion to_xyz = tags_to_xyz(tags, integer, grey);
  if (!to_xyz) return std::nullopt;
  const ColorConversion srgb = curve_and_matrix(srgb_light, rgb_to_xyz(rec709_chromaticities()));
  if (integer && difference(to_xyz, srgb, grey) < profiles_of_srgb) return std::nullopt;
  const ColorConversion conversion = [to_xyz, matrix = Matrix3f(xyz_to_working.cast<float>())](float* rgba,
                                                                                               std::size_t count) {
    to_xyz(rgba, count);
    for (std::size_t i = 0; i < count; ++i) multiply(matrix, rgba + 4 * i);
  };
  if (difference(conversion, {}, grey) < same_space) return ColorConversion();
  return conversion;
}

ColorConversion icc_to_xyz(const std::string& bytes, bool grey) {
  // Pixels of four floats, of which the last, alpha, is passed over.
  const cmsUInt32Number xyza = FLOAT_SH(1) | COLORSPACE_SH(PT_XYZ) | CHANNELS_SH(3) | EXTRA_SH(1) | BYTES_SH(4);
  const cmsUInt32Number rgba = FLOAT_SH(1) | COLORSPACE_SH(PT_RGB) | CHANNELS_SH(3) | EXTRA_SH(1) | BYTES_SH(4);
  const cmsUInt32Number greys = FLOAT_SH(1) | COLORSPACE_SH(PT_GRAY) | CHANNELS_SH(1) | EXTRA_SH(3) | BYTES_SH(4);
  const Profile profile = open_profile(bytes, grey), xyz(cmsCreateXYZProfile());
  const std::shared_ptr<void> transform(
      cmsCreateTransform(profile.get(), grey ? greys : rgba, xyz.get(), xyza, INTENT_RELATIVE_COLORIMETRIC,
                         cmsFLAGS_NOCACHE | cmsFLAGS_NOOPTIMIZE),
      [](void* made) {
        if (made) cmsDeleteTransform(made);
      });
  if (!transform) throw std::runtime_error("it is damaged, or has no colours");
  const Eigen::Matrix3f to_d65 = adaptation(profile_white, xyz_of(d65_white()))->cast<float>();
  const ColorConversion to_xyz = [transform, to_d65](float* pixels, std::size_t count) {
    cmsDoTransform(transform.get(), pixels, pixels, static_cast<cmsUInt32Number>(count));
    for (std::size_t i = 0; i < count; ++i, pixels += 4) {
      Eigen::Map<Eigen::Vector3f> color(pixels);
      color = (to_d65 * color).eval();
    }
  };
  require_light(to_xyz);
  return to_xyz;
}

std::string make_icc_profile(const std::string& name, const Chromaticities& colors, const std::vector<float>& curve) {
  constexpr double rounding = 0.01;  // Of an exponent.
  ToneCurve tone(cmsBuildTabulatedToneCurveFloat(nullptr, static_cast<cmsUInt32Number>(curve.size()), curve.data()));
  if (const double gamma = cmsEstimateGamma(tone.get(), rounding); gamma > 0) tone.reset(cmsBuildGamma(nullptr, gamma));
  const cmsCIExyY white = to_icc(colors.white);
  const cmsCIExyYTRIPLE primaries{to_icc(colors.red), to_icc(colors.green), to_icc(colors.blue)};
  cmsToneCurve* const curves[3] = {tone.get(), tone.get(), tone.get()};
  const Profile profile(cmsCreateRGBProfile(&white, &primaries, curves));
  const std::unique_ptr<cmsMLU, FreeIcc> text(cmsMLUalloc(nullptr, 1));
  std::string bytes;
  cmsUInt32Number size = 0;
  if (profile && text && cmsMLUsetASCII(text.get(), "en", "US", name.c_str())) {
    cmsSetProfileVersion(profile.get(), 2.4);
    if (cmsWriteTag(profile.get(), cmsSigProfileDescriptionTag, text.get()) &&
        cmsSaveProfileToMem(profile.get(), nullptr, &size))
      bytes.resize(size);
  }
  if (bytes.empty() || !cmsSaveProfileToMem(profile.get(), bytes.data(), &size)) return "";
  constexpr std::size_t date = 24;  // In the header: six numbers of two bytes, from the year on.
  bytes.replace(date, 12, std::string("\x07\xd0\0\1\0\1\0\0\0\0\0\0", 12));  // The same at any time.
  return bytes;
}

}  // namespace tensorray
