#include <algorithm>

#include <fmt/format.h>

#include "base/constants.h"
#include "base/process/job.h"
#include "integrators/path_tracing/path_tracing_method.h"
#include "integrators/path_tracing/stage.h"
#include "integrators/photon_distribution/plate_light.h"
#include "renderer/charts/colormap.h"
#include "renderer/color/color.h"
#include "renderer/film/spectral_image.h"
#include "renderer/meshes/mesh.h"
#include "volumes/sampling/tensor_sampler.h"
#include "volumes/tensors/isosurface.h"

namespace tensorray {
namespace {

constexpr double edge_radius = 0.0012;  // Radius of the box's edges, in diagonals of the volume.
constexpr int slice_cells = 256;        // Cells along the slice's longer side.
constexpr double plate_white = 0.85;    // Reflectance of the plate at the 99th percentile of its light.

MaterialDescription plain(double grey, double roughness) {
  MaterialDescription description;
  description.color.setConstant(grey);
  description.roughness = roughness;
  return description;
}

/// Adds a surface with a material of its own.
void add(const ShownLight& light, ShadedSurface surface, const MaterialDescription& material,
         std::vector<ShadedSurface>& surfaces, std::vector<Material>& materials) {
  surface.material = static_cast<int>(materials.size());
  materials.push_back(load_material(material, light));
  surfaces.push_back(std::move(surface));
}

/// The twelve edges of the volume. Bits 0, 1 and 2 of a corner's number choose its x, y and z.
ShadedSurface box_edges(const TensorField& field) {
  const Eigen::AlignedBox3d& box = field.index_bounds();
  RoundCurves curves;
  for (int corner = 0; corner < 8; ++corner)
    for (int axis = 0; axis < 3; ++axis) {
      if (corner >> axis & 1) continue;
      for (const int end : {corner, corner | 1 << axis})
        curves.points.push_back(field.to_world() * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(end)));
      curves.strand_ends.push_back(static_cast<std::uint32_t>(curves.points.size()));
    }
  const double diagonal = (curves.points.front() - field.to_world() * box.max()).norm();
  curves.radii.assign(curves.points.size(), static_cast<float>(edge_radius * diagonal));
  ShadedSurface surface;
  surface.shape = std::move(curves);
  return surface;
}

/// Adds two triangles for each cell of a lattice of columns × rows vertices, if `keeps` is true for its four corners.
template <class Keeps>
void add_lattice(int columns, int rows, const Keeps& keeps, TriangleMesh& mesh) {
  for (int y = 0; y + 1 < rows; ++y)
    for (int x = 0; x + 1 < columns; ++x) {
      const auto a = static_cast<std::uint32_t>(y * columns + x), b = a + 1;
      const std::uint32_t c = a + static_cast<std::uint32_t>(columns), d = c + 1;
      if (!keeps(a) || !keeps(b) || !keeps(c) || !keeps(d)) continue;
      mesh.triangles.push_back({a, c, b});
      mesh.triangles.push_back({b, c, d});
    }
}

/// The light on the plate, of which each rank makes a part.
Image plate_image(const Scene& scene, Job* job, const Progress& progress) {
  const Eigen::Vector2i& resolution = scene.geometry.surfaces().plate->resolution;
  Image image(resolution.x(), resolution.y(), {"R", "G", "B"});
  const auto make = [&] {
    Job whole;  // All shards make all of it.
    whole.ranks = job ? job->ranks : nullptr;
    Image made = light_on_plate(scene, progress, whole.ranks ? &whole : nullptr).render.linear;
    if (is_root(whole.ranks)) image = std::move(made);
    broadcast_list(whole.ranks, image.pixels);
  };
  find_or_make(job, light_name + "plate", make, [&](Archive& archive) {
    archive.copy(image.pixels.data(), image.pixels.size() * sizeof image.pixels[0]);
  });
  return image;
}

/// The plate with the light of the photons as its colour: a vertex in the middle of each pixel.
ShadedSurface lit_plate(const Scene& scene, Job* job, const Progress& progress) {
  const Image image = plate_image(scene, job, progress);
  std::vector<float> greatest;
  for (std::size_t i = 0; i < image.pixels.size(); i += 3)
    greatest.push_back(std::max({image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]}));
  const auto bright = greatest.begin() + static_cast<std::ptrdiff_t>(greatest.size() * 99 / 100);
  std::nth_element(greatest.begin(), bright, greatest.end());
  const float gain = *bright > 0 ? static_cast<float>(plate_white) / *bright : 1;

  const Plate& plate = *scene.geometry.surfaces().plate;
  ShadedSurface surface;
  TriangleMesh mesh;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      mesh.vertices.push_back(plate.to_world({x + 0.5, y + 0.5}));
      surface.colors.push_back((gain * Eigen::Map<const Eigen::Vector3f>(image.pixel(x, y))).cwiseMax(0).cwiseMin(1));
    }
  add_lattice(
      image.width, image.height, [](std::uint32_t) { return true; }, mesh);
  surface.shape = std::move(mesh);
  return surface;
}

/// The points where the plane cuts the volume's edges.
std::vector<Eigen::Vector3d> cut_points(const TensorField& field, const Eigen::Vector3d& center,
                                        const Eigen::Vector3d& normal) {
  const ShadedSurface edges = box_edges(field);
  const RoundCurves& curves = std::get<RoundCurves>(edges.shape);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i + 1 < curves.points.size(); i += 2) {
    const double from = normal.dot(curves.points[i] - center), to = normal.dot(curves.points[i + 1] - center);
    if (from == to || (from > 0) == (to > 0)) continue;
    points.push_back(curves.points[i] + from / (from - to) * (curves.points[i + 1] - curves.points[i]));
  }
  return points;
}

ShadedSurface make_slice(const Scene& scene, const ShownLight& light, const SliceDescription& slice,
                         std::vector<SurfaceLegend>& legends) {
  const Eigen::Vector3d normal = slice.normal.normalized(), up = upright(normal, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d right = up.cross(normal);
  const Eigen::AlignedBox3d& extent = scene.field.index_bounds();
  const Eigen::Vector3d center = slice.center.value_or(scene.field.to_world() * extent.center());
  Eigen::AlignedBox2d area;
  for (const Eigen::Vector3d& point : cut_points(scene.field, center, normal))
    area.extend(Eigen::Vector2d((point - center).dot(right), (point - center).dot(up)));
  if (area.isEmpty() || !(area.sizes().minCoeff() > 0))
    throw SceneError(scene.description.path.string() +
                     ": `/integrator/context/slice` does not cut the volume; move its `center`");
  const Eigen::Array2i cells = (slice_cells * area.sizes() / area.sizes().maxCoeff()).array().ceil().max(1).cast<int>();
  TriangleMesh mesh;
  std::vector<double> values;
  std::vector<bool> inside;
  TensorSampler sampler(scene.field);
  const double rounding = 1e-6 * extent.sizes().maxCoeff();
  for (int y = 0; y <= cells.y(); ++y)
    for (int x = 0; x <= cells.x(); ++x) {
      const Eigen::Vector2d at =
          area.min().array() + Eigen::Array2d(x, y) / cells.cast<double>() * area.sizes().array();
      mesh.vertices.push_back(center + at.x() * right + at.y() * up);
      const Eigen::Vector3d index = scene.field.to_index() * mesh.vertices.back();
      inside.push_back(extent.exteriorDistance(index) <= rounding);
      values.push_back(invariant(slice.invariant, sampler.at(mesh.vertices.back())));
    }
  add_lattice(
      cells.x() + 1, cells.y() + 1, [&](std::uint32_t vertex) { return inside[vertex]; }, mesh);
  const ValueRange range = slice.range ? ValueRange{slice.range->x(), slice.range->y()} : choose_range(values);
  legends.push_back(bar_legend(invariant_title(slice.invariant, units_of(scene)), range,
                               [map = slice.map](double at) { return colormap_linear(map, at); }));
  ShadedSurface surface;
  for (const double value : values)
    surface.colors.push_back((light.rec709_to_working * colormap_linear(slice.map, range.position(value)))
                                 .cwiseMax(0)
                                 .cwiseMin(1)
                                 .cast<float>());
  surface.shape = std::move(mesh);
  return surface;
}

ShadedSurface make_isosurface(const Scene& scene, const IsosurfaceDescription& description) {
  Isosurface found = isosurface(scene.field, description.invariant, description.value);
  if (found.mesh.triangles.empty())
    throw SceneError(fmt::format("{}: `/integrator/context/isosurfaces`: {} is nowhere {:g} in this field",
                                 scene.description.path.string(), choice_name(description.invariant),
                                 description.value));
  ShadedSurface surface;
  for (const Eigen::Vector3d& normal : found.normals) surface.normals.push_back(normal.cast<float>());
  surface.shape = std::move(found.mesh);
  return surface;
}

MaterialSettings settings_of(const MaterialDescription& description, const std::vector<Band>& bands) {
  if (description.kind == MaterialKind::diffuse) return Diffuse{};
  if (description.kind == MaterialKind::glass) return RoughDielectric{description.roughness, description.index};
  if (description.kind == MaterialKind::metal) {
    std::vector<double> wavelengths;
    for (const Band& band : bands) wavelengths.push_back(band.wavelength);
    return RoughConductor{description.roughness, metal_index(choice_name(description.metal), wavelengths)};
  }
  Principled principled;
  principled.metallic = description.metallic;
  principled.roughness = description.roughness;
  principled.specular = description.specular;
  principled.clearcoat = description.clearcoat;
  return principled;
}

}  // namespace

ShadedSurface read_mesh_surface(const SceneDescription& scene, const std::filesystem::path& file,
                                std::optional<double> smooth_angle) {
  if (smooth_angle) *smooth_angle *= pi / 180;
  MeshWithNormals read = read_mesh_with_normals(file, smooth_angle, scene.turn());
  ShadedSurface surface;
  surface.shape = std::move(read.mesh);
  surface.normals = std::move(read.normals);
  surface.places = std::move(read.places);
  return surface;
}

Material load_material(const MaterialDescription& description, const ShownLight& light) {
  // For metals and glass the colour is a factor: it is 1 unless the scene gives a colour that is not the default.
  const std::vector<float> color = light.radiance(description.color, 1);
  BandValues reflectance = BandValues::Ones(static_cast<Eigen::Index>(color.size()));
  const bool is_factor = description.kind == MaterialKind::metal || description.kind == MaterialKind::glass;
  if (!is_factor || description.color != MaterialDescription().color)
    reflectance = Eigen::Map<const Eigen::ArrayXf>(color.data(), static_cast<Eigen::Index>(color.size()))
                      .cast<double>()
                      .max(0)
                      .min(1);
  return make_material(settings_of(description, light.bands), reflectance);
}

void add_context(const Scene& scene, const PathScene& paths, Job* job, const Progress& progress,
                 std::vector<ShadedSurface>& surfaces, std::vector<Material>& materials,
                 std::vector<SurfaceLegend>& legends) {
  const ContextDescription& context = paths.settings.context;
  const auto add_surface = [&](ShadedSurface surface, const MaterialDescription& material) {
    add(paths.lights.light, std::move(surface), material, surfaces, materials);
  };
  if (context.box) add_surface(box_edges(scene.field), plain(0.12, 1));
  if (context.obstacles)
    for (const std::filesystem::path& file : scene.description.obstacles)
      add_surface(read_mesh_surface(scene.description, file), plain(0.6, 0.5));
  if (context.body > 0 && scene.geometry.has_cut()) {
    ShadedSurface body;
    body.shape = *scene.geometry.surfaces().cut;
    body.opacity = static_cast<float>(context.body);
    add_surface(std::move(body), plain(0.6, 0.5));
  }
  if (context.plate) add_surface(lit_plate(scene, job, progress), plain(0.8, 1));
  if (context.slice) add_surface(make_slice(scene, paths.lights.light, *context.slice, legends), plain(0.8, 1));
  for (const IsosurfaceDescription& each : context.isosurfaces)
    add_surface(make_isosurface(scene, each), each.material);
}

}  // namespace tensorray
