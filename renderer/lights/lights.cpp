#include "renderer/lights/lights.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/constants.h"
#include "base/errors.h"
#include "base/overloaded.h"
#include "renderer/sampling/sampling.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

void require_bands(const std::vector<float>& values, std::size_t bands, const char* name) {
  const bool valid = std::all_of(values.begin(), values.end(), [](float v) { return v >= 0 && std::isfinite(v); });
  require(values.size() == bands && valid,
          std::string(name) + " must have a finite value >= 0 for each of the " + std::to_string(bands) + " bands");
}

std::vector<float> band_importance(const std::vector<float>& luminance) {
  require_bands(luminance, luminance.size(), "the luminance");
  double sum = 0;
  for (const float value : luminance) sum += value;
  require(sum > 0, "light needs a band with a luminance above 0");
  std::vector<float> importance;
  for (const float value : luminance)
    importance.push_back(static_cast<float>(0.9 * value / sum + 0.1 / static_cast<double>(luminance.size())));
  return importance;
}

double dot(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>(a[i]) * b[i];
  return sum;
}

/// Distance along a ray to a triangle, if the ray meets it (Möller and Trumbore 1997).
std::optional<double> distance_to(const TriangleMesh& mesh, std::size_t triangle, const Vector3d& origin,
                                  const Vector3d& direction) {
  const auto [a, b, c] = mesh.triangles[triangle];
  const Vector3d ab = mesh.vertices[b] - mesh.vertices[a], ac = mesh.vertices[c] - mesh.vertices[a];
  const Vector3d across = direction.cross(ac), from = origin - mesh.vertices[a], turned = from.cross(ab);
  const double volume = ab.dot(across);
  if (volume == 0) return std::nullopt;
  const double u = from.dot(across) / volume, v = direction.dot(turned) / volume, distance = ac.dot(turned) / volume;
  if (u < 0 || v < 0 || u + v > 1 || !(distance > 0)) return std::nullopt;
  return distance;
}

Distribution1D triangles_by_area(const TriangleMesh& mesh) {
  std::vector<double> areas;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) areas.push_back(triangle_normal(mesh, i).norm() / 2);
  require(!areas.empty(), "the mesh has no triangles");
  Distribution1D result(areas);
  require(result.sum() > 0, "the mesh has no area");
  return result;
}

bool is_background(const Light& light) {
  return std::visit(Overloaded{[](const AreaLight&) { return false; }, [](const PointLight&) { return false; },
                               [](const DirectionalLight& sun) { return sun.angle > 0; },
                               [](const ConstantLight&) { return true; }, [](const EnvironmentLight&) { return true; }},
                    light);
}

/// @param values  Of all bands. @param sum  Of those from `first_band` on.
void add(double factor, const std::vector<float>& values, std::vector<float>& sum, std::ptrdiff_t first_band) {
  const float* const of_band = values.data() + first_band;
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += static_cast<float>(factor) * of_band[i];
}

void set(const std::vector<float>& values, std::vector<float>& part, std::ptrdiff_t first_band, std::size_t count) {
  const auto first = values.begin() + first_band;
  part.assign(first, first + static_cast<std::ptrdiff_t>(count));
}

/// The triangles of the area lights, if there are more than are looked at one by one in the time of a search.
std::shared_ptr<const TriangleScene> many_triangles(const std::vector<Light>& lights,
                                                    const std::vector<int>& area_lights) {
  constexpr std::size_t few = 16;
  std::vector<const TriangleMesh*> meshes;
  Eigen::AlignedBox3d bounds;
  std::size_t count = 0;
  for (const int light : area_lights) {
    meshes.push_back(emitting_mesh(lights[static_cast<std::size_t>(light)]));
    bounds.extend(meshes.back()->bounds());
    count += meshes.back()->triangles.size();
  }
  if (count <= few) return nullptr;
  return std::make_shared<const TriangleScene>(meshes, bounds.center(), bounds.diagonal().norm());
}

}  // namespace

const TriangleMesh* emitting_mesh(const Light& light) {
  using Mesh = const TriangleMesh*;
  return std::visit(
      Overloaded{[](const AreaLight& area) -> Mesh { return &area.mesh; }, [](const PointLight&) -> Mesh { return {}; },
                 [](const DirectionalLight&) -> Mesh { return {}; }, [](const ConstantLight&) -> Mesh { return {}; },
                 [](const EnvironmentLight&) -> Mesh { return {}; }},
      light);
}

const std::vector<float>* thrown_light(const Light& light) {
  using Strength = const std::vector<float>*;
  return std::visit(Overloaded{[](const AreaLight& area) -> Strength { return &area.radiance; },
                               [](const PointLight& point) -> Strength { return &point.intensity; },
                               [](const DirectionalLight& sun) -> Strength { return &sun.irradiance; },
                               [](const ConstantLight&) -> Strength { return {}; },
                               [](const EnvironmentLight&) -> Strength { return {}; }},
                    light);
}

std::optional<Vector3d> direction_at(const Light& light, const Vector3d& point) {
  using Direction = std::optional<Vector3d>;
  return std::visit(
      Overloaded{[&](const PointLight& source) -> Direction { return Vector3d(point - source.position); },
                 [](const DirectionalLight& sun) -> Direction { return sun.direction; },
                 [](const AreaLight&) -> Direction { return {}; }, [](const ConstantLight&) -> Direction { return {}; },
                 [](const EnvironmentLight&) -> Direction { return {}; }},
      light);
}

TriangleMesh rectangle_mesh(const Vector3d& center, const Vector3d& right, const Vector3d& up, const Vector2d& size) {
  const Vector3d x = size.x() / 2 * right, y = size.y() / 2 * up;
  return {{center - x - y, center + x - y, center + x + y, center - x + y}, {{0, 1, 2}, {0, 2, 3}}};
}

Vector3d triangle_normal(const TriangleMesh& mesh, std::size_t triangle) {
  const auto [a, b, c] = mesh.triangles[triangle];
  return (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
}

LightSampler::LightSampler(std::vector<Light> lights, const std::vector<float>& luminance,
                           const Eigen::AlignedBox3d& scene)
    : bands_(luminance.size()), lights_(std::move(lights)) {
  const std::vector<float> importance = band_importance(luminance);
  const double radius = scene.isEmpty() ? 0 : scene.diagonal().norm() / 2;
  std::vector<double> powers;
  for (std::size_t i = 0; i < lights_.size(); ++i) {
    try {
      prepared_.push_back(prepare(lights_[i], importance, radius > 0 ? radius : 1));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("light " + std::to_string(i) + ": " + error.what());
    }
    powers.push_back(prepared_.back().power);
    if (emitting_mesh(lights_[i])) area_lights_.push_back(static_cast<int>(i));
  }
  triangles_ = many_triangles(lights_, area_lights_);
  if (std::any_of(powers.begin(), powers.end(), [](double power) { return power > 0; })) choice_.emplace(powers);
}

LightSampler::Disk LightSampler::make_disk(const DirectionalLight& light) {
  const double angle = light.angle;
  Disk disk;
  disk.frame = frame_about(-light.direction);
  disk.height = one_minus_cosine(angle);
  disk.chord2 = 2 * disk.height;
  disk.pdf = 1 / cone_solid_angle(angle);
  disk.radiance = 1 / (pi * std::pow(std::sin(angle), 2));  // ∫ cos θ dω = π sin² angle.
  return disk;
}

/// The power of a light that is infinitely far away is the power that passes through the bounding sphere of the scene.
/// Constant light has none here, so that it is not chosen.
LightSampler::Prepared LightSampler::prepare(Light& light, const std::vector<float>& importance,
                                             double scene_radius) const {
  const double ball = pi * scene_radius * scene_radius;
  Prepared result;
  const auto prepare_area = [&](const AreaLight& area) {
    require_bands(area.radiance, bands_, "radiance");
    result.triangles = triangles_by_area(area.mesh);
    result.power = pi * result.triangles->sum() * dot(area.radiance, importance);
  };
  const auto prepare_directional = [&](DirectionalLight& sun) {
    require_bands(sun.irradiance, bands_, "irradiance");
    require(sun.direction.allFinite() && sun.direction.stableNorm() > 0, "direction must be finite and not zero");
    require(sun.angle >= 0 && sun.angle <= pi / 2, "angle must be 0 to pi / 2");
    sun.direction.stableNormalize();
    result.power = ball * dot(sun.irradiance, importance);
    if (sun.angle > 0) result.disk = make_disk(sun);
  };
  const auto prepare_point = [&](const PointLight& point) {
    require_bands(point.intensity, bands_, "intensity");
    require(point.position.allFinite(), "position must be finite");
    result.power = 4 * pi * dot(point.intensity, importance);
  };
  const auto prepare_environment = [&](EnvironmentLight& environment) {
    result.environment.emplace(std::move(environment), importance);
    result.power = ball * result.environment->importance();
  };
  std::visit(Overloaded{prepare_area, prepare_directional, prepare_point, prepare_environment,
                        [&](const ConstantLight& constant) { require_bands(constant.radiance, bands_, "radiance"); }},
             light);
  return result;
}

double LightSampler::choice_probability(int light) const { return choice_ ? choice_->probability(light) : 0; }

/// The number that chooses a light, or a triangle, also gives the place on it: places stay stratified.
bool LightSampler::sample(const Vector3d& point, const Vector2d& u, LightSample& sample, BandRange bands) const {
  if (!choice_) return false;
  const Distribution1D::Sample chosen = choice_->sample(u.x());
  const Vector2d place(chosen.within, u.y());
  const Prepared& prepared = prepared_[chosen.cell];
  sample.is_delta = false;
  sample.light = -1;
  sample.distance = std::numeric_limits<double>::infinity();
  const auto sample_background = [&](const Vector3d& direction) {
    sample.direction = direction;
    sample.pdf = background_pdf(sample.direction);
    background(sample.direction, sample.radiance, true, -1, bands);
    return sample.pdf > 0;
  };
  const auto sample_directional = [&](const DirectionalLight& sun) {
    if (sun.angle > 0) return sample_background(prepared.disk->frame * square_to_cap(place, prepared.disk->height));
    sample.is_delta = true;
    sample.light = chosen.cell;
    sample.direction = -sun.direction;
    set(sun.irradiance, sample.radiance, bands.first, size(bands));
    sample.pdf = chosen.probability;
    return true;
  };
  const auto sample_lamp = [&](const PointLight& lamp) {
    sample.is_delta = true;
    sample.light = chosen.cell;
    return sample_point(lamp, point, chosen.probability, sample, bands);
  };
  return std::visit(
      Overloaded{sample_directional, sample_lamp,
                 [&](const AreaLight&) { return sample_area(chosen.cell, point, place, sample, bands); },
                 [&](const EnvironmentLight&) { return sample_background(prepared.environment->sample(place)); },
                 [](const ConstantLight&) { return false; }},  // It is never chosen.
      lights_[chosen.cell]);
}

bool LightSampler::sample_point(const PointLight& light, const Vector3d& point, double probability, LightSample& sample,
                                BandRange bands) const {
  const Vector3d way = light.position - point;
  sample.distance = way.norm();
  if (!(sample.distance > 0)) return false;
  sample.direction = way / sample.distance;
  sample.radiance.assign(size(bands), 0);
  add(1 / way.squaredNorm(), light.intensity, sample.radiance, bands.first);
  sample.pdf = probability;
  return true;
}

bool LightSampler::sample_area(int light, const Vector3d& point, const Vector2d& u, LightSample& sample,
                               BandRange bands) const {
  const auto& area = std::get<AreaLight>(lights_[light]);
  const Distribution1D::Sample triangle = prepared_[light].triangles->sample(u.x());
  const auto [a, b, c] = area.mesh.triangles[triangle.cell];
  const Vector3d weights = square_to_triangle({triangle.within, u.y()});
  const Vector3d position =
      weights.x() * area.mesh.vertices[a] + weights.y() * area.mesh.vertices[b] + weights.z() * area.mesh.vertices[c];
  sample.distance = (position - point).norm();
  sample.direction = (position - point) / sample.distance;
  set(area.radiance, sample.radiance, bands.first, size(bands));
  sample.is_delta = false;
  sample.light = light;
  sample.pdf = area_pdf(light, point, position, triangle_normal(area.mesh, triangle.cell).normalized());
  return sample.pdf > 0;
}

double LightSampler::area_pdf(int light, const Vector3d& point, const Vector3d& position,
                              const Vector3d& normal) const {
  const Vector3d way = point - position;
  const double distance = way.norm(), cosine = normal.dot(way) / distance;
  if (!(cosine > 0)) return 0;  // This side does not emit.
  const double area = prepared_[light].triangles->sum();
  return choice_probability(light) * distance * distance / (cosine * area);
}

const std::vector<float>* LightSampler::emitted(int light, const Vector3d& normal, const Vector3d& direction) const {
  const auto& area = std::get<AreaLight>(lights_[light]);
  return normal.dot(direction) < 0 ? &area.radiance : nullptr;
}

void LightSampler::background(const Vector3d& direction, std::vector<float>& radiance, bool disks, int only,
                              BandRange bands) const {
  radiance.assign(size(bands), 0);
  for (std::size_t i = 0; i < lights_.size(); ++i) {
    if (!is_background(lights_[i]) || (only >= 0 && static_cast<std::size_t>(only) != i)) continue;
    const auto add_disk = [&](const DirectionalLight& sun) {
      const Disk& disk = *prepared_[i].disk;
      if (disks && disk.contains(sun, direction)) add(disk.radiance, sun.irradiance, radiance, bands.first);
    };
    std::visit(
        Overloaded{
            add_disk, [&](const ConstantLight& constant) { add(1, constant.radiance, radiance, bands.first); },
            [&](const EnvironmentLight&) { prepared_[i].environment->add_radiance(direction, radiance, bands.first); },
            [](const AreaLight&) {}, [](const PointLight&) {}},
        lights_[i]);
  }
}

double LightSampler::background_pdf(const Vector3d& direction) const {
  double sum = 0;
  for (int i = 0; i < static_cast<int>(lights_.size()); ++i)
    if (const double chosen = choice_probability(i); chosen > 0 && is_background(lights_[i]))
      sum += chosen * directional_pdf(i, direction);
  return sum;
}

double LightSampler::direction_pdf(const Vector3d& point, const Vector3d& direction) const {
  double sum = background_pdf(direction);
  if (triangles_) {
    thread_local std::vector<TriangleId> candidates;
    triangles_->along(point, direction, candidates);
    for (const TriangleId& each : candidates)
      sum += triangle_pdf(area_lights_[each.mesh], each.triangle, point, direction);
    return sum;
  }
  for (const int light : area_lights_)
    for (std::size_t i = 0; i < emitting_mesh(lights_[light])->triangles.size(); ++i)
      sum += triangle_pdf(light, i, point, direction);
  return sum;
}

/// The density of `direction` by a triangle of an area light; 0 if a straight ray does not meet it.
double LightSampler::triangle_pdf(int light, std::size_t triangle, const Vector3d& point,
                                  const Vector3d& direction) const {
  const TriangleMesh& mesh = *emitting_mesh(lights_[light]);
  const auto distance = distance_to(mesh, triangle, point, direction);
  if (!distance) return 0;
  return area_pdf(light, point, point + *distance * direction, triangle_normal(mesh, triangle).normalized());
}

bool LightSampler::is_concentrated() const {
  return std::any_of(lights_.begin(), lights_.end(), [](const Light& light) {
    return std::visit(Overloaded{[](const AreaLight&) { return true; }, [](const EnvironmentLight&) { return true; },
                                 [](const PointLight&) { return false; }, [](const DirectionalLight&) { return false; },
                                 [](const ConstantLight&) { return false; }},
                      light);
  });
}

/// The density with which a background light, once chosen, chooses a direction.
double LightSampler::directional_pdf(int light, const Vector3d& direction) const {
  const auto of_disk = [&](const DirectionalLight& sun) {
    const Disk& disk = *prepared_[light].disk;
    return disk.contains(sun, direction) ? disk.pdf : 0;
  };
  return std::visit(
      Overloaded{of_disk, [&](const EnvironmentLight&) { return prepared_[light].environment->pdf(direction); },
                 [](const ConstantLight&) { return 0.0; }, [](const AreaLight&) { return 0.0; },
                 [](const PointLight&) { return 0.0; }},
      lights_[light]);
}

}  // namespace tensorray
