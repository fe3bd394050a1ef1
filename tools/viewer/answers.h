#pragma once
/// What a page can ask about a scene and its picture. All functions return messages of the page's protocol
/// (tools/viewer/page/src/state/protocol.ts), without `type` and `id`.

#include <vector>

#include <Eigen/Core>

#include "scenes/keys/json_reader.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// The volume of a scene: `voxels` and `corners`.
Json describe_field(const Scene& scene);

/// What was used where a scene may leave it open, as a part of a scene: scale, direction of light, plate, colours.
Json describe_choices(const Scene& scene, const Render& render);

/// Names that keys may have in this scene, in the place of their values.
Json describe_examples(const Scene& scene);

/// Positions, rays and surfaces in the world: `plate`, `beam`, `rays`, `meshes`, `camera`.
/// @param with_meshes  Otherwise `meshes` is null: the page keeps those that it has.
Json describe_space(const Scene& scene, bool with_meshes);

/// Finds the light that lands at a place of the plate. Immutable.
class LandedRays {
 public:
  /// Traces some rays of three colours, from the beam to the plate.
  explicit LandedRays(const Scene& scene);

  /// The paths of the light that lands at `place`, at most a few for each colour, as `rays` of a message.
  Json to(const Scene& scene, const Eigen::Vector2d& place) const;

 private:
  struct Colour {
    double flexibility = 0;
    std::vector<Eigen::Vector2d> landings;  ///< Parts of the plate, from its top left corner; NaN: none.
  };
  std::vector<Eigen::Vector3d> starts_;  ///< World; (cells + 1)² positions, row by row.
  std::vector<Colour> colours_;
};

/// The values of a pixel: `lines`, `color` and `spectrum`.
/// @param display  The picture as the page shows it: as large as the render's, or larger. @param place  Part of the
/// render's width and height, from the top left corner.
Json describe_pixel(const Render& render, const Image& display, const Eigen::Vector2d& place);

}  // namespace tensorray
