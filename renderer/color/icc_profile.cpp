#include "renderer/color/icc_profile.h"

#include <cmath>
#include <memory>
#include <stdexcept>

#include <Eigen/LU>
#include <lcms2.h>

#include "base/text/text.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

const Vector3d profile_white(0.9642, 1, 0.8249);  // D50, as the format rounds it.

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
