#include "tools/viewer/answers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "base/text/text.h"
#include "scenes/outputs/picture_outputs.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int cells = 40;                     // Along a side of the lattice of LandedRays.
constexpr int shown_rays = 7;                 // Along a side of the beam, for each colour.
constexpr std::size_t max_points = 40;        // Of a drawn ray.
constexpr std::size_t max_ways = 4;           // To one pixel, for each colour.
constexpr std::size_t max_triangles = 60000;  // Of all meshes: a page is no place for more.

Json to_json(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

std::string hex(const Vector3d& color) {
  const auto byte = [](double value) { return static_cast<int>(std::lround(255 * std::clamp(value, 0.0, 1.0))); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(color[0]), byte(color[1]), byte(color[2]));
}

/// Three channels of a scene: the first, a middle and the last.
std::vector<std::size_t> shown_channels(const Scene& scene) {
  const std::size_t last = scene.channels.size() - 1;
  std::vector<std::size_t> channels{0, last / 2, last};
  channels.erase(std::unique(channels.begin(), channels.end()), channels.end());
  return channels;
}

/// The colour of a channel, as bright as a display can show it.
std::string color_of(const Scene& scene, std::size_t channel) {
  Vector3d color = (scene.color.xyz_to_working() * scene.bands[channel].xyz).cwiseMax(0.0);
  color = (color / std::max(color.maxCoeff(), 1e-12)).array().pow(1 / 2.2);
  return hex(0.85 * color + Vector3d::Constant(0.15));  // Also dark violet must be seen.
}

/// Every few points of a ray that has some, and its last one.
Json polyline(const TensorField& field, const RayRecord& ray) {
  Json points = Json::array();
  const std::size_t step = (ray.size() + max_points - 1) / max_points, last = ray.size() - 1;
  for (std::size_t i = 0; i < last; i += step) points.push_back(to_json(path_point(field, ray, i).position));
  points.push_back(to_json(path_point(field, ray, last).position));
  return points;
}

/// The paths of light from `starts`, as `rays`.
void add_rays(const Scene& scene, std::size_t channel, double flexibility, const std::vector<Vector3d>& starts,
              Json& rays) {
  RayBatch batch;
  for (const Vector3d& start : starts) batch.add(start, scene.beam.direction, flexibility);
  std::vector<RayRecord> records;
  trace(scene.field, scene.geometry, scene.bending, batch, &records);
  for (const RayRecord& ray : records)
    if (ray.size() > 0) rays.push_back({{"points", polyline(scene.field, ray)}, {"color", color_of(scene, channel)}});
}

/// Positions of a lattice over the beam's aperture, its outline included, row by row.
std::vector<Vector3d> lattice(const Beam& beam, int along_side) {
  Eigen::AlignedBox2d box;
  for (const Vector2d& corner : beam.aperture) box.extend(corner);
  const Vector2d size = 0.998 * box.sizes(), first = box.center() - size / 2;  // Light beside the volume is straight.
  std::vector<Vector3d> positions;
  for (int y = 0; y < along_side; ++y)
    for (int x = 0; x < along_side; ++x) {
      const Vector2d across = first + size.cwiseProduct(Vector2d(x, y) / std::max(along_side - 1, 1));
      positions.push_back(beam.center + across.x() * beam.right + across.y() * beam.up);
    }
  return positions;
}

/// All lists of numbers but indices, as positions or directions, in the axes of the scene's file.
Json in_axes_of(const Scene& scene, Json json, const std::string& key = "") {
  if (scene.description.world.up == UpAxis::z || key == "triangles" || !json.is_structured()) return json;
  const Eigen::Matrix3d back = scene.description.turn().transpose();
  const bool is_list = json.is_array() && !json.empty() && json[0].is_number();
  for (std::size_t i = 0; is_list && i + 2 < json.size(); i += 3) {
    const Vector3d vector = back * Vector3d(json[i], json[i + 1], json[i + 2]);
    for (std::size_t axis = 0; axis < 3; ++axis) json[i + axis] = vector[static_cast<int>(axis)];
  }
  for (auto& [name, value] : json.items())
    if (!is_list) value = in_axes_of(scene, std::move(value), name);
  return json;
}

Json describe_mesh(const TriangleMesh& mesh, const std::string& name) {
  Json positions = Json::array(), triangles = Json::array();
  for (const Vector3d& vertex : mesh.vertices)
    for (int i = 0; i < 3; ++i) positions.push_back(static_cast<float>(vertex[i]));
  for (const auto& triangle : mesh.triangles)
    for (int i = 0; i < 3; ++i) triangles.push_back(triangle[i]);
  return {{"name", name}, {"positions", std::move(positions)}, {"triangles", std::move(triangles)}};
}

Json describe_meshes(const Scene& scene) {
  Json meshes = Json::array();
  std::size_t left = max_triangles;
  const auto add = [&](const TriangleMesh& mesh, const std::string& name) {
    if (mesh.triangles.size() > left) return;
    left -= mesh.triangles.size();
    meshes.push_back(describe_mesh(mesh, name));
  };
  const Surfaces& surfaces = scene.geometry.surfaces();
  if (surfaces.cut) add(*surfaces.cut, "bounds");
  for (std::size_t i = 0; i < surfaces.obstacles.size(); ++i) add(surfaces.obstacles[i], fmt::format("obstacle {}", i));
  return meshes;
}

Json describe_beam(const Scene& scene) {
  const Eigen::AlignedBox3d box = scene.field.world_box();
  const Vector3d start = box.center() - 0.75 * box.diagonal().norm() * scene.beam.direction;
  double radius = 0;
  for (const Vector2d& corner : scene.beam.aperture) radius = std::max(radius, corner.norm());
  return {
      {"origin", to_json(start)}, {"direction", to_json(scene.beam.direction)}, {"radius", radius / std::sqrt(2.0)}};
}

Json describe_camera(const Scene& scene) {
  const CameraDescription& camera = scene.description.camera;
  if (!camera.position) return nullptr;
  return {{"eye", to_json(*camera.position)},
          {"target", to_json(camera.target.value_or(scene.field.world_box().center()))},
          {"up", to_json(camera.up.value_or(Vector3d::UnitZ()))},
          {"fov", camera.angle}};
}

/// Coordinates of `point` in a triangle; none if it is outside.
std::optional<Vector3d> barycentric(const std::array<Vector2d, 3>& corners, const Vector2d& point) {
  const Vector2d a = corners[1] - corners[0], b = corners[2] - corners[0], p = point - corners[0];
  const double area = a.x() * b.y() - a.y() * b.x();
  if (!(std::abs(area) > 1e-12)) return std::nullopt;  // Also where a corner is NaN.
  const double u = (p.x() * b.y() - p.y() * b.x()) / area, v = (a.x() * p.y() - a.y() * p.x()) / area;
  if (u < 0 || v < 0 || u + v > 1) return std::nullopt;
  return Vector3d(1 - u - v, u, v);
}

const float* pixel_at(const Image& image, const Vector2d& place) {
  const auto index = [](double part, int size) {
    return std::min(static_cast<int>(std::clamp(part, 0.0, 1.0) * size), size - 1);
  };
  return image.pixel(index(place.x(), image.width), index(place.y(), image.height));
}

/// The values of all bands.
const float* bands_at(const SpectralImage& spectral, const Vector2d& place) {
  return pixel_at(spectral.image, place) + (spectral.image.channels.size() - spectral.bands.size());
}

Json spectrum_at(const Render& render, const Vector2d& place) {
  if (!render.spectral) return nullptr;
  const float* const bands = bands_at(*render.spectral, place);
  Json wavelengths = Json::array(), values = Json::array();
  for (std::size_t i = 0; i < render.spectral->bands.size(); ++i) {
    wavelengths.push_back(render.spectral->bands[i].wavelength);
    values.push_back(bands[i]);
  }
  return {{"nm", std::move(wavelengths)}, {"values", std::move(values)}};
}

}  // namespace

Json describe_field(const Scene& scene) {
  const Eigen::AlignedBox3d& voxels = scene.field.voxels();
  const Eigen::Vector3i size = (voxels.sizes() + Vector3d::Ones()).array().round().matrix().cast<int>();
  Json corners = Json::array();
  for (const Vector3d& corner : scene.field.corners()) corners.push_back(to_json(corner));
  return {{"voxels", {size.x(), size.y(), size.z()}},
          {"corners", in_axes_of(scene, std::move(corners))},
          {"y_up", scene.description.world.up == UpAxis::y}};
}

Json describe_choices(const Scene& scene, const Render& render) {
  const Plate& plate = *scene.geometry.surfaces().plate;
  const double far = depth_range(scene.field, Vector3d::Zero(), scene.beam.direction).far;
  Json receiver = {{"normal", in_axes_of(scene, to_json(plate.normal()))}, {"size", {plate.size.x(), plate.size.y()}}};
  if (!scene.description.receiver.center) receiver["distance"] = plate.center.dot(scene.beam.direction) - far;
  const Strength strength = scene.method->strength(scene);
  return {{strength.section, {{strength.key, strength.value}}},
          {"light", {{"direction", in_axes_of(scene, to_json(scene.beam.direction))}}},
          {"receiver", std::move(receiver)},
          {"output",
           {{"exposure", display_exposure(scene, render)},
            {"display", scene.color.display()},
            {"view", scene.color.view()}}}};
}

Json describe_examples(const Scene& scene) {
  return {{"output", {{"display", scene.color.displays()}, {"view", scene.color.views()}}}};
}

Json describe_space(const Scene& scene, bool with_meshes) {
  Json rays = Json::array();
  const std::vector<Vector3d> starts = lattice(scene.beam, shown_rays);
  for (const std::size_t channel : shown_channels(scene))
    add_rays(scene, channel, scene.channels[channel].flexibility, starts, rays);
  Json plate = Json::array();
  for (const Vector3d& corner : scene.geometry.surfaces().plate->corners()) plate.push_back(to_json(corner));
  return in_axes_of(scene, {{"plate", std::move(plate)},
                            {"beam", describe_beam(scene)},
                            {"rays", std::move(rays)},
                            {"meshes", with_meshes ? describe_meshes(scene) : Json()},
                            {"camera", describe_camera(scene)}});
}

LandedRays::LandedRays(const Scene& scene) : starts_(lattice(scene.beam, cells + 1)) {
  const Plate& plate = *scene.geometry.surfaces().plate;
  const Vector2d pixels = plate.resolution.cast<double>();
  for (const std::size_t channel : shown_channels(scene)) {
    Colour colour{scene.channels[channel].flexibility, {}};
    RayBatch batch;
    for (const Vector3d& start : starts_) batch.add(start, scene.beam.direction, colour.flexibility);
    trace(scene.field, scene.geometry, scene.bending, batch);
    for (std::size_t i = 0; i < batch.size(); ++i)
      colour.landings.push_back(batch.end[i] == RayEnd::plate
                                    ? Vector2d(plate.to_pixel(batch.position[i]).cwiseQuotient(pixels))
                                    : Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
    colours_.push_back(std::move(colour));
  }
}

Json LandedRays::to(const Scene& scene, const Vector2d& place) const {
  Json rays = Json::array();
  const std::vector<std::size_t> channels = shown_channels(scene);
  for (std::size_t c = 0; c < colours_.size(); ++c) {
    const std::vector<Vector2d>& landings = colours_[c].landings;
    std::vector<Vector3d> starts;
    const auto try_triangle = [&](int i, int j, int k) {
      const auto part = barycentric({landings[i], landings[j], landings[k]}, place);
      if (part && starts.size() < max_ways)
        starts.push_back((*part)[0] * starts_[i] + (*part)[1] * starts_[j] + (*part)[2] * starts_[k]);
    };
    for (int y = 0; y < cells; ++y)
      for (int x = 0; x < cells; ++x) {
        const int i = y * (cells + 1) + x, above = i + cells + 1;
        try_triangle(i, i + 1, above + 1);
        try_triangle(i, above + 1, above);
      }
    add_rays(scene, channels[c], colours_[c].flexibility, starts, rays);
  }
  return in_axes_of(scene, std::move(rays));
}

Json describe_pixel(const Render& render, const Image& display, const Vector2d& place) {
  Json lines = Json::array();
  const Image& linear = render.linear;
  const float* const pixel = pixel_at(linear, place);
  lines.push_back({"R, G, B", fmt::format("{:.3g}, {:.3g}, {:.3g}", pixel[0], pixel[1], pixel[2])});
  if (render.describe_pixel)
    for (const auto& [name, value] : render.describe_pixel(pixel)) lines.push_back({name, value});
  if (render.spectral) {
    const SpectralImage& spectral = *render.spectral;
    const float* const bands = bands_at(spectral, place);
    double sum = 0;
    for (std::size_t i = 0; i < spectral.bands.size(); ++i) sum += bands[i] * spectral.bands[i].width;
    const bool is_radiance = spectral.quantity == SpectralQuantity::radiance;
    lines.push_back({is_radiance ? "radiance" : "irradiance", fmt::format("{:.4g}", sum)});
  }
  // What one looks for first is seen without scrolling.
  const auto rank = [](const std::string& channel) {
    return channel == "folds" ? 0 : starts_with(channel, "displacement") ? 2 : 1;
  };
  for (const int wanted : {0, 1, 2})
    for (std::size_t i = 3; i < linear.channels.size(); ++i)
      if (rank(linear.channels[i]) == wanted) lines.push_back({linear.channels[i], fmt::format("{:.4g}", pixel[i])});
  const float* const shown =
      pixel_at(display, {place.x() * linear.width / display.width, place.y() * linear.height / display.height});
  return {{"lines", std::move(lines)},
          {"color", hex(Vector3d(shown[0], shown[1], shown[2]))},
          {"spectrum", spectrum_at(render, place)}};
}

}  // namespace tensorray
