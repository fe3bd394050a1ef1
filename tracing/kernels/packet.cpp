#include "tracing/kernels/packet.h"

#include <cmath>
#include <optional>

#include <Eigen/Geometry>

#include "tracing/steps/exponential.h"

namespace tensorray::packets {

PacketMedium::PacketMedium(const TensorField& field_, const KernelSettings& settings_)
    : field(field_), settings(settings_), method(settings_.is_splitting ? splitting_method : splitting4_method) {
  const Eigen::Matrix3d M = field.to_index().linear();
  const Eigen::Matrix3d to_world = field.to_world().linear();
  adaptive = settings.step == 0;
  bounded = std::isfinite(settings.max_length);
  levels = field.levels() > 1;
  unit = static_cast<float>(std::exp2(std::round(std::log2(to_world.col(0).norm()))));
  longest_step = adaptive ? static_cast<float>(step_lengths::longest_composed) : settings.step;
  // No voxel is longer along any direction. (The norm is not less than the greatest singular value.)
  const float longest_voxel = static_cast<float>(to_world.norm());
  longest_kick = longest_step * static_cast<float>(method.longest_kick) * longest_voxel;
  constexpr double cells = TensorBrick::cells, most = 1e8;
  const double margin_of_steps = std::min(longest_step + 1.0, 1e9);  // A step may begin a little outside its brick.
  for (int axis = 0; axis < 3; ++axis) {
    for (int column = 0; column < 3; ++column) to_index[axis][column] = static_cast<float>(M(axis, column));
    first[axis] = static_cast<std::int32_t>(field.voxels().min()[axis]);
    last[axis] = static_cast<std::int32_t>(field.voxels().max()[axis]);
    slope[axis] = field.voxels().sizes()[axis] > 0 ? 1.0f : 0.0f;
    margin[axis] = static_cast<float>(field.index_bounds().max()[axis] - field.voxels().max()[axis]);
    first_near[axis] = 1;
    last_near[axis] = 0;
    if (!settings.geometry) continue;
    const double low = settings.surfaces.min()[axis] - margin_of_steps - cells;
    const double high = settings.surfaces.max()[axis] + margin_of_steps;
    first_near[axis] = static_cast<std::int32_t>(std::clamp(std::ceil(low / cells), -most, most));
    last_near[axis] = static_cast<std::int32_t>(std::clamp(std::floor(high / cells), -most, most));
  }
}

StrongKick strong_kick(const float T[9], float factor, const float v[3]) {
  const Eigen::Matrix3d A = double{factor} * Eigen::Map<const Eigen::Matrix3f>(T).cast<double>();
  const auto [direction, log_length] = exponential_direction(A, Eigen::Map<const Eigen::Vector3f>(v).cast<double>());
  StrongKick result;
  Eigen::Map<Eigen::Vector3f>(result.direction) = direction.cast<float>();
  result.log_radiance_scale = static_cast<float>(-3 * log_length);
  return result;
}

namespace {

/// The step of a lane, in index space: positions from its brick's first voxel, directions per unit of `time`.
struct LaneStep {
  Eigen::Vector3d from, from_direction, to, to_direction, origin;
  double time, turn, scale;

  LaneStep(const Packet& packet, int lane) : time(packet.time[lane]), scale(packet.scale[lane]) {
    Eigen::Vector3d turned;
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = packet.now.p[axis][lane];
      to[axis] = packet.next.p[axis][lane];
      from_direction[axis] = packet.now.u[axis][lane];
      to_direction[axis] = packet.next.u[axis][lane];
      turned[axis] = packet.next.v[axis][lane] - packet.now.v[axis][lane];
      origin[axis] = double{TensorBrick::cells} * packet.brick[axis][lane];
    }
    turn = turned.norm();
  }

  double voxels() const { return scale * time * from_direction.norm(); }

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

/// What the straight way of a length along a direction meets first.
std::optional<Hit> first_hit(const Geometry& geometry, const Eigen::Vector3d& from, const Eigen::Vector3d& along,
                             double length) {
  std::optional<Hit> hit;
  if (geometry.has_cut()) hit = geometry.crossing(Surface::cut, false, from, along, length);
  if (hit) length = hit->distance;
  const auto absorber = geometry.absorber(from, along, length);
  return absorber ? absorber : hit;
}

/// The chords of a step, world. Calls `use` with each and its number, until it returns true.
template <class Use>
void for_chords(const PacketMedium& medium, const LaneStep& step, int count, const Use& use) {
  const auto at = [&](int i) -> Eigen::Vector3d {
    const Eigen::Vector3d inner = i == 0 ? step.from : i == count ? step.to : step.at(path_weights(double(i) / count));
    return medium.field.to_world() * (step.origin + inner);
  };
  Segment chord{at(0), at(0)};
  for (int i = 0; i < count; ++i) {
    chord = {chord.to, at(i + 1)};
    if (use(i, chord)) return;
  }
}

}  // namespace

std::uint32_t near_surfaces(const PacketMedium& medium, const Packet& packet, std::uint32_t which) {
  Segment chords[16];
  std::uint32_t lanes[16], near = 0;
  int count = 0;
  const auto test = [&] {
    const std::uint32_t met = count > 0 ? medium.settings.geometry->may_meet(chords, count) : 0;
    for (int i = 0; i < count; ++i)
      if (met >> i & 1) near |= lanes[i];
    count = 0;
  };
  for (int lane = 0; lane < packet_rays; ++lane) {
    if (!(which >> lane & 1)) continue;
    const LaneStep step(packet, lane);
    if (!medium.settings.surfaces.intersects(step.bounds())) continue;
    for_chords(medium, step, chords_of(step.voxels(), step.turn), [&](int, const Segment& chord) {
      lanes[count] = 1u << lane;
      chords[count++] = chord;
      if (count == 16) test();
      return false;
    });
  }
  test();
  return near;
}

bool step_meets_surface(const PacketMedium& medium, const Packet& packet, int lane, bool leaves,
                        SurfaceLanding& landing) {
  const LaneStep step(packet, lane);
  landing.part = 0;
  const int count = chords_of(step.voxels(), step.turn);
  const Eigen::Vector3d start = medium.field.to_world() * (step.origin + step.from);
  for_chords(medium, step, count, [&](int i, const Segment& chord) {
    const double length = (chord.to - chord.from).norm();
    if (!(length > 0)) return false;
    const Eigen::Vector3d along = (chord.to - chord.from) / length;
    const auto hit = first_hit(*medium.settings.geometry, chord.from, along, length);
    if (!hit) return false;
    landing.hit = *hit;
    landing.point = chord.from + hit->distance * along;
    const Eigen::Vector3d normal = medium.field.to_world().linear().transpose() * hit->normal;
    landing.normal = {float(normal[0]), float(normal[1]), float(normal[2])};
    landing.to_plane = static_cast<float>(hit->normal.dot(landing.point - start));
    // A step that lands at its beginning is not none.
    landing.part = std::max(1e-30f, static_cast<float>((i + hit->distance / length) / count));
    if (leaves && !medium.field.contains(landing.point)) landing.part = 0;  // Behind the face of the extent.
    return true;
  });
  return landing.part > 0;
}

void add_inner_points(const PacketMedium& medium, const Packet& packet, int lane, std::vector<StepPoint>& points) {
  const LaneStep step(packet, lane);
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
    point.length = static_cast<float>(packet.length[lane] + t * step.time);
  }
}

}  // namespace tensorray::packets
