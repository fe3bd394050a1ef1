#pragma once
/// @file integrators/polariscope/polariscope.h
/// Polarised light through a field that turns its polarisation and bends nothing (integrated photoelasticity: H. Aben
/// and C. Guillemet, Photoelasticity of Glass, 1993). Light travels straight along k; u and w span the plane across it:
///   a = u·T u − w·T w,   b = u·(T + Tᵀ) w,   dE/dz = −i (π C/λ) [[a, b], [b, −a]] E.

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/process/archive.h"
#include "integrators/polariscope/elements.h"
#include "renderer/spectra/spectrum.h"
#include "renderer/surfaces/plate.h"
#include "tracing/bending/geometry.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

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
  float phase = 0, azimuth = 0, rotation = 0;  ///< EquivalentRetarder.
  float integral = 0;  ///< 2π C/λ ∫(σ₁' − σ₂') dz, mean of the samples in the field.
  float length = 0;    ///< The way in the field, world units; likewise.
};

/// The light of a row of pixels, for any arrangement.
struct LightRow {
  std::size_t room = 0;          ///< Bands that a pixel has room for.
  std::vector<float> rotations;  ///< Of a pixel, nine planes of `room` each: the mean rotation (elements.h) by bands.
  std::vector<float> lit;        ///< By pixels: the part of the light that nothing stops.
  std::vector<PolarPoint> points;
  std::vector<float> sums;  ///< By pixels: of the nine planes, the sums of three colours each (PolarView).
};

/// A number of bands, and for each of them the nine components of a rotation, row by row.
using BandRotations = Eigen::Matrix<float, Eigen::Dynamic, 9>;
inline Eigen::Map<const BandRotations> rotations_of(const LightRow& row, std::size_t x) {
  return {&row.rotations[9 * row.room * x], static_cast<Eigen::Index>(row.room), 9};
}

/// Traces parallel light to the pixels of a plate. Steps are at most the finest voxel long, of fourth order in the
/// step, and exact where T is constant; the matrices are unitary whatever the step is. Where the phase between the two
/// waves changes by more than 1 within a band, light has 3, 9 or more wavelengths in it.
class PolarTracer {
 public:
  /// All must outlive it. @param geometry  Bounds, cut and obstacles.
  PolarTracer(const TensorField& field, const Geometry& geometry, const PolarizedLight& light, const Plate& plate);
  ~PolarTracer();

  /// Any thread may call it. The result depends on the row alone.
  LightRow row(int y) const;

  std::size_t room() const { return room_; }

 private:
  struct Ray;
  struct Packet;
  struct Samplers;
  void find_steps(Ray& ray) const;
  void sample(Packet& packet) const;
  void add(std::size_t lane, float weight, std::size_t x, Packet& packet, LightRow& row) const;
  const std::vector<std::vector<float>>& wavelengths_for(double phase) const;

  const TensorField& field_;
  const Geometry& geometry_;
  const PolarizedLight& light_;
  const Plate& plate_;
  Eigen::Vector3d across_;   // k in index space.
  double steps_per_length_;  // At least.
  std::size_t room_;
  std::unique_ptr<Samplers> samplers_;                      // Of threads: bricks that are converted.
  double widest_ = 0;                                       // Change of the relative strength within a band, at most.
  double greatest_ = 0;                                     // Relative strength.
  std::vector<std::vector<std::vector<float>>> strengths_;  // By power of three; by wavelength of a band; by band.
};

/// What an arrangement shows of many pixels.
class PolarView {
 public:
  /// @param colors  R, G and B of each band. @param stokes  Whether spectra are Stokes' parameters.
  PolarView(const Arrangement& arrangement, const std::vector<Band>& bands, const std::vector<Eigen::Vector3d>& colors,
            bool stokes);

  /// Whether the arrangement treats all bands alike, so that `sums` are enough for its colours.
  bool is_achromatic() const { return achromatic_; }
  void set_sums(LightRow& row) const;
  Eigen::Vector3f color(const LightRow& row, std::size_t x) const;

  /// The power of each band (Analysis::power); or S0 of all bands, then S1, S2 and S3.
  void spectrum(const LightRow& row, std::size_t x, float* spectrum) const;

 private:
  /// By bands.
  struct Analyses {
    Eigen::VectorXf through;
    BandRotations by_rotation;
    void set(std::size_t band, const Analysis& analysis);
    Eigen::VectorXf powers(const LightRow& row, std::size_t x) const;
  };
  Eigen::Index bands_;
  bool achromatic_ = true;
  std::vector<Analyses> spectra_;  // Of each parameter.
  Analyses shown_;
  Eigen::Matrix3Xf colors_;
  Eigen::Vector3f through_;  // Colour of what passes, whatever R is.
};

}  // namespace tensorray
