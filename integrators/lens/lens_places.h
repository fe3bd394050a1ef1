#pragma once
/// @file integrators/lens/lens_places.h
/// How often a point of the image is in the picture of a lens.

#include "integrators/lens/lens.h"
#include "renderer/coverage/planar_mesh.h"

namespace tensorray {

/// Counts the places of the picture that show what each pixel sees, in `gather`. The map from the picture to the image
/// may fold; each sheet is one place. Immutable; any number of threads may count. The light must outlive it.
class PlaceCounter {
 public:
  explicit PlaceCounter(const LensLight& light);

  /// At least 1. @param landing  Pixels of the map.
  int count(const Eigen::Vector2d& landing) const;

 private:
  const LensLight& light_;
  const PlanarMesh mesh_;
  const PlanarMeshSearch search_;
};

}  // namespace tensorray
