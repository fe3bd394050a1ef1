#pragma once
/// Finds where light meets the surfaces of a scene: bounds, cut, plate and obstacles.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "base/geometry/triangle_mesh.h"
#include "renderer/surfaces/plate.h"
#include "renderer/surfaces/triangle_scene.h"

namespace tensorray {

enum class Surface : std::uint8_t {
  bounds,    ///< The box of the volume.
  cut,       ///< A closed mesh; the volume is inside it.
  plate,     ///< Collects light (scene key: receiver); or the body that does.
  obstacle,  ///< Absorbs light.
};

struct Hit {
  double distance = 0;  ///< Along the unit direction, world units, in double precision; see Geometry.
  Surface surface = Surface::plate;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< Unit, geometric; outwards for bounds, cut and obstacles.
};

/// Of the cut, ahead of light that goes straight from a point.
struct CutAhead {
  bool is_inside = false;    ///< Whether the light is inside just beyond the point.
  std::optional<Hit> entry;  ///< If not, where it enters.
};

/// The parts of a Geometry.
struct Surfaces {
  TriangleMesh bounds;              ///< Closed, convex; normals point outwards.
  std::optional<TriangleMesh> cut;  ///< Closed; normals point outwards.
  std::optional<Plate> plate;
  std::vector<TriangleMesh> obstacles = {};
  std::optional<TriangleMesh> body = std::nullopt;  ///< Collects light instead of the plate.
};

/// Immutable Embree scenes. Any number of threads may query them at once.
///
/// Embree finds the triangle in single precision; the distance to the triangle's plane is then computed in double
/// precision. Light may start anywhere. A ray from so far away that double precision does not resolve a surface does
/// not meet it. A surface that lies behind the origin by less than `margin` counts as a hit at distance 0: light that
/// starts on a plate, or leaves the volume through one, meets it.
class Geometry {
 public:
  /// @throw std::invalid_argument naming the surface if it is not finite, or too far from the volume for single
  /// precision (1e12 times the volume's size); std::runtime_error if Embree fails (out of memory, unsupported
  /// processor).
  explicit Geometry(Surfaces surfaces);
  ~Geometry();
  Geometry(Geometry&&) noexcept;
  Geometry& operator=(Geometry&&) noexcept;

  /// The nearest plate or obstacle within `max_distance` along the unit `direction`, from either side.
  std::optional<Hit> absorber(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                              double max_distance = infinite) const;

  /// Returns false only if no plate or obstacle can meet the segment; cheap.
  bool may_absorb(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

  /// Bits of those of up to 16 straight ways that may leave the cut or meet an absorber: of all that do, and of few
  /// others. It is fastest where they lie together.
  std::uint32_t may_meet(const Segment* ways, int count) const;

  /// A box around all parts of plates and obstacles that may lie in `region`; empty if there are none.
  Eigen::AlignedBox3d absorbers_within(const Eigen::AlignedBox3d& region) const;

  /// Where light first crosses the bounds or the cut in the given sense (inwards or outwards). Crossings in the other
  /// sense are skipped. A mesh may consist of closed shells that touch or overlap: of the cut, only what separates
  /// inside from outside is crossed. Inside is where the cut surrounds a point more often than not at all; surfaces
  /// that light meets within `margin` of each other count as one.
  std::optional<Hit> crossing(Surface surface, bool inwards, const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction, double max_distance = infinite) const;

  double margin() const;  ///< World units; about 1e-6 of the volume's size.

  const Surfaces& surfaces() const;
  bool has_cut() const { return surfaces().cut.has_value(); }

  /// If there is no cut, all is inside.
  CutAhead cut_ahead(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const;
  bool inside_cut(const Eigen::Vector3d& point, const Eigen::Vector3d& direction = generic_directions[0]) const {
    return cut_ahead(point, direction).is_inside;
  }

  /// Unit directions that are unlikely to meet an edge.
  static const std::array<Eigen::Vector3d, 3> generic_directions;

  static constexpr double infinite = std::numeric_limits<double>::infinity();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tensorray
