#pragma once
/// The lights of the method "scene", and the light that they throw through the field on its objects. Each pair of a
/// light and an object has either photons (photons.cpp) or a flow map (sunlight.cpp).

#include <functional>
#include <optional>
#include <vector>

#include "base/process/progress.h"
#include "integrators/path_tracing/load_paths.h"
#include "integrators/scene/scene_method.h"
#include "renderer/light_maps/photon_map.h"
#include "renderer/light_maps/photon_tracer.h"
#include "renderer/lights/lights.h"
#include "renderer/materials/material.h"
#include "renderer/surfaces/surface.h"
#include "renderer/surfaces/surface_scene.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// A plate, a mesh, or paths of light.
struct SceneObject {
  std::optional<Plate> plate;  ///< If it is flat.
  ShadedSurface surface;       ///< A mesh.
  MaterialDescription material;
  std::optional<PathScene> paths;  ///< If its mesh are tubes about paths: `surface` is empty until these are followed.

  const TriangleMesh& mesh() const { return std::get<TriangleMesh>(surface.shape); }
};

/// Lights, and what they light.
struct LitObjects {
  const Scene& scene;
  const std::vector<Light>& lights;
  const std::vector<SceneObject>& objects;
  const SurfaceScene& surfaces;  ///< All surfaces, of which that of object i has the index i, and lamps are the last.
  Job* job = nullptr;            ///< Whose ranks trace the light together, and all have it; null: alone.
};

/// The objects of the scene (without any, a checkerboard as floor below the volume), then its obstacles.
/// @throw std::runtime_error naming the file that cannot be read; SceneError if seeds of paths are wrong.
std::vector<SceneObject> load_objects(const Scene& scene, const PathTracingDescription& tracing,
                                      const ShownLights& lights, std::vector<std::string>& notes);

/// Follows the paths of objects that consist of paths, and makes their tubes.
/// @param tolerance  Greatest distance of triangles from the tubes, world units.
/// @throw SceneError if no path meets the volume; Cancelled.
void make_tubes(const Scene& scene, double tolerance, Job* job, const Progress& progress,
                std::vector<SceneObject>& objects);

/// Adds their surfaces and materials.
void add_objects(const std::vector<SceneObject>& objects, const ShownLight& light, std::vector<ShadedSurface>& surfaces,
                 std::vector<Material>& materials);

/// For each light, for each object: whether photons are its light through the field. A light whose `caustic` is "auto"
/// has photons where no flow map can be right, since it has the light of one side of a plate: on plates within the
/// volume that it meets before the middle, and on plates along the light whose plane divides the volume. Points within
/// the volume have no beam through it, and so always photons. Where radiance is conserved, all objects have photons,
/// since a flow map keeps power. An area light has photons beside other techniques; with "auto" if it is small.
using PhotonPairs = std::vector<std::vector<bool>>;
PhotonPairs photon_pairs(const LitObjects& lit, const SceneMethodDescription& settings);

/// @param passes  Of photons.
/// @throw Cancelled; as Ranks::all_gather.
PhotonMaps trace_object_photons(const LitObjects& lit, const PhotonPairs& pairs, const BendingRegion& region,
                                const PhotonsDescription& description, int passes, const Progress& progress);

/// The scene's lights; if it has none, a sky and a sun. The sun shines along the scene's `light` if that falls.
std::vector<Light> scene_lights(const Scene& scene, const ShownLights& shown, const Camera& camera);

/// The flexibility of light of a wavelength, nm. In RGB mode it is interpolated linearly, and continued, between 650,
/// 550 and 450 nm, to which the paper gives its three flexibilities.
std::function<double(double)> flexibility_of(const BendingDescription& bending);

/// The light of directional lights and points that lands on the objects through the field, by flow maps: of all pairs
/// but those that have photons. @throw SceneError if a light is where it can have no map; Cancelled; as
/// Ranks::all_gather.
std::vector<IrradianceMap> land_light(const LitObjects& lit, const PhotonPairs& photons, const ShownLight& shown,
                                      const CausticDescription& caustic, const Progress& progress);

}  // namespace tensorray
