#pragma once
/// A known image seen through a tensor field (Zheng and Pang 2003, section on lens simulation).
///
/// Light travels from the image to the receiver. The viewer stands behind the receiver and looks against the light.
/// Both rectangles are given as the viewer sees them: their normals point to the viewer, along the light. This medium
/// has no n² radiance law: the radiance of the image arrives unchanged.
///
/// Both modes are a flow map (tracing/flow/flow_map.h) of a LensMap, which all bands share: `scatter` draws its
/// mesh over the landings, `gather` traces from the receiver and draws its mesh over the starts.

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/process/progress.h"
#include "renderer/film/film.h"
#include "renderer/images/image.h"
#include "renderer/textures/texture.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"
#include "tracing/flow/flow_map.h"

namespace tensorray {

class Job;

/// The landing of one ray. Coordinates in a plane are along its plate's right and up, from its centre, world units.
struct LensLanding {
  RayEnd end = RayEnd::missed;                             ///< `plate`: the ray landed.
  Eigen::Vector2d at = Eigen::Vector2d::Zero();            ///< Coordinates of the landing, if the ray landed.
  Eigen::Matrix2d jacobian = Eigen::Matrix2d::Identity();  ///< ∂at/∂start, if the ray landed.
  double length = 0;                                       ///< Length of the ray, world units.
};

/// Cost of tracing.
struct TraceCounts {
  std::uint64_t ray_steps = 0, tensor_samples = 0;

  TraceCounts& operator+=(const TraceCounts& more) {
    ray_steps += more.ray_steps;
    tensor_samples += more.tensor_samples;
    return *this;
  }
};

/// A map from the plane of `from` to the plane of `to`; a function of the start and the flexibility. The planes stand
/// for an image and a receiver. Both are opaque: light is not followed beyond them, and a plane within the volume cuts
/// it. Both planes extend to 100 times the volume's size. Immutable: threads may share it.
class LensMap {
 public:
  /// @param surfaces   Bounds, cut and obstacles; its plate is not used.
  /// @param direction  Direction of the light, unit, from one plane to the other. `field` must outlive the map.
  /// @throw std::runtime_error if Embree fails.
  LensMap(const TensorField& field, const Surfaces& surfaces, const BendingSettings& bending, const Plate& from,
          const Plate& to, const Eigen::Vector3d& direction);

  /// The scene whose plate is the plane where light lands.
  const Geometry& geometry() const { return geometry_; }

  /// Follows a ray for each of `starts` and each of `flexibilities` and writes starts.size() · flexibilities.size()
  /// landings. The landings of one start are next to each other. @return the cost.
  TraceCounts trace(const std::vector<Eigen::Vector2d>& starts, const std::vector<double>& flexibilities,
                    LensLanding* landings) const;

 private:
  const TensorField* field_;
  BendingSettings bending_;
  Plate from_, to_;
  Eigen::Vector3d direction_;
  Geometry geometry_;
};

/// The world point with the given coordinates in a plate's plane, and the inverse.
Eigen::Vector3d plane_point(const Plate& plate, const Eigen::Vector2d& at);
Eigen::Vector2d plane_coordinates(const Plate& plate, const Eigen::Vector3d& point);

/// Two different maps. Their results differ where the field acts between different planes; see docs/scenes.md.
enum class LensMode {
  gather,  ///< Parallel light leaves every pixel of the receiver against the light and bends with −s. The pixel shows
           ///< the point of the image where the light arrives. Every pixel is covered.
  scatter,  ///< Parallel light leaves the image towards the viewer, bends with +s, and carries its texture coordinate
            ///< to the receiver, where neighbouring landings form a mesh. Where the mesh folds, the sheet whose start
            ///< is nearest to that of straight light is seen; of equally near ones, the first.
};

/// The image.
struct LensImage {
  const Texture* texture = nullptr;
  Plate plane;         ///< Its resolution is not used.
  bool wraps = false;  ///< Whether the image repeats beyond the edges of the plane, as the texture does (affects only
                       ///< `gather`). If not, the texture should clamp, so that its edges are as sharp as the samples.
};

/// A narrow band of wavelengths, or a colour in RGB mode: spread evenly over the points of the image that it sees.
struct LensBand {
  double begin = 0, end = 0;  ///< Its ends, as places between the first (0) and the last (1) flexibility. They are
                              ///< equal outside a range.
  std::size_t channel = 0;    ///< The channel that it belongs to.
  double weight = 1;          ///< Its part of the channel's radiance; the sum over the bands of a channel is 1.
  Eigen::Vector3d color = Eigen::Vector3d::Zero();  ///< What a radiance of 1 adds to the picture (R, G, B).
};

/// Writes the radiances of a colour of the working space in the bands from `first` to `last`, without it; white has 1.
using LensRadiance =
    std::function<void(const Eigen::Vector3d& rgb, std::size_t first, std::size_t last, double* radiances)>;

/// The flow map has at most about so many vertices for each pixel. (A chaotic field could need any number.)
constexpr std::size_t starts_per_pixel = 2;

struct LensLight;

struct LensSettings {
  LensMode mode = LensMode::scatter;
  int samples = 1;       ///< Samples per pixel along x and along y; > 0.
  double reference = 0;  ///< The light that LensPicture::points describes: its place, from 0 to 1, between the first
                         ///< and the last flexibility.

  /// Flexibilities of the light: each on its own, or the two ends of a range.
  std::vector<double> flexibilities;
  bool range = false;

  const Surfaces* obstacles = nullptr;  ///< Whose obstacles the picture shows where it is transparent; null: none.

  Job* job = nullptr;  ///< As FlowSettings has it; its ranks draw the light together, too. That of a shard cannot be
                       ///< drawn.

  /// Called after each division of the map's quads, with a function that gives the light so far, which this process
  /// alone can draw. Empty: nobody wants it.
  std::function<void(const std::function<const LensLight&()>& so_far)> show;
};

/// Why a pixel sees the image, or does not: the ends of rays, where `image` landed on it, and `outside` beside it.
enum class LensEnd { image, missed, obstacle, step_limit, degenerate, outside };
static_assert(static_cast<int>(LensEnd::degenerate) == static_cast<int>(RayEnd::degenerate));
constexpr int lens_end_count = 6;
const char* to_string(LensEnd end);

/// What the centre of a pixel sees, at the reference.
struct LensPoint {
  LensEnd end = LensEnd::missed;  ///< In `scatter`, a pixel where no light lands is `missed`.

  // The rest is valid if `end` is `image` or `outside`.
  Eigen::Vector2d st = Eigen::Vector2d::Zero();         ///< Texture coordinates: (0, 0) lower left, (1, 1) upper right.
  Eigen::Matrix2d per_pixel = Eigen::Matrix2d::Zero();  ///< Columns: change of (s, t) per pixel along x and y.
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  ///< Displacement of the point seen from the point that
                                                           ///< straight light would show; world units.
  double log_magnification = 0;  ///< ln of the image's area as seen over its area: ln(σ₁σ₂) of ∂receiver/∂image.
  Eigen::Vector2d log_stretch{0, 0};  ///< ln σ₁ >= ln σ₂: stretch along the two principal directions.
  int folds = 0;  ///< `scatter`: number of sheets of the image that lie here. `gather`: number of places in the picture
                  ///< that show the point seen here. 1: no fold.
  double length = 0;  ///< Length of the ray, world units.
};

struct LensPicture {
  Film color;                     ///< Red, green and blue, multiplied by alpha.
  Film radiance;                  ///< If asked for: one plane for each channel, multiplied by alpha; without obstacles.
  std::vector<double> alpha;      ///< One value for each pixel: the part of it that sees the image, in the band that
                                  ///< sees most of it, or an obstacle. Where other bands do not see the image, their
                                  ///< light is missing, and the remaining light is coloured.
  std::vector<LensPoint> points;  ///< One for each pixel, row by row from the top.
  Eigen::Affine2d straight = Eigen::Affine2d::Identity();  ///< Maps pixels to the (s, t) that straight light shows.
  std::vector<EndCounts> ends;  ///< Number of vertices of the map by channel and end; `plate` counts light that met
                                ///< the plane of the image (gather) or of the receiver (scatter).
  TraceCounts counts;
  double seconds_drawing = 0;
};

/// What stands before and behind the field.
struct LensSetup {
  Plate receiver;  ///< With the resolution of the picture.
  LensImage image;
  Eigen::Vector3d direction;  ///< Of the light, unit.
};

/// The light between an image and a receiver, before it is drawn.
struct LensLight {
  LensSettings settings;
  LensSetup setup;
  /// From pixels to coordinates, in the image's plane, of the point that straight light shows.
  Eigen::Affine2d straight;
  LensMap planes;  ///< From the image to the receiver (scatter), or back (gather).
  Plate landings;  ///< The plate of `map`, in whose pixels its landings are.
  FlowMap map;     ///< Its starts are coordinates in the plane where light starts.
  double seconds_tracing = 0;
};

/// Traces the light.
/// @param surfaces  Bounds, cut and obstacles of the scene; its plate is not used.
/// `field` and the image's texture must outlive the result, which is the same for any number of threads and ranks.
/// @throw std::invalid_argument if a setting is out of range; Cancelled; as Ranks::all_gather.
LensLight trace_lens(const TensorField& field, const Surfaces& surfaces, const BendingSettings& bending,
                     const LensSetup& setup, const LensSettings& settings, const Progress& progress);

/// The picture that `bands` make up.
/// @param channels    Number of channels; the bands of a channel follow each other.
/// @param by_channel  Whether the result has the radiance of each channel.
/// @throw Cancelled; as Ranks::gather. The result is the same for any number of threads and ranks; the root has it.
LensPicture draw_lens(const LensLight& light, const std::vector<LensBand>& bands, const LensRadiance& radiance,
                      std::size_t channels, bool by_channel, const Progress& progress);

/// The obstacles of a scene alone. @throw std::runtime_error if Embree fails.
Geometry obstacles_of(const Surfaces& surfaces);

/// Adds the obstacles between the receiver and the plane of the image to a pixel of the receiver, where its alpha is
/// less than 1: as the viewer sees them along straight lines, in light from there.
/// @param samples  Of a pixel along x and along y. @param pixel  R, G and B, multiplied by alpha, and A.
void draw_obstacles(const Geometry& obstacles, const LensSetup& setup, int samples, const Eigen::Vector2i& at,
                    Eigen::Vector4d& pixel);

}  // namespace tensorray
