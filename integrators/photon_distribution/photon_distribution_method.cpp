#include "integrators/photon_distribution/photon_distribution_method.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "base/process/progress.h"
#include "base/process/seconds.h"
#include "integrators/photon_distribution/plate_light.h"
#include "scenes/description/check_scene.h"
#include "scenes/outputs/body_outline.h"
#include "scenes/outputs/picture_outputs.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "volumes/points/point_files.h"

namespace tensorray {
namespace {

/// "550nm", with as many decimals as all names need to differ; in RGB mode "red", "green", "blue".
std::vector<std::string> band_names(const Scene& scene) {
  if (scene.description.bending.rgb) return {"red", "green", "blue"};
  constexpr int max_decimals = 9;
  for (int decimals = 0;; ++decimals) {
    std::vector<std::string> names;
    for (const Band& band : scene.bands) names.push_back(fmt::format("{:.{}f}nm", band.wavelength, decimals));
    if (decimals == max_decimals || std::set<std::string>(names.begin(), names.end()).size() == names.size())
      return names;
  }
}

void name_fluence(const Scene& scene, std::vector<ScalarGrid>& grids) {
  if (grids.empty()) return;
  grids[0].name = "fluence";
  grids[0].metadata["tensorray:units"] = "irradiance of the undisturbed beam";
  if (grids.size() == 1) return;
  const std::vector<std::string> names = band_names(scene);
  for (std::size_t i = 0; i < names.size(); ++i) {
    ScalarGrid& grid = grids[i + 1];
    grid.name = "fluence_" + names[i];
    grid.metadata["tensorray:units"] = "irradiance of the undisturbed beam in this band";
    grid.metadata["tensorray:power"] = fmt::format("{}", scene.bands[i].power);
    if (!scene.description.bending.rgb)
      grid.metadata["tensorray:wavelength"] = fmt::format("{} nm", scene.bands[i].wavelength);
  }
}

/// The channels of two pictures of the same size.
Image with_channels(const Image& first, const Image& second) {
  std::vector<std::string> channels = first.channels;
  channels.insert(channels.end(), second.channels.begin(), second.channels.end());
  Image both(first.width, first.height, std::move(channels));
  const std::size_t a = first.channels.size(), b = second.channels.size();
  for (std::size_t i = 0; i * (a + b) < both.pixels.size(); ++i) {
    std::copy_n(&first.pixels[i * a], a, &both.pixels[i * (a + b)]);
    std::copy_n(&second.pixels[i * b], b, &both.pixels[i * (a + b) + a]);
  }
  return both;
}

/// The part of the power that `integrator.side_light` leaves out.
double side_share(const Statistics& statistics) {
  double side = 0, all = 0;
  for (std::size_t channel = 0; channel < statistics.ends.size(); ++channel)
    for (int end = 0; end < ray_end_count; ++end) {
      const double power = statistics.power.empty()
                               ? static_cast<double>(statistics.ends[channel][end]) * statistics.channel_power[channel]
                               : statistics.power[channel][end];
      all += power;
      if (end == static_cast<int>(RayEnd::side)) side += power;
    }
  return all > 0 ? side / all : 0;
}

/// @param job  Whose ranks have the same map; only the root has the result. Null: alone.
Render render_of(const Scene& scene, PlateLight light, const Progress& progress, Job* job) {
  const SceneDescription& description = scene.description;
  const auto start = Clock::now();
  Render result = std::move(light.render);
  if (!light.map.triangles.empty() && (description.output.wants("exr") || description.output.wants("maps")))
    result.linear = with_channels(result.linear, plate_map(light.map, scene, progress, job));
  if (job && !is_root(job->ranks)) return {};
  if (description.output.wants("spectral"))
    result.spectral = spectral_image(light.irradiance, scene.bands, SpectralQuantity::irradiance,
                                     description.light.irradiance, to_working(scene));
  result.view = picture_view(*scene.geometry.surfaces().plate);
  result.outline = body_outline(scene, *scene.geometry.surfaces().plate);
  if (description.output.wants(Annotation::legend)) result.draw_legend = light_legend(scene);
  name_fluence(scene, result.grids);
  if (result.statistics.error) result.metadata["tensorray:error"] = fmt::format("{:.3g}", *result.statistics.error);
  result.metadata["tensorray:photons"] = std::to_string(result.statistics.positions);
  result.statistics.seconds_color = seconds_since(start);
  if (const double share = side_share(result.statistics); share > 0)
    result.notes.push_back(
        fmt::format("{:.2g}% of the light leaves the volume by its side faces and is left out "
                    "(`integrator.side_light`)",
                    100 * share));
  if (nothing_arrived(result.statistics))
    result.warnings.push_back("no light reached the plate; look at `receiver` and `light`");
  return result;
}

class LoadedPhotons : public LoadedMethod {
 public:
  Render render(const Scene& scene, const Progress& progress, RenderJob* job) const override {
    const auto show = [&](PlateLight so_far) {
      if (job->show) job->show(render_of(scene, std::move(so_far), progress, nullptr));
    };
    PlateLight light = light_on_plate(scene, progress, job, show);
    if (job && job->is_shard) return {};
    return render_of(scene, std::move(light), progress, job);
  }
};

PointCloud point_cloud(const std::vector<PlatePhoton>& photons, const ImageMetadata& metadata) {
  PointCloud points;
  points.metadata = metadata;
  std::vector<float>&wavelength = points.scalars["wavelength"], &power = points.scalars["power"];
  std::vector<Eigen::Vector3f>&direction = points.vectors["direction"], &origin = points.vectors["origin"];
  for (const PlatePhoton& photon : photons) {
    points.positions.push_back(photon.position);
    wavelength.push_back(photon.wavelength);
    power.push_back(photon.power);
    direction.push_back(photon.direction);
    origin.push_back(photon.origin);
  }
  return points;
}

void write_photons(const std::filesystem::path& file, const Scene& scene, const Render& render) {
  write_points(file, point_cloud(render.photons, provenance(scene, render)));
}

/// What the picture takes while it is made, for each pixel of the plate: films, and pictures of single precision.
std::size_t bytes_per_pixel(const SceneDescription& scene, PhotonDensityKind kind) {
  const bool is_spectral = scene.output.wants("spectral");
  const auto channels = static_cast<std::size_t>(channel_count(scene));
  const std::size_t linear = 3 * sizeof(float);
  if (kind == PhotonDensityKind::mesh) {
    const std::size_t map = plate_map_channels().size() * sizeof(float);
    return 3 * sizeof(double) + linear +
           (scene.output.wants("exr") || scene.output.wants("maps") ? linear + 2 * map : 0) +
           (is_spectral ? channels * (sizeof(double) + sizeof(float)) : 0);
  }
  const std::size_t planes = is_spectral || channels <= 3 ? channels : 3;
  const std::size_t blurred = kind == PhotonDensityKind::gaussian ? sizeof(double) : 0;
  return planes * (sizeof(std::int64_t) + sizeof(double) + blurred + (is_spectral ? sizeof(float) : 0)) + linear;
}

class PhotonDistributionMethod : public MethodWith<PhotonDescription> {
 public:
  const char* name() const override { return "photon_distribution"; }
  bool shows_plate() const override { return true; }

  std::vector<std::string> channels(const SceneDescription&) const override {
    return settings().density.kind == PhotonDensityKind::mesh ? plate_map_channels() : std::vector<std::string>();
  }

  std::vector<Output> outputs() const override {
    return picture_outputs(
        {spectral_output(),
         maps_output(),
         {"photons", "the photons, one by one", {".vdb", ".vtp"}, write_photons},
         {"fluence", "the light inside the volume, as a fog volume", {".vdb"}, write_grids, ".fluence.vdb"}});
  }

  void check(SceneDescription& scene, const Json& json, const SceneSource& source, bool chosen) const override {
    const bool draws_mesh = settings().density.kind == PhotonDensityKind::mesh;
    for (const char* key : {"/integrator/density/tolerance", "/integrator/density/error"})
      if (chosen && !draws_mesh && given(json, key))
        scene.warnings.push_back(fmt::format("`{}` has no effect: it belongs to the density \"mesh\"", key));
    if (!chosen && given(json, "/integrator/density/error"))
      scene.warnings.push_back("`/integrator/density/error` bounds only the error of the light on a plate");
    if (!chosen) return;
    default_annotations(scene, json, {Annotation::body});
    check_spectral_output(scene, source);
    check_receiver_memory(scene, static_cast<double>(bytes_per_pixel(scene, settings().density.kind)), source);
    warn_unused(scene, json, "/light/spectrum", "/bending/rgb");
    if (settings().density.kind != PhotonDensityKind::photon_differential &&
        given(json, "/integrator/density/footprint"))
      scene.warnings.push_back(
          "`/integrator/density/footprint` has no effect: it belongs to the density \"photon_differential\"");
    if (draws_mesh && given(json, "/integrator/density/tau"))
      scene.warnings.push_back("`/integrator/density/tau` has no effect: it belongs to the density \"gaussian\"");
    if (scene.output.fluence_bands && !scene.output.wants("fluence"))
      scene.warnings.push_back("`/output/fluence_bands` has no effect without `/output/fluence`");
  }

  std::unique_ptr<const LoadedMethod> load(const Scene&, std::vector<std::string>&) const override {
    return std::make_unique<LoadedPhotons>();
  }
};

}  // namespace

std::shared_ptr<Method> photon_distribution_method() { return std::make_shared<PhotonDistributionMethod>(); }

}  // namespace tensorray
