#include "renderer/light_maps/photon_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/process/job.h"
#include "renderer/lights/photon_emitter.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr std::uint64_t photon_seed = 0x9e3779b97f4a7c15;  // Photons do not share the numbers of pixels.
constexpr std::size_t chunk_size = 128;                    // Positions.
constexpr std::size_t chunks_in_round = 256;               // That ranks give each other: 100 MB, of 32 bands.

struct Source {
  int light = 0;
  PhotonEmitter emitter;
  const std::vector<float>* strength = nullptr;  // In every band.
  std::uint64_t count = 1;                       // Positions in each pass.
};

struct Chunk {
  std::size_t source = 0;
  std::uint64_t first = 0, last = 0;
};

struct ChunkPhotons {
  std::vector<Photon> landed;
  PhotonCounts counts{};
};

/// The lights that light a surface, with shares of `per_pass` by their power.
std::vector<Source> sources_of(const std::vector<Vector3d>& corners, const SurfaceScene& surfaces,
                               const std::vector<Light>& lights, const PhotonTracerSettings& settings) {
  std::vector<Source> sources;
  std::vector<double> powers;
  for (int i = 0; i < static_cast<int>(lights.size()); ++i) {
    const std::vector<float>* const strength = thrown_light(lights[static_cast<std::size_t>(i)]);
    bool is_wanted = false;
    for (std::uint32_t k = 0; k < surfaces.surfaces().size(); ++k) is_wanted = is_wanted || settings.serves(i, k);
    const double sum = strength && is_wanted ? std::accumulate(strength->begin(), strength->end(), 0.0) : 0;
    if (!(sum > 0)) continue;
    sources.push_back({i, {lights[static_cast<std::size_t>(i)], corners, surfaces.bounds()}, strength});
    powers.push_back(sum * sources.back().emitter.power());
  }
  const double all = std::accumulate(powers.begin(), powers.end(), 0.0);
  for (std::size_t i = 0; i < sources.size(); ++i)
    sources[i].count =
        static_cast<std::uint64_t>(std::max(1.0, std::round(static_cast<double>(settings.per_pass) * powers[i] / all)));
  return sources;
}

std::vector<std::optional<AreaPhotons>> areas_of(const std::vector<Source>& sources, const std::vector<Light>& lights,
                                                 const SurfaceScene& surfaces, const PhotonTracerSettings& settings) {
  std::vector<std::optional<AreaPhotons>> areas(lights.size());
  for (const Source& source : sources) {
    const auto light = static_cast<std::size_t>(source.light);
    if (!emitting_mesh(lights[light])) continue;
    areas[light] = AreaPhotons{source.emitter, static_cast<double>(source.count), {}};
    for (std::uint32_t k = 0; k < surfaces.surfaces().size(); ++k)
      areas[light]->surfaces.push_back(settings.serves(source.light, k));
  }
  return areas;
}

std::vector<Chunk> chunks_of(const std::vector<Source>& sources) {
  std::vector<Chunk> chunks;
  for (std::size_t i = 0; i < sources.size(); ++i)
    for (std::uint64_t first = 0; first < sources[i].count; first += chunk_size)
      chunks.push_back({i, first, std::min(first + chunk_size, sources[i].count)});
  return chunks;
}

/// Adds a photon, and its images beyond the edges of its plate that light points of the plate.
void add_mirrored(const Photon& photon, const Plate& plate, double radius, std::vector<Photon>& photons) {
  const Vector3d from = photon.position.cast<double>() - plate.center;
  std::vector<Photon> images{photon};
  for (const auto& [axis, size] : {std::pair(plate.right, plate.size.x()), std::pair(plate.up, plate.size.y())})
    for (const double side : {-0.5, 0.5}) {
      const double beyond = side * size - from.dot(axis);
      if (std::abs(beyond) >= radius) continue;
      for (std::size_t i = 0, count = images.size(); i < count; ++i) {
        images.push_back(images[i]);
        images.back().position += (2 * beyond * axis).cast<float>();
      }
    }
  photons.insert(photons.end(), images.begin(), images.end());
}

class PhotonTracer {
 public:
  PhotonTracer(const BendingRegion& region, const SurfaceScene& surfaces, const PhotonTracerSettings& settings,
               const Progress& progress, int pass)
      : region_(region),
        surfaces_(surfaces),
        settings_(settings),
        progress_(progress),
        pass_(pass),
        radius_(photon_radius(settings.radius, pass)) {}

  ChunkPhotons trace(const Source& source, const Chunk& chunk) const {
    ChunkPhotons result;
    const std::uint64_t stream = static_cast<std::uint64_t>(source.light) * settings_.passes + pass_;
    for (std::uint64_t i = chunk.first; i < chunk.last; ++i) {
      if (progress_.cancelled) throw Cancelled();
      trace(source, {settings_.seed ^ photon_seed, stream, static_cast<std::uint32_t>(i), 0}, result);
    }
    return result;
  }

  double radius() const { return radius_; }

 private:
  void trace(const Source& source, PathSampler sampler, ChunkPhotons& result) const {
    BentRay ray;
    ray.place = sampler.next_1d();
    const EmittedPhoton photon = source.emitter.sample(sampler);
    ray.position = photon.origin;
    ray.direction = photon.direction;
    std::vector<BentRay> rays;
    for (std::size_t band = 0; band < source.strength->size(); ++band) {
      ray.band = static_cast<int>(band);
      if ((*source.strength)[band] > 0) rays.push_back(ray);
    }
    result.counts.emitted += rays.size();
    const auto hit = surfaces_.intersect(photon.origin, photon.direction);
    const double entry = region_.entry(photon.origin, photon.direction);
    const bool enters = entry < (hit ? hit->distance : std::numeric_limits<double>::infinity());
    if (!enters || !(photon.power > 0)) {  // Without power it is from the side of an area light that does not emit.
      const PhotonEnd end = hit && !enters ? PhotonEnd::before : PhotonEnd::escaped;
      result.counts.ends[static_cast<std::size_t>(end)] += rays.size();
      return;
    }
    region_.trace_importance(rays);
    for (const BentRay& each : rays) ++result.counts.ends[static_cast<std::size_t>(land(source, each, photon, result))];
  }

  PhotonEnd land(const Source& source, const BentRay& ray, const EmittedPhoton& emitted, ChunkPhotons& result) const {
    if (!ray.arrives) return PhotonEnd::stopped;
    const auto hit = surface_at_end(surfaces_, ray);
    if (!hit) return PhotonEnd::escaped;
    if (!settings_.serves(source.light, hit->surface)) return PhotonEnd::landed;
    Photon photon;
    photon.position = hit->position.cast<float>();
    photon.direction = ray.direction.cast<float>();
    photon.normal = hit->normal.cast<float>();
    const auto count = static_cast<double>(source.count);
    photon.density = count * emitted.density * ray.jacobian;
    photon.power = emitted.power / count * ray.radiance_scale * (*source.strength)[static_cast<std::size_t>(ray.band)];
    photon.surface = hit->surface;
    photon.light = source.light;
    photon.band = ray.band;
    if (hit->surface < settings_.plates.size() && settings_.plates[hit->surface])
      add_mirrored(photon, *settings_.plates[hit->surface], radius_, result.landed);
    else
      result.landed.push_back(photon);
    return PhotonEnd::landed;
  }

  const BendingRegion& region_;
  const SurfaceScene& surfaces_;
  const PhotonTracerSettings& settings_;
  const Progress& progress_;
  int pass_;
  double radius_;
};

/// @throw DamagedArchive if the photons cannot be those of the source.
void copy_chunk(ChunkPhotons& part, const Source& source, std::size_t surfaces, Archive& archive) {
  archive.copy_list(part.landed);
  archive.copy(part.counts);
  if (!archive.reads()) return;
  for (const Photon& photon : part.landed)
    if (photon.light != source.light || photon.surface >= surfaces || photon.band < 0 ||
        static_cast<std::size_t>(photon.band) >= source.strength->size())
      throw DamagedArchive();
}

}  // namespace

PhotonMaps trace_photons(const BendingRegion& region, const std::vector<Vector3d>& corners,
                         const SurfaceScene& surfaces, const std::vector<Light>& lights,
                         const PhotonTracerSettings& settings, const Progress& progress) {
  PhotonMaps result;
  if (settings.per_pass == 0) return result;
  const std::vector<Source> sources = sources_of(corners, surfaces, lights, settings);
  if (sources.empty()) return result;
  result.areas = areas_of(sources, lights, surfaces, settings);
  const std::vector<Chunk> chunks = chunks_of(sources);
  for (int pass = 0; pass < settings.passes; ++pass) {
    const PhotonTracer tracer(region, surfaces, settings, progress, pass);
    std::vector<ChunkPhotons> parts(chunks.size());
    Units units;
    units.count = chunks.size();
    units.make = [&](std::size_t i) { parts[i] = tracer.trace(sources[chunks[i].source], chunks[i]); };
    units.copy = [&](std::size_t i, Archive& archive) {
      copy_chunk(parts[i], sources[chunks[i].source], surfaces.surfaces().size(), archive);
    };
    units.for_all = true;
    units.round = chunks_in_round;
    units.first = static_cast<std::size_t>(pass) * chunks.size();
    units.total = static_cast<std::size_t>(settings.passes) * chunks.size();
    find_or_make(
        settings.job, light_name + "photons " + std::to_string(pass),
        [&] { make_units(units, settings.job, "tracing photons", progress); },
        [&](Archive& archive) {
          for (std::size_t i = 0; i < chunks.size(); ++i) units.copy(i, archive);
        });
    std::vector<Photon> landed;
    result.counts.push_back({});
    for (const ChunkPhotons& part : parts) {
      landed.insert(landed.end(), part.landed.begin(), part.landed.end());
      result.counts.back() += part.counts;
    }
    result.passes.emplace_back(std::move(landed), tracer.radius());
  }
  return result;
}

}  // namespace tensorray
