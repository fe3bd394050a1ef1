#pragma once
/// Polarised light through a field that turns its polarisation and bends nothing (integrated photoelasticity: H. Aben
/// and C. Guillemet, Photoelasticity of Glass, 1993). Light travels straight along k; u and w span the plane across it:
///   a = u·T u − w·T w,   b = u·(T + Tᵀ) w,   dE/dz = −i (π C/λ) [[a, b], [b, −a]] E.

#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "integrators/polariscope/elements.h"
#include "renderer/spectra/spectrum.h"
#include "renderer/surfaces/plate.h"
#include "tracing/bending/geometry.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

class DifferenceSampler;

/// The light that is traced.
struct PolarizedLight {
  Eigen::Vector3d direction, right, up;  ///< k, u and w: unit, normal to each other.
  Eigen::Vector3d start;                 ///< A point of a plane across the light, before all that it meets.
  /// The rectangle about `start` that light comes through, and its axes, which may not be u and w; none: light is
  /// everywhere.
  std::optional<Eigen::AlignedBox2d> aperture;
  Eigen::Matrix<double, 2, 3> aperture_axes = Eigen::Matrix<double, 2, 3>::Zero();

  std::vector<Band> bands;    ///< Without any, only integrals and lengths are found.
  std::size_t reference = 0;  ///< The band whose middle is the reference wavelength.

  /// π C/λ at the reference wavelength: half the phase between two waves, for a difference of 1 over a length of 1.
  double strength = 1;
  /// C/λ of a wavelength over that of the reference.
  std::function<double(double wavelength)> relative;

  int samples = 2;  ///< Of a pixel, along x and along y; > 0.
};

/// What is known of the light of a pixel, the mean of its samples. The phases are those of the reference wavelength.
struct PolarPoint {
  EquivalentRetarder retarder;
  double integral = 0;  ///< 2π C/λ ∫(σ₁' − σ₂') dz, mean of the samples in the field.
  double length = 0;    ///< The way in the field, world units; likewise.
};

/// The light of a row of pixels, for any arrangement.
struct LightRow {
  std::size_t room = 0;      ///< Bands that a pixel has room for.
  std::vector<float> bands;  ///< Of a pixel, ten planes of `room` each: MeanLight by bands.
  std::vector<float> sums;   ///< Of a pixel, of each of the ten planes, the sums of red, green and blue (PolarView).
  std::vector<PolarPoint> points;
};

using BandLight = Eigen::Matrix<float, Eigen::Dynamic, 10>;
inline Eigen::Map<const BandLight> bands_of(const LightRow& row, std::size_t x) {
  return {&row.bands[10 * row.room * x], static_cast<Eigen::Index>(row.room), 10};
}

/// Traces parallel light to the pixels of a plate. Steps are at most the finest voxel long, of fourth order in the
/// step, and exact where T is constant; the matrices are unitary whatever the step is. Where the phase between the two
/// waves changes by more than 1 within a band, light has 3, 9 or more wavelengths in it.
class PolarTracer {
 public:
  /// All must outlive it. @param geometry  Bounds, cut and obstacles.
  PolarTracer(const TensorField& field, const Geometry& geometry, const PolarizedLight& light, const Plate& plate);

  /// Any thread may call it. The result depends on the row alone.
  LightRow row(int y) const;

  std::size_t room() const { return room_; }

 private:
  struct Ray;
  struct Packet;
  void find_steps(std::size_t lane, Packet& packet) const;
  void sample(Packet& packet) const;
  void add(std::size_t lane, float weight, std::size_t x, Packet& packet, LightRow& row) const;

  const TensorField& field_;
  const Geometry& geometry_;
  const PolarizedLight& light_;
  const Plate& plate_;
  Eigen::Vector3d across_;   // k in index space.
  double steps_per_length_;  // At least.
  std::size_t room_;
  double greatest_ = 0;                          // Of PolarizedLight::relative.
  double widest_ = 0;                            // Its change within a band, at most.
  std::vector<std::vector<float>> strengths_;    // By wavelength of a band, by band: as a part of the greatest.
  std::function<DifferenceSampler&()> sampler_;  // Of the thread: it keeps bricks.
};

/// What an arrangement shows of many pixels.
class PolarView {
 public:
  /// @param colors  R, G and B of each band. @param stokes  Whether spectra are Stokes' parameters.
  PolarView(const Arrangement& arrangement, const std::vector<Band>& bands, const Eigen::Matrix3Xd& colors,
            bool stokes);

  /// Whether the arrangement treats all bands alike, so that `sums` are enough for its colours.
  bool is_achromatic() const { return achromatic_; }
  void set_sums(LightRow& row) const;
  Eigen::Vector3f color(const LightRow& row, std::size_t x) const;

  /// The power of each band; or a column of each of S0, S1, S2 and S3.
  Eigen::MatrixXf spectrum(const LightRow& row, std::size_t x) const;

 private:
  Eigen::Index bands_;
  std::vector<BandLight> analyses_;  // Of the power that is shown, then of Stokes' parameters if they are wanted.
  Eigen::Matrix3Xf colors_;
  bool achromatic_;
};

}  // namespace tensorray
