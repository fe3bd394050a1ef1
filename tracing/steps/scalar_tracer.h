#pragma once
/// Traces one ray at a time in double precision, by any method and in any field. This is the reference for the packets
/// of packet_kernel.h, and it does what packets leave to it. A step is taken in `Tracer::bend`.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"
#include "tracing/steps/bending_steps.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {

using bending_steps::RayMedium;
using bending_steps::State;

/// The last part of a landing is straight where it is shorter than this part of the step. A path that turns by φ in a
/// step h leaves the straight line by d² φ / 2h over a way d: with 1e-3, by half a millionth of h for each radian,
/// which is less than the error of a step of `splitting4`. Other methods land up to rounding.
constexpr double composed_landing = 1e-3, other_landing = 1e-10;

inline double deviator_norm(const Eigen::Matrix3d& T) {
  const double third = T.trace() / 3;
  return std::sqrt(std::max(0.0, T.squaredNorm() - 3 * third * third));
}

/// How far a ray has been traced.
struct Travelled {
  double length = 0;  // Length of the path so far, world units.
  Eigen::RowVector2d length_change = Eigen::RowVector2d::Zero();
  std::uint32_t steps = 0;
  int grazes = 0;  // How often it has left the cut after hardly any way.
};

/// Traces one ray, alone (N = 1) or with its derivatives along two parameters (N = 3). The volume is the field's
/// extent, a convex box, cut by a mesh of any shape.
template <int N>
class Tracer {
 public:
  Tracer(const TensorField& field, const Geometry& geometry, const BendingSettings& settings)
      : field_(field), geometry_(geometry), settings_(settings), sampler_(field) {}

  /// Follows a ray to its end. Afterwards `state` is the end of the ray.
  /// @param strength  σ of the ray: see `strength_of`.
  /// @param record    The points on its path are added to it; null: the ray is not recorded.
  RayEnd trace(const State<N>& start, double strength, PathPoints* record) {
    medium_.strength = strength;
    auto end = approach(start, record);
    if (!std::isfinite(strength)) return RayEnd::degenerate;
    while (!end) end = follow();
    return *end;
  }

  /// Follows a ray to the point where it begins to bend. Returns nothing there; if the ray ends first, returns why.
  std::optional<RayEnd> approach(const State<N>& start, PathPoints* record) {
    ray_ = normalized(start);
    record_ = record;
    length_ = 0;
    length_change_.setZero();
    steps_ = 0;
    grazes_ = 0;
    if (direction().isZero() || !position().allFinite()) return RayEnd::degenerate;
    if (!field_.contains(position()))
      if (const auto end = reach_box()) return end;
    const CutAhead ahead = geometry_.cut_ahead(position(), direction());
    if (ahead.is_inside) return std::nullopt;
    const auto end = cross_box(ahead.entry);
    if (!end) ++steps_;
    return end;
  }

  /// Continues a ray at `state`. Call `follow` next if it bends there, `leave` if it is on the face of the box, or
  /// `leave_cut`.
  void take_over(const State<N>& state, double strength, const Travelled& travelled, PathPoints* record) {
    ray_ = state;
    record_ = record;
    medium_.strength = strength;
    length_ = travelled.length;
    length_change_ = travelled.length_change;
    steps_ = travelled.steps;
    grazes_ = travelled.grazes;
  }

  /// Follows the ray from a point in the field to its end, or to where it has left the cut and enters it again; then
  /// returns nothing. `first_step` is the length of the first step, world units;
  /// 0: as any other step. `first_end` is where this step of `splitting4` would end, in single precision; null: not
  /// known. Where it tells what the step meets, only the part of the step up to there is taken.
  std::optional<RayEnd> follow(double first_step = 0, const State<N>* first_end = nullptr) {
    const double before = length_;
    const auto end = bend(first_step, first_end);
    return end ? end : leave_cut(length_ - before);
  }

  /// Follows the ray from the cut, through free space, to its end or to where it enters the cut again; then returns
  /// nothing. A ray that grazes the cut might enter and leave it at one point for ever, as chords do not go quite the
  /// way of light: it is moved on, each time twice as far, and so out of the volume after twenty times.
  /// @param way  Its length since it entered the cut.
  std::optional<RayEnd> leave_cut(double way) {
    ++steps_;
    Hit onwards;
    onwards.distance = std::ldexp(geometry_.margin() * (1 + steps_ / 8.0), grazes_);
    const bool grazes = way <= onwards.distance;
    if (grazes) {
      ++grazes_;
      if (const auto end = reach(onwards)) return end;
    }
    const bool is_inside = grazes && field_.contains(position()) && geometry_.inside_cut(position(), direction());
    const auto entry = is_inside ? std::nullopt : geometry_.crossing(Surface::cut, true, position(), direction());
    const auto end = is_inside ? std::nullopt : cross_box(entry);
    if (!end) ++steps_;
    return end;
  }

  /// Follows the ray from a face of the volume, through free space, to its end.
  RayEnd leave() {
    const auto hit = geometry_.absorber(position(), direction());
    if (!hit || ends_before(hit->distance)) return miss();
    go_straight(*hit);
    return end_on(hit->surface);
  }

  /// Records the current point, if the ray is recorded.
  void record(bool in_field) {
    if (record_) record_->push_back({position(), direction(), length_, in_field});
  }

  /// The Frobenius norm of the deviator of T at the current point.
  double deviator_here() {
    medium_.sample(ray_.P);
    return deviator_norm(medium_.T);
  }

  const State<N>& state() const { return ray_; }
  Travelled travelled() const { return {length_, length_change_, steps_, grazes_}; }
  std::uint64_t samples() const { return sampler_.samples(); }

 private:
  /// What a step meets; `none`: nothing.
  enum class Event { none, absorber, leaves_box, leaves_cut };

  /// Where a step meets something: the distance of its plane from the beginning of the step, along its normal, and the
  /// length of the step up to there, approximately.
  struct Landing {
    Hit hit;
    double to_plane = 0, length = 0;
  };

  Eigen::Vector3d position() const { return ray_.position(); }
  Eigen::Vector3d direction() const { return ray_.direction(); }
  RayEnd end_on(Surface surface) const { return surface == Surface::plate ? RayEnd::plate : RayEnd::obstacle; }
  State<N> step(double h, State<N>& error) { return advance(settings_.method, medium_, ray_, h, error); }
  double length_of_voxel() const { return 1 / (field_.to_index().linear() * direction()).norm() / scale_; }
  bool ends_before(double distance) const { return length_ + distance >= settings_.max_length; }
  bool is_composed() const { return settings_.method == BendingMethod::splitting4; }

  /// The derivatives are those at equal arc length. From a surface on, they are those of the points where rays cross
  /// it, because a ray's direction begins (or ceases) to change there. (If light bends on one side only, neighbouring
  /// rays begin to bend earlier or later. Without this correction the derivatives would lack a finite term.)
  void meet_surface(const Eigen::Vector3d& normal, bool bends) {
    if constexpr (N > 1) {
      const double approach = normal.dot(direction());
      if (!(std::abs(approach) > 0)) return;  // Light along a surface does not cross it.
      const State<N> flow = bends ? medium_.derivative(ray_) : State<N>{ray_.V, Eigen::Matrix<double, 3, N>::Zero(), 0};
      for (int i = 1; i < N; ++i) {
        const double later = -normal.dot(ray_.P.col(i)) / approach;
        ray_.P.col(i) += later * flow.P.col(0);
        ray_.V.col(i) += later * flow.V.col(0);
        length_change_[i - 1] += later;
      }
    }
  }

  /// Moves the ray straight to a surface, in free space.
  void go_straight(const Hit& hit) {
    record(false);
    ray_.P += hit.distance * ray_.V;
    length_ += hit.distance;
    meet_surface(hit.normal, false);
    record(false);
  }

  /// Ends a ray that meets nothing in free space.
  RayEnd miss() {
    if (std::isfinite(settings_.max_length)) {
      Hit end;
      end.distance = settings_.max_length - length_;
      go_straight(end);
    }
    return RayEnd::missed;
  }

  /// Moves the ray, in free space, to the nearest absorber or to its entry into the volume. Returns nothing if it
  /// enters.
  std::optional<RayEnd> reach(const std::optional<Hit>& entry) {
    const double free_way = entry ? entry->distance : Geometry::infinite;
    const auto hit = geometry_.absorber(position(), direction(), free_way);
    if (ends_before(hit ? hit->distance : free_way)) return miss();
    if (hit) {
      go_straight(*hit);
      return end_on(hit->surface);
    }
    go_straight(*entry);
    return std::nullopt;
  }

  /// Moves the ray from outside to the volume. Rounding may put light from very far beside the face that it meets; it
  /// is then moved to the face.
  std::optional<RayEnd> reach_box() {
    if (const auto end = reach(geometry_.crossing(Surface::bounds, true, position(), direction()))) return end;
    constexpr double rounding = 1e-6;  // Voxels.
    const Eigen::AlignedBox3d& box = field_.index_bounds();
    const Eigen::Vector3d index = field_.to_index() * position();
    if (box.squaredExteriorDistance(index) > rounding * rounding)
      ray_.P.col(0) = field_.to_world() * index.cwiseMax(box.min()).cwiseMin(box.max());
    return std::nullopt;
  }

  /// Moves the ray, which is within the box and outside the cut, straight to its entry into the cut, to an absorber, or
  /// out of the box. Returns nothing if it enters the cut.
  std::optional<RayEnd> cross_box(const std::optional<Hit>& entry) {
    if (!entry) return leave();
    const auto exit = geometry_.crossing(Surface::bounds, false, position(), direction());
    return entry->distance <= (exit ? exit->distance : 0) ? reach(entry) : leave();
  }

  /// The length of an automatic step, in voxels.
  double automatic_step() const {
    using namespace step_lengths;
    const double longest = is_composed() ? longest_composed : longest_automatic;
    const double strongest = is_composed() ? strongest_composed : strongest_kick;
    const double kick = std::abs(medium_.strength) * deviator_norm(medium_.T) * voxel_;
    if (kick * longest <= strongest) return longest;
    const double shortest = settings_.method == BendingMethod::splitting ? shortest_splitting : 0.0;
    return std::max(strongest / kick, shortest);
  }

  /// The path at a part of a step to `next`, or its derivative by this part.
  Eigen::Vector3d between(const State<N>& next, double h, const PathWeights& w) const {
    return w.from * position() + h * w.from_direction * direction() + w.to * next.position() +
           h * w.to_direction * next.direction();
  }

  /// Records the path between the ray and `next`.
  void record_inner(const State<N>& next, double h) {
    if (!record_) return;
    const int count = is_composed() ? pieces_of(h / voxel_) : 1;
    for (int i = 1; i < count; ++i) {
      const double t = double(i) / count;
      const Eigen::Vector3d point = between(next, h, path_weights(t)), along = between(next, h, path_slopes(t));
      record_->push_back({point, along.normalized(), length_ + t * h, true});
    }
  }

  /// What a chord of the path meets first. `hit.distance` is along the chord.
  Event meet(const Eigen::Vector3d& from, const Eigen::Vector3d& to, Hit& hit) const {
    const bool leaves_box = !field_.contains(to);
    const bool may_absorb = geometry_.may_absorb(from, to);
    if (!leaves_box && !may_absorb && !geometry_.has_cut()) return Event::none;

    const Eigen::Vector3d chord = to - from;
    double length = chord.norm();
    const Eigen::Vector3d along = length > 0 ? Eigen::Vector3d(chord / length) : direction();
    Event event = Event::none;
    if (leaves_box) {
      const auto exit = geometry_.crossing(Surface::bounds, false, from, along, length);
      hit = exit ? *exit : Hit{};  // If rounding hides the face from a very short chord, the ray leaves at once.
      length = hit.distance;
      event = Event::leaves_box;
    }
    if (geometry_.has_cut())
      if (const auto exit = geometry_.crossing(Surface::cut, false, from, along, length)) {
        hit = *exit;
        length = hit.distance;
        event = Event::leaves_cut;
      }
    if (may_absorb)
      if (const auto absorber = geometry_.absorber(from, along, length)) {
        hit = *absorber;
        event = Event::absorber;
      }
    return event;
  }

  /// Improves the length of a landing by the path of the whole step to `next`.
  void aim_along_path(const State<N>& next, double h, Landing& landing) const {
    double t = landing.length / h;
    for (int i = 0; i < 3; ++i) {
      const double way = landing.hit.normal.dot(between(next, h, path_weights(t)) - position());
      const double change = (landing.to_plane - way) / landing.hit.normal.dot(between(next, h, path_slopes(t)));
      if (!(std::abs(change) <= 1)) return;  // The light is nearly parallel to the plane.
      t = std::clamp(t + change, 0.0, 1.0);
    }
    landing.length = t * h;
  }

  /// What the step from the ray to `next` meets first, on the chords that it is divided into.
  Event meet(const State<N>& next, double h, Landing& landing) const {
    const int count = is_composed() ? chords_of(h / voxel_, (next.direction() - direction()).norm()) : 1;
    const double part = h / count;
    const Eigen::Vector3d start = position();
    Eigen::Vector3d from = start;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d to =
          i + 1 == count ? Eigen::Vector3d(next.position()) : between(next, h, path_weights((i + 1.0) / count));
      Hit& hit = landing.hit;
      const Event event = meet(from, to, hit);
      if (event != Event::none) {
        const Eigen::Vector3d chord = to - from;
        landing.to_plane = hit.normal.dot(from - start) + hit.normal.dot(chord) / chord.norm() * hit.distance;
        landing.length = part * i + part * hit.distance / chord.norm();
        if (is_composed()) aim_along_path(next, h, landing);
        return event;
      }
      from = to;
    }
    return Event::none;
  }

  /// Repeats the step with the length that ends on the plane of `hit` (Newton's method), which keeps the order.
  /// @return that length.
  double land(double h, const Landing& landing) {
    const Hit& hit = landing.hit;
    if (hit.normal.isZero()) return 0;
    const Eigen::Vector3d start = position();
    double length = landing.length;
    State<N> unused, landed = ray_;
    for (int i = 0; i < 4; ++i) {
      landed = step(length, unused);
      double gap = (landing.to_plane - hit.normal.dot(landed.position() - start)) / hit.normal.dot(landed.direction());
      if (hit.surface == Surface::cut) gap = std::max(gap, -length);  // Not back, to cross it there again.
      if (!(std::abs(gap) <= h)) break;                               // The light is nearly parallel to the plane.
      if (std::abs(gap) <= (is_composed() ? composed_landing : other_landing) * h || i == 3) {
        landed.P += gap * landed.V;
        length += gap;
        break;
      }
      length = std::clamp(length + gap, 0.0, h);
    }
    record_inner(landed, length);
    ray_ = landed;
    meet_surface(hit.normal, true);
    return length;
  }

  /// The limit of adaptive steps, in voxels.
  double longest_step() const {
    using namespace step_lengths;
    return is_composed() ? longest_composed : settings_.step > 0 ? settings_.step : longest_adaptive;
  }

  /// Finds the voxel of the leaf that was sampled last. An adaptive step keeps its length from leaf to leaf, or is
  /// shortened.
  void find_voxel() {
    const double scale = sampler_.scale();
    if (scale != scale_) adaptive_step_ = std::min(adaptive_step_ * scale / scale_, longest_step());
    scale_ = scale;
    voxel_ = length_of_voxel();
  }

  /// Sets the next adaptive step from the error of this one.
  /// @return whether the step must be repeated, because of its error, or because it was too long for a finer leaf into
  /// which it led: samples might miss what is there.
  bool control_step(const State<N>& error) {
    using namespace step_lengths;
    const double finer = std::max(1.0, sampler_.take_finest_scale() / scale_);
    const double excess =
        std::max(error.position().norm() / (scale_ * voxel_), error.direction().norm()) / settings_.tolerance;
    const double order = is_composed() ? composed_order : runge_kutta(settings_.method)->order;
    const double factor =
        (is_composed() ? composed_safety : safety) * std::pow(std::max(excess, min_excess), -1 / order);
    const double growth = factor > min_growth ? std::min(factor, max_growth) : min_growth;
    const double longest = longest_step() / finer;
    const bool is_too_long = finer > 1 && adaptive_step_ > longest_into_finer * longest;
    adaptive_step_ = std::clamp(adaptive_step_ * growth, shortest_adaptive, longest);
    return excess > 1 || is_too_long;
  }

  /// The length of the next step, world units. If nothing in the brick bends light, the step ends a little beyond the
  /// brick. (Euler's method, Eq. 3–4, does not skip bricks: the trace of T affects it.)
  double next_step() {
    const double way =
        settings_.method == BendingMethod::euler ? 0 : sampler_.way_through_straight_brick(position(), direction());
    const bool stages = runge_kutta(settings_.method) != nullptr;
    if (way > 0)
      return way + (stages ? step_lengths::past_straight_brick_by_stages : step_lengths::past_straight_brick) * voxel_;
    if (is_controlled_) return voxel_ * adaptive_step_;
    return voxel_ * (settings_.step == 0 ? automatic_step() : settings_.step);
  }

  /// Steps through the field to an absorber, out of the box or out of the cut. Returns nothing if the ray leaves the
  /// cut.
  std::optional<RayEnd> bend(double first_step, const State<N>* first_end) {
    if (!(first_step > 0) || field_.levels() > 1) medium_.sample(ray_.P);  // For `automatic_step`, and the leaf.
    find_voxel();
    adaptive_step_ = first_step > 0 ? first_step / voxel_ : settings_.step == 0 ? automatic_step() : settings_.step;
    record(true);
    while (true) {
      if (steps_ >= static_cast<std::uint32_t>(settings_.max_steps)) return RayEnd::step_limit;
      ++steps_;
      find_voxel();
      const double wanted = first_step > 0 ? first_step : next_step();
      const double rest = settings_.max_length - length_, h = std::min(wanted, rest);
      first_step = 0;
      Landing landing;
      Event event = first_end && is_composed() && h == wanted ? meet(*first_end, h, landing) : Event::none;
      first_end = nullptr;
      State<N> next, error;
      if (event == Event::none) {
        sampler_.take_finest_scale();  // Of what was before this step.
        next = step(h, error);
        if (next.direction().isZero() || !next.position().allFinite()) return RayEnd::degenerate;
        if (is_controlled_ && control_step(error) && wanted > step_lengths::shortest_adaptive * voxel_) continue;
        event = meet(next, h, landing);
      }
      if (event == Event::none) {
        record_inner(next, h);
        ray_ = next;
        length_ += h;
        record(true);
        if (h == rest) return RayEnd::missed;
        continue;
      }
      length_ += land(h, landing);
      if (direction().isZero() || !position().allFinite()) return RayEnd::degenerate;
      record(true);
      if (event == Event::absorber) return end_on(landing.hit.surface);
      if (event == Event::leaves_box) return leave();
      return std::nullopt;
    }
  }

  const TensorField& field_;
  const Geometry& geometry_;
  const BendingSettings& settings_;
  const bool is_controlled_ = is_adaptive(settings_.method, settings_.step);
  TensorSampler sampler_;

  RayMedium<N> medium_{sampler_, 0};
  State<N> ray_;
  PathPoints* record_ = nullptr;      // Null: the ray is not recorded.
  double length_ = 0;                 // Length of the path so far, world units.
  Eigen::RowVector2d length_change_;  // Derivatives of length_.
  double scale_ = 1;                  // Of the leaf: LeafBrick::scale.
  double voxel_ = 0;                  // Length of a voxel of the leaf along the ray, world units.
  double adaptive_step_ = 0;          // The next step by the error control, in voxels.
  std::uint32_t steps_ = 0;
  int grazes_ = 0;
};

/// σ = s · scale of ray i of a batch. Only this function uses the field's scale.
inline double strength_of(const RayBatch& batch, std::size_t i, const BendingSettings& settings) {
  return batch.flexibility[i] * settings.scale;
}

/// The start of a ray of a batch; N = 3 if the batch has differentials.
template <int N>
State<N> start_of(const RayBatch& batch, std::size_t i) {
  State<N> start;
  start.P.col(0) = batch.position[i];
  start.V.col(0) = batch.direction[i];
  if constexpr (N == 3) {
    start.P.template rightCols<2>() = batch.differentials[i].position;
    start.V.template rightCols<2>() = batch.differentials[i].direction;
  }
  return start;
}

/// Writes the end of the tracer's ray to the batch.
template <int N>
void set_end(RayBatch& batch, std::size_t i, RayEnd end, const Tracer<N>& tracer) {
  const Travelled travelled = tracer.travelled();
  batch.end[i] = end;
  batch.position[i] = tracer.state().position();
  batch.direction[i] = tracer.state().direction();
  if constexpr (N == 3)
    batch.differentials[i] = {tracer.state().P.template rightCols<2>(), tracer.state().V.template rightCols<2>(),
                              travelled.length_change};
  if (batch.wants_log_radiance_scale) batch.log_radiance_scale[i] = tracer.state().log_radiance_scale;
  batch.length[i] = travelled.length;
  batch.steps[i] = travelled.steps;
}

/// Sets `tensor` and `change` of the points of a path that are in the field, in double precision.
/// @param strength  σ of light in the path's direction.
inline void set_tensors(const TensorField& field, double strength, PathPoints& points) {
  TensorSampler sampler(field);
  RayMedium<1> medium{sampler, strength};
  for (PathPoint& point : points) {
    if (!point.in_field) continue;
    point.change = medium.derivative({point.position, point.direction, 0}).V;
    point.tensor = medium.T;
  }
}

}  // namespace tensorray
