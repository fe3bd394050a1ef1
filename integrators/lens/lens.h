#pragma once
/// @file integrators/lens/lens.h
/// A known image seen through a tensor field (Zheng and Pang 2003, section on lens simulation).
///
/// Light travels from the image to the receiver; the viewer stands behind the receiver and looks against the light.
/// Both rectangles are given as the viewer sees them: their normals point to the viewer, along the light. There is no
/// n² radiance law for this medium: the image's radiance arrives unchanged.

#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "base/progress.h"
#include "integrators/bending/light_channel.h"
#include "integrators/lens/lens_map.h"
#include "renderer/film/film.h"
#include "renderer/textures/texture.h"

namespace tensorray {

/// Two different questions, whose answers differ where the field acts between different planes; see docs/scenes.md.
enum class LensMode {
  gather,  ///< Parallel light leaves every pixel of the receiver against the light, bends with −s, and looks the image
           ///< up where it arrives: every pixel is covered.
  scatter,  ///< Parallel light leaves the image towards the viewer, bends with +s, and carries its texture coordinate
            ///< to the receiver, where neighbouring landings form a mesh. Where that folds, the sheet nearest in
            ///< parameter (the least displaced) is seen; of equal ones the first.
};

/// What is looked at.
struct LensImage {
  const Texture* texture = nullptr;
  Plate plane;         ///< Its resolution plays no part.
  bool wraps = false;  ///< Whether it goes on beyond the plane's edges, as the texture does (seen in `gather` alone).
                       ///< If not, the texture should be one that clamps: its edges are then as sharp as the samples.

  /// The radiance of a colour (R, G, B in the working space) in a channel; 1 is that of white.
  std::function<double(const Eigen::Vector3d& rgb, std::size_t channel)> radiance;
};

struct LensSettings {
  LensMode mode = LensMode::scatter;
  int samples = 1;            ///< Per pixel along x and along y; > 0.
  std::size_t reference = 0;  ///< The channel whose rays LensPicture::points describes.
};

/// Why a pixel sees the image, or not: the ends of rays, where `image` is a ray that landed, and `outside` one that
/// landed beside it.
enum class LensEnd { image, missed, obstacle, step_limit, degenerate, outside };
static_assert(static_cast<int>(LensEnd::degenerate) == static_cast<int>(RayEnd::degenerate));
constexpr int lens_end_count = 6;
const char* to_string(LensEnd end);

/// What the centre of a pixel sees, in the reference channel.
struct LensPoint {
  LensEnd end = LensEnd::missed;  ///< In `scatter`, a pixel where no light lands is `missed`.

  // If end is `image` or `outside`:
  Eigen::Vector2d st = Eigen::Vector2d::Zero();         ///< Texture coordinates: (0, 0) lower left, (1, 1) upper right.
  Eigen::Matrix2d per_pixel = Eigen::Matrix2d::Zero();  ///< Columns: change of (s, t) per pixel along x and y.
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  ///< Of the point seen, from the one that straight light
                                                           ///< would show; world units.
  double log_magnification = 0;  ///< ln of image area as seen over image area: ln(σ₁σ₂) of ∂receiver/∂image.
  Eigen::Vector2d log_stretch{0, 0};  ///< ln σ₁ >= ln σ₂: its parts along the two principal directions.
  int folds = 0;      ///< `scatter`: sheets of the image that lie here. `gather`: places of the picture that
                      ///< show the point that is seen here. 1: no fold.
  double length = 0;  ///< Of the ray, world units.
};

struct LensPicture {
  Film radiance;              ///< A channel each, alpha multiplied in.
  std::vector<double> alpha;  ///< A pixel each: the part of it that sees the image, in the channel that sees most of
                              ///< it: where others see none, their light is missing, and what is left is coloured.
  std::vector<LensPoint> points;                           ///< A pixel each, row by row from the top.
  Eigen::Affine2d straight = Eigen::Affine2d::Identity();  ///< From pixels to the (s, t) that straight light shows.
  std::vector<EndCounts> ends;  ///< Rays by channel and end; `plate` counts those that met the image's plane (gather)
                                ///< or the receiver's (scatter).
  TraceCounts counts;
  double seconds_tracing = 0;
};

/// The picture on `receiver`, whose resolution it has.
/// @param surfaces   Bounds, cut and obstacles of the scene; its plate plays no part.
/// @param direction  Of the light, unit.
/// @throw std::invalid_argument if a setting is out of range; Cancelled.
/// The result is the same for any number of threads.
LensPicture simulate_lens(const TensorField& field, const Surfaces& surfaces, const BendingSettings& bending,
                          const std::vector<LightChannel>& channels, const Eigen::Vector3d& direction,
                          const Plate& receiver, const LensImage& image, const LensSettings& settings,
                          const Progress& progress);

}  // namespace tensorray
