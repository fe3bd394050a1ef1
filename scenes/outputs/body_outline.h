#pragma once
/// The lines by which a drawing shows bodies: their silhouette, edges at which faces turn by more than 30°, and the
/// borders of open meshes. Faces that lie on each other, where shells touch, have no edges.

#include <vector>

#include "base/geometry/triangle_mesh.h"
#include "renderer/charts/annotations.h"
#include "renderer/surfaces/plate.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// The lines as a plate shows them along `direction` (not across its normal). What lies behind a body is hidden.
std::vector<OutlineStroke> body_outline(const std::vector<TriangleMesh>& bodies, const Plate& plate,
                                        const Eigen::Vector3d& direction);

/// Those of the surface on which the field ends, and of the obstacles; nothing if no annotation wants them.
std::vector<OutlineStroke> body_outline(const Scene& scene, const Plate& plate);

}  // namespace tensorray
