#include "integrators/bending.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "integrators/bending_steps.h"

namespace tensorray {
namespace {

using namespace bending_steps;

constexpr double longest_step = 0.5;         // Automatic steps, in voxels ...
constexpr double shortest_step = 1.0 / 64;   // ... of the splitting, which is stable however strong the field.
constexpr double strongest_kick = 0.2;       // s h ‖T − ⅓ tr(T) I‖ of an automatic step.
constexpr double longest_adaptive_step = 2;  // In voxels: so that no voxel is stepped over.
constexpr double shortest_adaptive_step = 1e-6;

bool adaptive(BendingMethod method) { return method == BendingMethod::bs23 || method == BendingMethod::dopri5; }
int order(BendingMethod method) { return method == BendingMethod::bs23 ? 3 : 5; }

/// What is kept of a ray's way; null: nothing.
struct Recording {
  Way* way = nullptr;
  Track* track = nullptr;
};

/// One ray on its way, alone (N = 1) or with its derivatives along two parameters (N = 3). The volume is the field's
/// extent, a convex box, cut by a mesh of any shape.
template <int N>
class Tracer {
 public:
  Tracer(const TensorField& field, const Geometry& geometry, const BendingSettings& settings)
      : field_(field), geometry_(geometry), settings_(settings), sampler_(field) {}

  /// Follows a ray to its end; `state` says where that is, and `recording` how it came there.
  RayEnd trace(const State<N>& start, double flexibility, const Recording& recording);

  const State<N>& state() const { return ray_; }
  double length() const { return length_; }
  const Eigen::RowVector2d& length_change() const { return length_change_; }
  std::uint32_t steps() const { return steps_; }
  std::uint64_t samples() const { return sampler_.samples(); }

 private:
  /// What light meets next; `none` while it travels freely.
  enum class Event { none, absorber, leaves_box, leaves_cut };

  RayEnd follow();
  std::optional<RayEnd> reach_box();
  std::optional<RayEnd> cross_box();
  std::optional<RayEnd> bend();
  RayEnd leave();
  RayEnd miss();

  Eigen::Vector3d position() const { return ray_.position(); }
  Eigen::Vector3d direction() const { return ray_.direction(); }
  RayEnd end_on(Surface surface) const { return surface == Surface::plate ? RayEnd::plate : RayEnd::obstacle; }
  State<N> step(double h, State<N>& error) { return advance(settings_.method, medium_, ray_, h, error); }
  double length_of_voxel() const { return 1 / (field_.to_index().linear() * direction()).norm(); }
  double automatic_step() const;
  double control_step(const State<N>& error);
  void record(bool in_field);
  void go_straight(const Hit& hit);
  bool ends_before(double distance) const { return length_ + distance >= settings_.max_length; }
  void meet_surface(const Eigen::Vector3d& normal, bool bends);
  Event meet(const State<N>& next, Hit& hit) const;
  double land(const State<N>& next, double h, const Hit& hit);

  const TensorField& field_;
  const Geometry& geometry_;
  const BendingSettings& settings_;
  TensorSampler sampler_;

  Medium<N> medium_{sampler_, 0};
  State<N> ray_;
  Recording recording_;
  double length_ = 0;                 // Of the way so far, world units.
  Eigen::RowVector2d length_change_;  // Its derivatives.
  double voxel_ = 0;                  // Length of a voxel along the ray, world units.
  double adaptive_step_ = 0;          // What the error control asks for next, in voxels.
  std::uint32_t steps_ = 0;
};

/// Derivatives are those at equal arc length; from a surface on they are those of the rays' crossings of it, as a ray's
/// direction begins, or ceases, to change there. (Where light bends on one side only, its neighbours do so earlier or
/// later: without this the derivatives would miss a finite amount.)
template <int N>
void Tracer<N>::meet_surface(const Eigen::Vector3d& normal, bool bends) {
  if constexpr (N > 1) {
    const double approach = normal.dot(direction());
    if (!(std::abs(approach) > 0)) return;  // Light along a surface has no crossing to speak of.
    const State<N> flow = bends ? medium_.derivative(ray_) : State<N>{ray_.V, Eigen::Matrix<double, 3, N>::Zero()};
    for (int i = 1; i < N; ++i) {
      const double later = -normal.dot(ray_.P.col(i)) / approach;
      ray_.P.col(i) += later * flow.P.col(0);
      ray_.V.col(i) += later * flow.V.col(0);
      length_change_[i - 1] += later;
    }
  }
}

/// Leaves the medium as last sampled: the steps are the same, recorded or not.
template <int N>
void Tracer<N>::record(bool in_field) {
  if (recording_.track) recording_.track->push_back({position(), length_});
  if (!recording_.way) return;
  Waypoint here;
  here.position = position();
  here.direction = direction();
  here.length = length_;
  here.in_field = in_field;
  if (in_field) {
    Medium<1> medium{sampler_, medium_.s};
    here.change = medium.derivative({here.position, here.direction}).V;
    here.tensor = medium.T;
  }
  recording_.way->push_back(here);
}

/// In free space, to a surface.
template <int N>
void Tracer<N>::go_straight(const Hit& hit) {
  record(false);
  ray_.P += hit.distance * ray_.V;
  length_ += hit.distance;
  meet_surface(hit.normal, false);
  record(false);
}

/// In free space, where nothing is met. Behind a cut that is still within the volume.
template <int N>
RayEnd Tracer<N>::miss() {
  if (std::isfinite(settings_.max_length)) {
    Hit end;
    end.distance = settings_.max_length - length_;
    go_straight(end);
  } else if (recording_.track && field_.contains(position())) {
    if (const auto exit = geometry_.crossing(Surface::bounds, false, position(), direction())) {
      recording_.track->push_back({position(), length_});
      recording_.track->push_back({position() + exit->distance * direction(), length_ + exit->distance});
    }
  }
  return RayEnd::missed;
}

/// In free space before the volume: to an absorber, or to the face of the box where light enters.
template <int N>
std::optional<RayEnd> Tracer<N>::reach_box() {
  const auto entry = geometry_.crossing(Surface::bounds, true, position(), direction());
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

/// In free space behind the volume, which is convex: straight light does not meet it again.
template <int N>
RayEnd Tracer<N>::leave() {
  const auto hit = geometry_.absorber(position(), direction());
  if (!hit || ends_before(hit->distance)) return miss();
  go_straight(*hit);
  return end_on(hit->surface);
}

/// Within the box, outside of the cut: straight on to the cut, an absorber, or out of the box. Returns nothing when
/// light enters the cut.
template <int N>
std::optional<RayEnd> Tracer<N>::cross_box() {
  const auto exit = geometry_.crossing(Surface::bounds, false, position(), direction());
  const auto entry = geometry_.crossing(Surface::cut, true, position(), direction(), exit ? exit->distance : 0);
  if (!entry) return leave();
  const auto hit = geometry_.absorber(position(), direction(), entry->distance);
  if (ends_before(hit ? hit->distance : entry->distance)) return miss();
  if (hit) {
    go_straight(*hit);
    return end_on(hit->surface);
  }
  go_straight(*entry);
  return std::nullopt;
}

/// In voxels.
template <int N>
double Tracer<N>::automatic_step() const {
  const Eigen::Matrix3d& T = medium_.T;
  const double third = T.trace() / 3;
  const double norm = std::sqrt(std::max(0.0, T.squaredNorm() - 3 * third * third));
  const double kick = std::abs(medium_.s) * norm * voxel_;
  if (kick * longest_step <= strongest_kick) return longest_step;
  return std::max(strongest_kick / kick, settings_.method == BendingMethod::splitting ? shortest_step : 0.0);
}

/// The nearest thing that the chord from the ray to `next` meets. `hit.distance` is along the chord.
template <int N>
typename Tracer<N>::Event Tracer<N>::meet(const State<N>& next, Hit& hit) const {
  const Eigen::Vector3d from = position(), to = next.position();
  const bool leaves_box = !field_.contains(to);
  const bool may_absorb = geometry_.may_absorb(from, to);
  if (!leaves_box && !may_absorb && !geometry_.has_cut()) return Event::none;

  const Eigen::Vector3d chord = to - from;
  double length = chord.norm();
  const Eigen::Vector3d along = length > 0 ? Eigen::Vector3d(chord / length) : direction();
  Event event = Event::none;
  if (leaves_box) {
    const auto exit = geometry_.crossing(Surface::bounds, false, from, along, length);
    hit = exit ? *exit : Hit{};  // A chord so short that rounding hides the face leaves at once.
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

/// Repeats the step with the length that ends on the plane of `hit` (Newton's method), which keeps the order.
/// @return that length.
template <int N>
double Tracer<N>::land(const State<N>& next, double h, const Hit& hit) {
  if (hit.normal.isZero()) return 0;
  const State<N> from = ray_;
  const Eigen::Vector3d start = position(), chord = next.position() - start;
  const double to_plane = hit.normal.dot(chord) / chord.norm() * hit.distance;
  double length = h * hit.distance / chord.norm();
  State<N> unused, landed = from;
  for (int i = 0; i < 4; ++i) {
    landed = step(length, unused);
    const double gap = (to_plane - hit.normal.dot(landed.position() - start)) / hit.normal.dot(landed.direction());
    if (!(std::abs(gap) <= h)) break;  // Light that grazes the plane.
    if (std::abs(gap) <= 1e-10 * h || i == 3) {
      landed.P += gap * landed.V;
      break;
    }
    length = std::clamp(length + gap, 0.0, h);
  }
  ray_ = landed;
  meet_surface(hit.normal, true);
  return length;
}

/// Sets the next adaptive step from this one's error. @return the error over what is allowed.
template <int N>
double Tracer<N>::control_step(const State<N>& error) {
  const double excess = std::max(error.position().norm() / voxel_, error.direction().norm()) / settings_.tolerance;
  const double factor = 0.9 * std::pow(std::max(excess, 1e-10), -1.0 / order(settings_.method));
  const double longest = settings_.step > 0 ? settings_.step : longest_adaptive_step;
  const double wanted = adaptive_step_ * (std::isfinite(factor) ? std::clamp(factor, 0.2, 5.0) : 0.2);
  adaptive_step_ = std::clamp(wanted, shortest_adaptive_step, longest);
  return excess;
}

/// In the field: step by step to an absorber, out of the box or out of the cut. Returns nothing in the last case.
template <int N>
std::optional<RayEnd> Tracer<N>::bend() {
  const bool automatic = settings_.step == 0, controlled = adaptive(settings_.method);
  voxel_ = length_of_voxel();
  if (automatic) medium_.sample(ray_.P);
  adaptive_step_ = automatic ? automatic_step() : settings_.step;
  record(true);
  while (true) {
    if (steps_ >= static_cast<std::uint32_t>(settings_.max_steps)) return RayEnd::step_limit;
    ++steps_;
    voxel_ = length_of_voxel();
    const double voxels = controlled ? adaptive_step_ : automatic ? automatic_step() : settings_.step;
    const double rest = settings_.max_length - length_, h = std::min(voxels * voxel_, rest);
    State<N> error;
    const State<N> next = step(h, error);
    if (next.direction().isZero() || !next.position().allFinite()) return RayEnd::degenerate;
    if (controlled && control_step(error) > 1 && voxels > shortest_adaptive_step) continue;

    Hit hit;
    const Event event = meet(next, hit);
    if (event == Event::none) {
      ray_ = next;
      length_ += h;
      record(true);
      if (h == rest) return RayEnd::missed;
      continue;
    }
    length_ += land(next, h, hit);
    if (direction().isZero() || !position().allFinite()) return RayEnd::degenerate;
    record(true);
    if (event == Event::absorber) return end_on(hit.surface);
    if (event == Event::leaves_box) return leave();
    return std::nullopt;
  }
}

template <int N>
RayEnd Tracer<N>::follow() {
  if (direction().isZero() || !position().allFinite() || !std::isfinite(medium_.s)) return RayEnd::degenerate;
  if (!field_.contains(position()))
    if (const auto end = reach_box()) return *end;
  bool bends = geometry_.inside_cut(position());
  while (true) {
    if (const auto end = bends ? bend() : cross_box()) return *end;
    bends = !bends;
    ++steps_;
  }
}

template <int N>
RayEnd Tracer<N>::trace(const State<N>& start, double flexibility, const Recording& recording) {
  ray_ = normalized(start);
  recording_ = recording;
  medium_.s = flexibility;
  length_ = 0;
  length_change_.setZero();
  steps_ = 0;
  return follow();
}

/// The rays of a batch, which is N = 3 wide if it carries differentials. `record(i)` says what is kept of ray i.
template <int N, class Record>
void trace_rays(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
                const Record& record) {
  Tracer<N> tracer(field, geometry, settings);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    State<N> start;
    start.P.col(0) = batch.position[i];
    start.V.col(0) = batch.direction[i];
    if constexpr (N == 3) {
      start.P.template rightCols<2>() = batch.differentials[i].position;
      start.V.template rightCols<2>() = batch.differentials[i].direction;
    }
    batch.end[i] = tracer.trace(start, batch.flexibility[i], record(i));
    batch.position[i] = tracer.state().position();
    batch.direction[i] = tracer.state().direction();
    if constexpr (N == 3)
      batch.differentials[i] = {tracer.state().P.template rightCols<2>(), tracer.state().V.template rightCols<2>(),
                                tracer.length_change()};
    batch.length[i] = tracer.length();
    batch.steps[i] = tracer.steps();
  }
  batch.tensor_samples += tracer.samples();
}

void check(const BendingSettings& settings) {
  if (!(settings.step >= 0) || !std::isfinite(settings.step))
    throw std::invalid_argument("bending.step must be automatic, or a positive number of voxels");
  if (!(settings.tolerance > 0)) throw std::invalid_argument("bending.tolerance must be positive");
  if (settings.max_steps < 1) throw std::invalid_argument("bending.max_steps must be positive");
  if (!(settings.max_length > 0)) throw std::invalid_argument("the greatest length of a ray must be positive");
}

template <class Record>
void trace_batch(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
                 const Record& record) {
  check(settings);
  const bool differentials = !batch.differentials.empty();
  if (differentials && batch.differentials.size() != batch.size())
    throw std::invalid_argument("a batch has differentials for every ray, or for none");
  batch.end.resize(batch.size());
  batch.length.resize(batch.size());
  batch.steps.resize(batch.size());
  if (differentials)
    trace_rays<3>(field, geometry, settings, batch, record);
  else
    trace_rays<1>(field, geometry, settings, batch, record);
}

}  // namespace

const char* to_string(RayEnd end) {
  constexpr const char* names[ray_end_count] = {"plate", "missed", "obstacle", "step_limit", "degenerate"};
  return names[static_cast<int>(end)];
}

void RayBatch::clear() {
  position.clear();
  direction.clear();
  flexibility.clear();
  differentials.clear();
  end.clear();
  length.clear();
  steps.clear();
}

void RayBatch::add(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double s) {
  position.push_back(from);
  direction.push_back(along);
  flexibility.push_back(s);
}

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch) {
  trace_batch(field, geometry, settings, batch, [](std::size_t) { return Recording(); });
}

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<Way>& ways) {
  ways.assign(batch.size(), Way());
  trace_batch(field, geometry, settings, batch, [&](std::size_t i) { return Recording{&ways[i], nullptr}; });
}

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<Track>& tracks) {
  tracks.resize(batch.size());
  for (Track& track : tracks) track.clear();  // Keeps what they have allocated.
  trace_batch(field, geometry, settings, batch, [&](std::size_t i) { return Recording{nullptr, &tracks[i]}; });
}

}  // namespace tensorray
