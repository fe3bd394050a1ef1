#pragma once
/// The method "scene": surfaces lit by light that the field bends, seen by a camera whose rays it bends, too. Its own
/// keys of `integrator`; it shares others with path tracing.

#include <cstdint>
#include <memory>
#include <optional>

#include "integrators/scene/field_region.h"
#include "scenes/description/method.h"

namespace tensorray {

/// `integrator.caustic`.
struct CausticDescription {
  int resolution = 1024;          ///< Pixels along the longer side of the part of a plate where light lands.
  int passes = 4;                 ///< Directions within the disk of a light that has one.
  std::uint64_t rays = 1u << 17;  ///< Positions from which light starts, at most, for each direction.
};

/// `integrator.photons`.
struct PhotonsDescription {
  std::uint64_t per_pass = 16384;    ///< Positions from which photons start; each has one of every band. 0: none.
  std::optional<double> max_radius;  ///< Within which photons of the first pass light a surface; none: "auto".
};

struct SceneMethodDescription {
  Conserve conserve = Conserve::power;
  int bands_per_sample = 8;        ///< Bands that a path follows into the volume; divides `bands`.
  double max_radiance_scale = 20;  ///< Greatest factor on radiance; 0: no limit.
  CausticDescription caustic;
  PhotonsDescription photons;
};

inline Words words(Conserve) { return {"power", "radiance"}; }

inline void describe(CausticDescription& caustic, KeyVisitor& visit) {
  visit("resolution", caustic.resolution, "pixels along the longer side of the part of a plate where light lands",
        between(16, 16384));
  visit("passes", caustic.passes, "directions within the disk of a directional light with an angle", between(1, 1024));
  visit("rays", caustic.rays, "positions from which light starts, at most, for each direction", between(64, 1e9));
}

inline void describe(PhotonsDescription& photons, KeyVisitor& visit) {
  visit("per_pass", photons.per_pass, "positions from which photons start in each pass; 0: no photons",
        between(0, 4e9));
  visit("max_radius", photons.max_radius, "radius about photons of the first pass, world units",
        above(0).or_word("auto"));
}

inline void describe(SceneMethodDescription& settings, KeyVisitor& visit) {
  visit("conserve", settings.conserve, "scene: what light keeps in the field: a photon's power, or radiance", knob());
  visit("bands_per_sample", settings.bands_per_sample,
        "scene: bands that a sample follows into the volume; divides `bands`", between(1, 1000));
  visit("max_gain", settings.max_radiance_scale,
        "scene: greatest factor by which the field increases radiance (`conserve` power); 0: no limit", at_least(0));
  visit.section("caustic", settings.caustic,
                "scene: the light of directional lights and points that the field throws on objects");
  visit.section("photons", settings.photons, "scene: photons, where that light has no map: see `caustic` of `lights`");
}

std::shared_ptr<Method> scene_method();

}  // namespace tensorray
