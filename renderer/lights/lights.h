#pragma once
/// @file renderer/lights/lights.h
/// What lights a scene, and how to choose the directions in which to look for light. Radiance is given for each of the
/// bands that are rendered, relative to the light that the bands are made from: see Band.

#include <optional>
#include <variant>
#include <vector>

#include <Eigen/Geometry>

#include "base/triangle_mesh.h"
#include "renderer/textures/environment_map.h"

namespace tensorray {

/// A surface that shines evenly, in all directions alike.
struct AreaLight {
  TriangleMesh mesh;            ///< World; shines from the side on which its triangles are counter-clockwise.
  std::vector<float> radiance;  ///< Of every band.
};

/// Parallel light, or that of a disk in the sky such as the sun.
struct DirectionalLight {
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< In which the light travels; any length.
  std::vector<float> irradiance;                          ///< Of a surface that faces it, in every band.
  double angle = 0;  ///< Of the disk, from its middle to its rim, radians (the sun: 0.00465); 0 to π/2, 0: parallel.
};

/// The same light from all directions.
struct ConstantLight {
  std::vector<float> radiance;  ///< Of every band.
};

using Light = std::variant<AreaLight, DirectionalLight, ConstantLight, EnvironmentLight>;

/// A rectangle of two triangles that looks along right × up. @param right, up  Unit, normal to each other.
TriangleMesh rectangle_mesh(const Eigen::Vector3d& center, const Eigen::Vector3d& right, const Eigen::Vector3d& up,
                            const Eigen::Vector2d& size);

/// Light that reaches a point from a direction. Use one again and again: it then takes no memory anew.
struct LightSample {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Unit, from the point to the light.
  double distance = 0;          ///< To the light: what is nearer shadows it. Infinite for the background.
  std::vector<float> radiance;  ///< Of every band; of a delta, irradiance on a surface across `direction`.
  double pdf = 0;               ///< Per steradian, with the choice of the light in it; of a delta, that choice alone.
  bool is_delta = false;        ///< No other way of choosing directions can find this light.
};

/// Chooses lights by their power, and directions by the light. Immutable: any thread may use it.
///
/// All that is infinitely far away and not a delta is the background: one light for the caller, whose radiance is the
/// sum, and whose density is that of choosing any of them. Together with a way of its own to choose directions the
/// caller weighs (multiple importance sampling) `sample` against `area_pdf` where its ray meets an area light, and
/// against `background_pdf` where it meets nothing.
class LightSampler {
 public:
  /// @param lights      Referred to by their index.
  /// @param luminance   Of each band at radiance 1, such as the Y of Band::xyz: >= 0, one above 0. A tenth of the
  ///                    choices is made by all bands alike, so that what the eye hardly sees is sampled as well.
  /// @param scene       What is lit; it sets the power of the background against that of area lights.
  /// @throw std::invalid_argument naming the light by its index: not a finite value >= 0 for each band, no area, a
  /// direction that is zero or not finite, an angle out of range; else as EnvironmentMap.
  LightSampler(std::vector<Light> lights, const std::vector<float>& luminance, const Eigen::AlignedBox3d& scene);

  /// Light that reaches `point`, if nothing stands in its way. The expectation of radiance · f(direction) / pdf is the
  /// integral of f over all light.
  /// @param choice, u  Evenly spread in [0, 1).
  /// @return false if there is none in the direction that was chosen: count it as 0.
  bool sample(const Eigen::Vector3d& point, double choice, const Eigen::Vector2d& u, LightSample& sample) const;

  /// The density with which `sample` finds `position` on an area light from `point`, per steradian.
  /// @param normal  Unit, of the mesh there. Zero where that side does not shine.
  double area_pdf(int light, const Eigen::Vector3d& point, const Eigen::Vector3d& position,
                  const Eigen::Vector3d& normal) const;

  /// The radiance of an area light in every band, as seen along `direction` (towards it); nothing: that side is dark.
  /// @param normal  Of the mesh there.
  const std::vector<float>* emitted(int light, const Eigen::Vector3d& normal, const Eigen::Vector3d& direction) const;

  /// Sets `radiance` to that of the background in every band, as seen along the unit `direction`.
  void background(const Eigen::Vector3d& direction, std::vector<float>& radiance) const;

  /// The density with which `sample` looks at the background in `direction`, per steradian.
  double background_pdf(const Eigen::Vector3d& direction) const;

  const std::vector<Light>& lights() const { return lights_; }  ///< Without the pictures of environments.
  double choice_probability(int light) const;

 private:
  /// What `sample` needs to know of a light, beside it.
  struct Prepared {
    std::optional<Distribution1D> triangles;  ///< By area.
    std::optional<EnvironmentMap> environment;
    double power = 0;
  };

  Prepared prepare(Light& light, const std::vector<float>& importance, double scene_radius) const;
  bool sample_area(int light, const Eigen::Vector3d& point, double choice, const Eigen::Vector2d& u,
                   LightSample& sample) const;
  double directional_pdf(int light, const Eigen::Vector3d& direction) const;

  std::size_t bands_ = 0;
  std::vector<Light> lights_;
  std::vector<Prepared> prepared_;
  std::optional<Distribution1D> choice_;  ///< None without lights.
};

}  // namespace tensorray
