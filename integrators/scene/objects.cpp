#include <algorithm>

#include "integrators/path_tracing/path_colors.h"
#include "integrators/path_tracing/stage.h"
#include "integrators/scene/field_light.h"
#include "renderer/lights/lights.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr double dark_square = 0.12;  // Reflectance of a dark square, by that of a bright one.
constexpr double floor_below = 0.35;  // Distance of the default floor from the volume, in heights of the volume.
constexpr double floor_size = 5;      // Its size, in the greatest horizontal extent of the volume.
constexpr int floor_squares = 20;
constexpr int roughness_steps = 33;  // Materials of a mesh that has a picture of roughness.

ObjectDescription default_floor(const TensorField& field) {
  const Eigen::AlignedBox3d box = field.world_box();
  PlateDescription plate;
  plate.center = box.center();
  plate.center.z() = box.min().z() - floor_below * std::max(box.sizes().z(), 0.2 * box.sizes().maxCoeff());
  plate.size.setConstant(floor_size * box.sizes().head<2>().maxCoeff());
  ObjectDescription floor;
  floor.plate = plate;
  floor.texture = Pattern::checkerboard;
  floor.squares = floor_squares;
  floor.material.kind = MaterialKind::diffuse;
  floor.material.color.setConstant(0.8);
  return floor;
}

SurfaceTexture checkerboard(Plate plate, int squares, const Eigen::Vector3f& bright) {
  SurfaceTexture texture;
  plate.resolution = (squares * plate.size / plate.size.minCoeff()).array().round().max(1).matrix().cast<int>();
  texture.plate = plate;
  texture.smooth = false;
  for (int y = 0; y < plate.resolution.y(); ++y)
    for (int x = 0; x < plate.resolution.x(); ++x)
      texture.colors.push_back((x + y) % 2 == 0 ? bright : Eigen::Vector3f(static_cast<float>(dark_square) * bright));
  return texture;
}

SurfaceTexture picture(Plate plate, const PictureFile& file, const ColorManagement& color,
                       const Eigen::Matrix3d& rec709_to_working, std::vector<std::string>& notes) {
  const Image image = load_rec709(file, color, rec709_to_working.inverse(), notes);
  SurfaceTexture texture;
  plate.resolution = {image.width, image.height};
  texture.plate = plate;
  for (std::size_t i = 0; i < image.pixels.size(); i += 3)
    texture.colors.push_back((rec709_to_working.cast<float>() * Eigen::Map<const Eigen::Vector3f>(&image.pixels[i]))
                                 .cwiseMax(0)
                                 .cwiseMin(1));
  return texture;
}

/// The values of a picture as they are: they are no colours. Nothing if there is no file.
MeshPictures::Picture values_of(const std::filesystem::path& file, std::vector<std::string>& notes) {
  if (file.empty()) return {};
  const NativeImage image = read_native_image(file);
  add_notes(file, image, notes);
  MeshPictures::Picture values{image.width, image.height, {}};
  std::vector<float> rgba(4 * static_cast<std::size_t>(image.width));
  for (int y = 0; y < image.height; ++y) {
    read_pixels(image, 0, y, image.width, rgba.data());
    for (std::size_t x = 0; x < rgba.size(); x += 4) values.pixels.emplace_back(rgba[x], rgba[x + 1], rgba[x + 2]);
  }
  return values;
}

/// @throw std::runtime_error if the file of the mesh has no places for its pictures.
void load_pictures(const ObjectDescription& description, const ColorManagement& color, const ShownLight& light,
                   std::vector<std::string>& notes, ShadedSurface& surface) {
  MeshPictures pictures{
      {}, values_of(description.roughness_texture, notes), values_of(description.normal_texture, notes)};
  if (const auto* file = std::get_if<std::filesystem::path>(&description.texture)) {
    SurfaceTexture colors = picture({}, {*file, description.texture_layer}, color, light.rec709_to_working, notes);
    pictures.color = {colors.plate.resolution.x(), colors.plate.resolution.y(), std::move(colors.colors)};
  }
  if (pictures.roughness.width > 0) pictures.roughness_steps = roughness_steps;
  if (pictures.color.width + pictures.roughness.width + pictures.normal.width == 0) return;
  if (surface.places.empty())
    throw std::runtime_error(description.file.string() +
                             ": has no texture coordinates (u, v), which pictures need; "
                             "unwrap it, and write it as .ply, .obj, .gltf, .glb, .dae or .fbx");
  for (const Eigen::Vector2f& place : surface.places)
    if (!place.allFinite())
      throw std::runtime_error(description.file.string() + ": a texture coordinate is not there; unwrap it again");
  surface.pictures = std::make_shared<MeshPictures>(std::move(pictures));
}

Plate make_plate(const PlateDescription& description) {
  Plate plate;
  const Vector3d normal = description.normal.normalized();
  plate.center = description.center;
  plate.up = upright(normal, description.up.value_or(Vector3d::UnitZ()));
  plate.right = plate.up.cross(normal);
  plate.size = description.size;
  return plate;
}

/// Paths with all that `integrator` says of them, but for their number.
PathScene load_path_object(const PathsDescription& description, const Scene& scene, PathTracingDescription tracing,
                           std::vector<std::string>& notes) {
  if (description.count) tracing.seeds.count = *description.count;
  return load_paths(scene, tracing, notes);
}

SceneObject load_object(const ObjectDescription& description, const Scene& scene, const PathTracingDescription& tracing,
                        const ShownLight& light, std::vector<std::string>& notes) {
  SceneObject object;
  object.material = description.material;
  if (description.paths) {
    object.paths = load_path_object(*description.paths, scene, tracing, notes);
    return object;
  }
  if (!description.plate) {
    object.surface = read_mesh_surface(scene.description, description.file, description.smooth_angle);
    load_pictures(description, scene.color, light, notes, object.surface);
    return object;
  }
  const Plate plate = make_plate(*description.plate);
  object.plate = plate;
  object.surface.shape = rectangle_mesh(plate.center, plate.right, plate.up, plate.size);
  const Eigen::Vector3f bright =
      (light.rec709_to_working * description.material.color).cwiseMax(0).cwiseMin(1).cast<float>();
  if (const auto* file = std::get_if<std::filesystem::path>(&description.texture))
    object.surface.texture = std::make_shared<SurfaceTexture>(
        picture(plate, {*file, description.texture_layer}, scene.color, light.rec709_to_working, notes));
  else if (std::get<Pattern>(description.texture) == Pattern::checkerboard)
    object.surface.texture = std::make_shared<SurfaceTexture>(checkerboard(plate, description.squares, bright));
  return object;
}

}  // namespace

std::vector<SceneObject> load_objects(const Scene& scene, const PathTracingDescription& tracing,
                                      const ShownLights& lights, std::vector<std::string>& notes) {
  std::vector<ObjectDescription> descriptions = scene.description.objects;
  if (scene.description.default_objects) descriptions.push_back(default_floor(scene.field));
  std::vector<SceneObject> objects;
  for (const ObjectDescription& each : descriptions)
    objects.push_back(load_object(each, scene, tracing, lights.light, notes));
  for (const std::filesystem::path& file : scene.description.obstacles) {
    SceneObject obstacle;
    obstacle.surface = read_mesh_surface(scene.description, file);
    objects.push_back(std::move(obstacle));
  }
  return objects;
}

void make_tubes(const Scene& scene, double tolerance, Job* job, const Progress& progress,
                std::vector<SceneObject>& objects) {
  for (SceneObject& object : objects) {
    if (!object.paths) continue;
    Statistics ends;
    const PathTracingDescription& tracing = object.paths->settings;
    const std::vector<Path> paths = follow_paths(scene, *object.paths, true, job, progress, ends);
    const double radius = typical_radius(tracing.radius, paths.size(), scene.field.world_box());
    const PathColors colors = path_colors(tracing.color, paths, radius, {});
    object.surface = path_surface(path_mesh(paths, tracing, colors, radius, tolerance), paths, colors,
                                  object.paths->lights.light.rec709_to_working);
  }
}

void add_objects(const std::vector<SceneObject>& objects, const ShownLight& light, std::vector<ShadedSurface>& surfaces,
                 std::vector<Material>& materials) {
  for (const SceneObject& object : objects) {
    ShadedSurface surface = object.surface;
    surface.material = static_cast<int>(materials.size());
    const int steps = surface.pictures ? surface.pictures->roughness_steps : 1;
    for (int step = 0; step < steps; ++step) {
      MaterialDescription material = object.material;
      if (steps > 1) material.roughness = double(step) / (steps - 1);
      materials.push_back(load_material(material, light));
    }
    surfaces.push_back(std::move(surface));
  }
}

}  // namespace tensorray
