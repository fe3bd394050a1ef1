#include "integrators/packets/packet_path.h"

#include <cmath>

#include <Eigen/Geometry>

#include "integrators/steps/composition.h"

namespace tensorray::packets {
namespace {

/// The step of a lane, in index space: positions from its brick's first voxel, directions per unit of `time`.
struct LaneStep {
  Eigen::Vector3d from, from_direction, to, to_direction, origin;
  double time, turn;

  LaneStep(const PacketMedium& medium, const Packet& packet, int lane) : time(packet.time[lane]) {
    const auto& u = medium.uniform ? packet.v : packet.u;
    const auto& u_next = medium.uniform ? packet.v_next : packet.u_next;
    Eigen::Vector3d turned;
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = packet.p[axis][lane];
      to[axis] = packet.p_next[axis][lane];
      from_direction[axis] = u[axis][lane];
      to_direction[axis] = u_next[axis][lane];
      turned[axis] = packet.v_next[axis][lane] - packet.v[axis][lane];
      origin[axis] = double{TensorBrick::cells} * packet.brick[axis][lane];
    }
    turn = turned.norm();
  }

  double voxels() const { return time * from_direction.norm(); }

  /// A box around the path, of the control points of its Bézier curve, with a margin for rounding.
  Eigen::AlignedBox3d bounds() const {
    constexpr double margin = 0.01;  // Voxels.
    Eigen::AlignedBox3d box(from.cwiseMin(to), from.cwiseMax(to));
    box.extend(from + time / 3 * from_direction).extend(to - time / 3 * to_direction);
    return {origin + box.min() - Eigen::Vector3d::Constant(margin),
            origin + box.max() + Eigen::Vector3d::Constant(margin)};
  }

  /// The combination of its ends with the weights of path_weights, or of path_slopes.
  Eigen::Vector3d at(const PathWeights& w) const {
    return w.from * from + w.to * to + time * (w.from_direction * from_direction + w.to_direction * to_direction);
  }
};

}  // namespace

bool step_meets_surface(const PacketMedium& medium, const Packet& packet, int lane) {
  const LaneStep step(medium, packet, lane);
  if (!medium.settings.surfaces.intersects(step.bounds())) return false;
  const int count = medium.composed ? chords_of(step.voxels(), step.turn) : 1;
  Eigen::Vector3d begin = step.from;
  for (int i = 1; i <= count; ++i) {
    const Eigen::Vector3d end = i == count ? step.to : step.at(path_weights(double(i) / count));
    if (medium.meets_surface(step.origin + begin, step.origin + end)) return true;
    begin = end;
  }
  return false;
}

void add_inner_points(const PacketMedium& medium, const Packet& packet, int lane, std::vector<StepPoint>& points) {
  const LaneStep step(medium, packet, lane);
  const int count = pieces_of(step.voxels());
  for (int i = 1; i < count; ++i) {
    const double t = double(i) / count;
    const Eigen::Vector3d position = step.at(path_weights(t));
    const Eigen::Vector3d direction = (medium.field.to_world().linear() * step.at(path_slopes(t))).normalized();
    StepPoint& point = points.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      point.brick[axis] = packet.brick[axis][lane];
      point.position[axis] = static_cast<float>(position[axis]);
      point.direction[axis] = static_cast<float>(direction[axis]);
    }
    point.length = static_cast<float>((packet.length[lane] + t * step.time) * (medium.uniform ? medium.voxel : 1.0f));
  }
}

}  // namespace tensorray::packets
