#pragma once
/// Reads a flow map at the points of a picture: which light starts, or lands, there.

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "tracing/flow/flow_map.h"

namespace tensorray {

/// The side of a flow map that a picture shows.
enum class FlowSide { starts, landings };

/// What a point of the picture sees: the light that starts or lands there.
struct FlowPoint {
  RayEnd end = RayEnd::missed;  ///< `plate`: the light landed, and the rest is valid.
  bool is_unknown = false;      ///< Starts: the mesh does not tell what happens to the light. It has to be traced.
  std::uint16_t sheets = 0;     ///< Number of sheets of the map that cover the point.
  Eigen::Vector2f other{0, 0};  ///< The other end of the light: its landing (pixels of the plate) or its start (beam).
  Eigen::Matrix2f jacobian = Eigen::Matrix2f::Identity();  ///< ∂landing/∂start.
  float length = 0;                                        ///< Length of the way, world units.
  float error = 0;                                         ///< Estimated error of the landing, pixels of the plate.
};

/// How a picture shows a flow map.
struct FlowPicture {
  FlowSide side = FlowSide::landings;
  Eigen::Vector2i resolution{1, 1};
  Eigen::Affine2d to_pixel = Eigen::Affine2d::Identity();  ///< From the side's coordinates to pixels of the picture.

  /// From pixels to the other end of straight light. Of several sheets, the point shows the one whose other end is
  /// nearest to this; of equally near ones, the first.
  Eigen::Affine2d straight = Eigen::Affine2d::Identity();
};

/// A range of a flow map's light: from one place among its wavelength samples to another. One wavelength if they agree.
struct FlowRange {
  double first = 0, last = 0;
};

/// The stretch of a linear map along its two principal directions.
struct PrincipalStretch {
  Eigen::Vector2d logs{0, 0};  ///< ln σ₁ >= ln σ₂ of the Jacobian; −∞ where it is singular, 0 where it is not finite.
  double angle = 0;  ///< Of the greater one, in the image of the map: from −π/2 to π/2 from its first axis.
};

PrincipalStretch principal_stretch(const Eigen::Matrix2d& jacobian);

/// Draws the triangles of a flow map, as a mesh over one side, on the samples of a picture, tile by tile. Between
/// corners the map is quadratic: it has the slopes that the neighbouring triangles have in common.
/// Immutable; any number of threads may draw. The map must outlive it.
class FlowView {
 public:
  static constexpr int tile_size = 16;               ///< Pixels.
  static constexpr std::size_t tiles_at_once = 512;  ///< That processes give each other in one message: no more than
                                                     ///< 200 MB, for pictures with 128 bands.

  /// @param ranges   The light that `draw` can draw.
  /// @param samples  `draw` has so many samples of a pixel along x and along y, or one.
  FlowView(const FlowMap& map, const FlowPicture& picture, std::vector<FlowRange> ranges, int samples);

  int tiles() const { return columns_ * rows_; }

  /// The pixels of a tile.
  Eigen::AlignedBox2i pixels(int tile) const;

  /// Sets `points` to what the samples of a tile see, row by row: n × n samples of each pixel, at the middles of its
  /// equal parts.
  /// @param range   Index in the list of ranges.
  /// @param place   The wavelength's place among the map's samples, in the range.
  /// @param wanted  By pixel of the tile: whether its samples are drawn. Empty: all are.
  void draw(int tile, int n, std::size_t range, double place, const std::vector<char>& wanted,
            std::vector<FlowPoint>& points) const;

 private:
  void find_jacobians();
  void sort_triangles(std::size_t range);
  void set_slope(double place, std::uint32_t vertex, Eigen::Matrix2f& jacobian, float& length) const;
  struct TileSamples;
  void draw_triangle(const FlowTriangle& triangle, double place, TileSamples& tile) const;

  /// Triangles that contain samples at some wavelength of a range, by the tile that they touch.
  struct Sorted {
    std::vector<std::uint32_t> first_of_tile;  // Ranges of `triangles`; one more than there are tiles.
    std::vector<std::uint32_t> triangles;
  };

  const FlowMap& map_;
  const FlowPicture picture_;
  const std::vector<FlowRange> ranges_;
  const int samples_;
  int columns_, rows_;
  std::size_t checks_;                      // Number of the map's wavelength samples that have Jacobians and lengths.
  std::vector<Eigen::Matrix2f> jacobians_;  // ∂landing/∂start of vertices, at these samples.
  std::vector<Sorted> sorted_;              // By range.
};

}  // namespace tensorray
