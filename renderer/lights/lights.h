#pragma once
/// The lights of a scene, and how to sample directions towards them. Radiance is given for each band, relative to the
/// light that the bands are made from: see Band.

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include <Eigen/Geometry>

#include "base/geometry/triangle_mesh.h"
#include "renderer/surfaces/triangle_scene.h"
#include "renderer/textures/environment_map.h"

namespace tensorray {

/// Bands that stand next to each other, such as those whose light a path carries. By default: all.
struct BandRange {
  std::ptrdiff_t first = 0;
  std::ptrdiff_t count = std::numeric_limits<std::ptrdiff_t>::max();  ///< At most.

  /// How many of `bands` bands are in the range.
  std::ptrdiff_t size(std::ptrdiff_t bands) const { return std::min(count, bands - first); }
};

/// A surface that emits evenly, equally in all directions.
struct AreaLight {
  TriangleMesh mesh;            ///< World; emits from the side on which its triangles are counter-clockwise.
  std::vector<float> radiance;  ///< In every band.
};

/// Parallel light, or the light of a disk in the sky such as the sun.
struct DirectionalLight {
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< Direction in which the light travels; any length.
  std::vector<float> irradiance;  ///< Irradiance of a surface that faces the light, in every band.
  double angle = 0;  ///< Angle from the disk's centre to its rim, radians (the sun: 0.00465); 0 to π/2; 0: parallel.
};

/// Light of a point, equal in all directions.
struct PointLight {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< World.
  std::vector<float> intensity;  ///< Irradiance, at a distance of 1, of a surface that faces the light, in every band.
};

/// Equal light from all directions.
struct ConstantLight {
  std::vector<float> radiance;  ///< In every band.
};

using Light = std::variant<AreaLight, DirectionalLight, ConstantLight, EnvironmentLight, PointLight>;

// What others ask of a light, whatever its kind. Kinds are told apart by std::visit alone, with a function for each.

/// The triangles of an area light; null of other kinds.
const TriangleMesh* emitting_mesh(const Light& light);

/// The strength, in every band, of the light that a volume throws on surfaces; null: none of this kind comes through.
const std::vector<float>* thrown_light(const Light& light);

/// The direction, of any length, in which light comes straight to a point, of lights that are so small that they cast
/// shadows: directional ones, as from the disk's centre, and points; nothing of other kinds.
std::optional<Eigen::Vector3d> direction_at(const Light& light, const Eigen::Vector3d& point);

/// A rectangle of two triangles that faces right × up.
/// @param right, up  Unit, normal to each other.
TriangleMesh rectangle_mesh(const Eigen::Vector3d& center, const Eigen::Vector3d& right, const Eigen::Vector3d& up,
                            const Eigen::Vector2d& size);

/// Normal of a triangle on the side that emits; its length is twice the area.
Eigen::Vector3d triangle_normal(const TriangleMesh& mesh, std::size_t triangle);

/// Light that reaches a point from one direction. Reuse one sample: it then allocates no more memory.
struct LightSample {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit, from the point to the light.
  double distance = 0;          ///< Distance to the light; anything nearer shadows it. Infinite for the background.
  std::vector<float> radiance;  ///< In the bands asked for. For a delta light: irradiance on a surface normal to
                                ///< `direction`.
  double pdf = 0;  ///< Per steradian, with the probability of the light. For a delta light: that probability alone.
  bool is_delta = false;  ///< True if no other way to choose directions can find this light.
  int light = -1;         ///< Its index; −1: the background.
};

/// Chooses lights by their power, and then directions by the light. Immutable: any thread may use it.
///
/// Constant light is never chosen: the directions in which a material scatters find it with the least noise.
///
/// Parallel light and points are deltas. All other lights that are infinitely far away form the background. The caller
/// sees it as one light: its radiance is the sum over these lights, and its density is that of choosing a direction by
/// any of them. A caller that also has its own way to choose directions (multiple importance sampling) weighs `sample`
/// against `area_pdf` where its ray meets an area light, and against `background_pdf` where it meets nothing.
class LightSampler {
 public:
  /// @param lights      Other functions refer to a light by its index here.
  /// @param luminance   Luminance of each band at radiance 1, such as the Y of Band::xyz; all >= 0, at least one > 0.
  ///                    One tenth of the weight is equal for all bands, so that bands that the eye hardly sees are also
  ///                    sampled.
  /// @param scene       Bounding box of what is lit; it sets the power of the background relative to area lights.
  /// @throw std::invalid_argument naming the light by its index: a value that is missing for a band, not finite or
  /// negative, no area, a direction that is zero or not finite, an angle out of range; otherwise as EnvironmentMap.
  LightSampler(std::vector<Light> lights, const std::vector<float>& luminance, const Eigen::AlignedBox3d& scene);

  /// Samples light that reaches `point` if nothing is in between. The expectation of radiance · f(direction) / pdf is
  /// the integral of f over all light, but for constant light where no other light is chosen.
  /// @param u  Uniform in [0, 1)².
  /// @param bands  Whose radiance is wanted. The direction does not depend on them.
  /// @return false if there is no light in the chosen direction, or none to choose: count it as 0.
  bool sample(const Eigen::Vector3d& point, const Eigen::Vector2d& u, LightSample& sample, BandRange bands = {}) const;

  /// The density, per steradian, with which `sample` finds `position` on an area light from `point`.
  /// @param normal  Unit normal of the mesh at `position`. The density is zero if this side does not emit.
  double area_pdf(int light, const Eigen::Vector3d& point, const Eigen::Vector3d& position,
                  const Eigen::Vector3d& normal) const;

  /// The radiance of an area light in every band, seen along `direction` (towards it); null if this side does not emit.
  /// @param normal  Normal of the mesh at that position.
  const std::vector<float>* emitted(int light, const Eigen::Vector3d& normal, const Eigen::Vector3d& direction) const;

  /// Sets `radiance` to the background's in each of `bands`, seen along the unit `direction`.
  /// @param disks  Whether the disks of directional lights count.
  /// @param only   The index of the light that counts; −1: all do.
  void background(const Eigen::Vector3d& direction, std::vector<float>& radiance, bool disks = true, int only = -1,
                  BandRange bands = {}) const;

  /// The density, per steradian, with which `sample` chooses the background in `direction`.
  double background_pdf(const Eigen::Vector3d& direction) const;

  /// The density, per steradian, with which `sample` chooses `direction` from `point` in any way except delta lights:
  /// the background's, and those of all area lights that a straight ray without obstacles meets.
  double direction_pdf(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const;

  /// Whether directions of this sampler find light that even ones would hardly find: of area lights and of pictures.
  bool is_concentrated() const;

  const std::vector<Light>& lights() const { return lights_; }  ///< Environments here hold no pictures.
  double choice_probability(int light) const;

 private:
  /// The disk of a directional light.
  struct Disk {
    Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();  ///< Its axis points to the disk's centre.
    double height = 0;                                    ///< 1 − cos of the angle to its rim.
    double chord2 = 0;    ///< Squared chord from its centre to its rim: chords are accurate at small angles.
    double pdf = 0;       ///< Per steradian, within the disk.
    double radiance = 0;  ///< For each unit of irradiance that it gives to a surface that faces it.

    bool contains(const DirectionalLight& light, const Eigen::Vector3d& towards) const {
      return (towards + light.direction).squaredNorm() <= chord2;
    }
  };
  static Disk make_disk(const DirectionalLight& light);

  /// What `sample` needs for each light, in addition to the light.
  struct Prepared {
    std::optional<Disk> disk;
    std::optional<Distribution1D> triangles;  ///< Distribution over triangles, by area.
    std::optional<EnvironmentMap> environment;
    double power = 0;
  };

  Prepared prepare(Light& light, const std::vector<float>& importance, double scene_radius) const;
  bool sample_point(const PointLight& light, const Eigen::Vector3d& point, double probability, LightSample& sample,
                    BandRange bands) const;
  bool sample_area(int light, const Eigen::Vector3d& point, const Eigen::Vector2d& u, LightSample& sample,
                   BandRange bands) const;
  std::size_t size(BandRange bands) const {
    return static_cast<std::size_t>(bands.size(static_cast<std::ptrdiff_t>(bands_)));
  }
  double directional_pdf(int light, const Eigen::Vector3d& direction) const;
  double triangle_pdf(int light, std::size_t triangle, const Eigen::Vector3d& point,
                      const Eigen::Vector3d& direction) const;

  std::size_t bands_ = 0;
  std::vector<Light> lights_;
  std::vector<Prepared> prepared_;
  std::vector<int> area_lights_;                    ///< Their indices.
  std::shared_ptr<const TriangleScene> triangles_;  ///< Of `area_lights_`, if these have many.
  std::optional<Distribution1D> choice_;            ///< Empty if there are no lights to choose.
};

}  // namespace tensorray
