#include "integrators/bending.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "integrators/exponential.h"

namespace tensorray {
namespace {

constexpr double longest_step = 0.5;         // Automatic steps, in voxels ...
constexpr double shortest_step = 1.0 / 64;   // ... of the splitting, which is stable however strong the field.
constexpr double strongest_kick = 0.2;       // s h ‖T − ⅓ tr(T) I‖ of an automatic step.
constexpr double longest_adaptive_step = 2;  // In voxels: so that no voxel is stepped over.
constexpr double shortest_adaptive_step = 1e-6;

struct State {
  Eigen::Vector3d P, V;
};

/// The field as one ray meets it.
struct Medium {
  TensorSampler& sampler;
  double s;
  Eigen::Matrix3d last = Eigen::Matrix3d::Zero();  // T as last sampled.

  const Eigen::Matrix3d& tensor(const Eigen::Vector3d& P) { return last = sampler.at(P); }

  /// Eq. 5, in a form that is blind to the trace of T also where V is not quite a unit vector (inside a step).
  State derivative(const State& at) {
    const Eigen::Vector3d TV = tensor(at.P) * at.V;
    return {at.V, s * (TV - at.V.dot(TV) / at.V.squaredNorm() * at.V)};
  }
};

State operator+(const State& a, const State& b) { return {a.P + b.P, a.V + b.V}; }
State operator*(double factor, const State& a) { return {factor * a.P, factor * a.V}; }

/// Takes V to unit length; to zero if it has no direction.
State normalized(const State& state) {
  const double length = state.V.norm();
  if (!(length > 0) || !std::isfinite(length)) return {state.P, Eigen::Vector3d::Zero()};
  return {state.P, state.V / length};
}

State euler(Medium& medium, const State& from, double h) {
  const Eigen::Vector3d D = from.V + medium.s * h * (medium.tensor(from.P) * from.V);
  const State to = normalized({from.P, D});
  return {from.P + h * to.V, to.V};
}

State splitting(Medium& medium, const State& from, double h) {
  const Eigen::Vector3d middle = from.P + h / 2 * from.V;
  const Eigen::Vector3d V = exponential_direction(h * medium.s * medium.tensor(middle), from.V);
  return {middle + h / 2 * V, V};
}

State rk4(Medium& medium, const State& from, double h) {
  const State k1 = medium.derivative(from);
  const State k2 = medium.derivative(from + h / 2 * k1);
  const State k3 = medium.derivative(from + h / 2 * k2);
  const State k4 = medium.derivative(from + h * k3);
  return normalized(from + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4));
}

/// Bogacki and Shampine 1989. `error` is the difference to the embedded method of order 2.
State bs23(Medium& medium, const State& from, double h, State& error) {
  const State k1 = medium.derivative(from);
  const State k2 = medium.derivative(from + h / 2 * k1);
  const State k3 = medium.derivative(from + 3 * h / 4 * k2);
  const State to = from + h * (2.0 / 9 * k1 + 1.0 / 3 * k2 + 4.0 / 9 * k3);
  const State k4 = medium.derivative(to);
  error = h * (-5.0 / 72 * k1 + 1.0 / 12 * k2 + 1.0 / 9 * k3 + -1.0 / 8 * k4);
  return normalized(to);
}

/// Dormand and Prince 1980. `error` is the difference to the embedded method of order 4.
State dopri5(Medium& medium, const State& from, double h, State& error) {
  const State k1 = medium.derivative(from);
  const State k2 = medium.derivative(from + h * (1.0 / 5 * k1));
  const State k3 = medium.derivative(from + h * (3.0 / 40 * k1 + 9.0 / 40 * k2));
  const State k4 = medium.derivative(from + h * (44.0 / 45 * k1 + -56.0 / 15 * k2 + 32.0 / 9 * k3));
  const State k5 = medium.derivative(
      from + h * (19372.0 / 6561 * k1 + -25360.0 / 2187 * k2 + 64448.0 / 6561 * k3 + -212.0 / 729 * k4));
  const State k6 = medium.derivative(from + h * (9017.0 / 3168 * k1 + -355.0 / 33 * k2 + 46732.0 / 5247 * k3 +
                                                 49.0 / 176 * k4 + -5103.0 / 18656 * k5));
  const State to =
      from + h * (35.0 / 384 * k1 + 500.0 / 1113 * k3 + 125.0 / 192 * k4 + -2187.0 / 6784 * k5 + 11.0 / 84 * k6);
  const State k7 = medium.derivative(to);
  error = h * (71.0 / 57600 * k1 + -71.0 / 16695 * k3 + 71.0 / 1920 * k4 + -17253.0 / 339200 * k5 + 22.0 / 525 * k6 +
               -1.0 / 40 * k7);
  return normalized(to);
}

bool adaptive(BendingMethod method) { return method == BendingMethod::bs23 || method == BendingMethod::dopri5; }
int order(BendingMethod method) { return method == BendingMethod::bs23 ? 3 : 5; }

State advance(BendingMethod method, Medium& medium, const State& from, double h, State& error) {
  switch (method) {
    case BendingMethod::euler:
      return euler(medium, from, h);
    case BendingMethod::rk4:
      return rk4(medium, from, h);
    case BendingMethod::bs23:
      return bs23(medium, from, h, error);
    case BendingMethod::dopri5:
      return dopri5(medium, from, h, error);
    case BendingMethod::splitting:
      break;
  }
  return splitting(medium, from, h);
}

/// One ray on its way. The volume is the field's extent, a convex box, cut by a mesh of any shape.
class Tracer {
 public:
  Tracer(const TensorField& field, const Geometry& geometry, const BendingSettings& settings)
      : field_(field), geometry_(geometry), settings_(settings), sampler_(field) {}

  RayEnd trace(Eigen::Vector3d& position, Eigen::Vector3d& direction, double flexibility, std::uint32_t& steps);
  std::uint64_t samples() const { return sampler_.samples(); }

 private:
  /// What light meets next; `none` while it travels freely.
  enum class Event { none, absorber, leaves_box, enters_cut, leaves_cut };

  std::optional<RayEnd> reach_box();
  std::optional<RayEnd> cross_box();
  std::optional<RayEnd> bend();
  RayEnd leave();

  RayEnd end_on(Surface surface) const { return surface == Surface::plate ? RayEnd::plate : RayEnd::obstacle; }
  State step(double h, State& error) { return advance(settings_.method, medium_, ray_, h, error); }
  double length_of_voxel() const { return 1 / (field_.to_index().linear() * ray_.V).norm(); }
  double automatic_step() const;
  double control_step(const State& error);
  Event meet(const State& next, Hit& hit) const;
  State land(const State& next, double h, const Hit& hit);

  const TensorField& field_;
  const Geometry& geometry_;
  const BendingSettings& settings_;
  TensorSampler sampler_;

  Medium medium_{sampler_, 0};
  State ray_;
  double voxel_ = 0;          // Length of a voxel along the ray, world units.
  double adaptive_step_ = 0;  // What the error control asks for next, in voxels.
  std::uint32_t steps_ = 0;
};

/// In free space before the volume: to an absorber, or to the face of the box where light enters.
std::optional<RayEnd> Tracer::reach_box() {
  const auto entry = geometry_.crossing(Surface::bounds, true, ray_.P, ray_.V);
  const auto hit = geometry_.absorber(ray_.P, ray_.V, entry ? entry->distance : Geometry::infinite);
  if (hit) {
    ray_.P += hit->distance * ray_.V;
    return end_on(hit->surface);
  }
  if (!entry) return RayEnd::missed;
  ray_.P += entry->distance * ray_.V;
  return std::nullopt;
}

/// In free space behind the volume, which is convex: straight light does not meet it again.
RayEnd Tracer::leave() {
  const auto hit = geometry_.absorber(ray_.P, ray_.V);
  if (!hit) return RayEnd::missed;
  ray_.P += hit->distance * ray_.V;
  return end_on(hit->surface);
}

/// Within the box, outside of the cut: straight on to the cut, an absorber, or out of the box. Returns nothing when
/// light enters the cut.
std::optional<RayEnd> Tracer::cross_box() {
  const auto exit = geometry_.crossing(Surface::bounds, false, ray_.P, ray_.V);
  const auto entry = geometry_.crossing(Surface::cut, true, ray_.P, ray_.V, exit ? exit->distance : 0);
  if (!entry) return leave();
  if (const auto hit = geometry_.absorber(ray_.P, ray_.V, entry->distance)) {
    ray_.P += hit->distance * ray_.V;
    return end_on(hit->surface);
  }
  ray_.P += entry->distance * ray_.V;
  return std::nullopt;
}

/// In voxels.
double Tracer::automatic_step() const {
  const Eigen::Matrix3d& T = medium_.last;
  const double third = T.trace() / 3;
  const double norm = std::sqrt(std::max(0.0, T.squaredNorm() - 3 * third * third));
  const double kick = std::abs(medium_.s) * norm * voxel_;
  if (kick * longest_step <= strongest_kick) return longest_step;
  return std::max(strongest_kick / kick, settings_.method == BendingMethod::splitting ? shortest_step : 0.0);
}

/// The nearest thing that the chord from the ray to `next` meets. `hit.distance` is along the chord.
Tracer::Event Tracer::meet(const State& next, Hit& hit) const {
  const bool leaves_box = !field_.contains(next.P);
  const bool may_absorb = geometry_.may_absorb(ray_.P, next.P);
  if (!leaves_box && !may_absorb && !geometry_.has_cut()) return Event::none;

  const Eigen::Vector3d chord = next.P - ray_.P;
  double length = chord.norm();
  const Eigen::Vector3d direction = length > 0 ? Eigen::Vector3d(chord / length) : ray_.V;
  Event event = Event::none;
  if (leaves_box) {
    const auto exit = geometry_.crossing(Surface::bounds, false, ray_.P, direction, length);
    hit = exit ? *exit : Hit{};  // A chord so short that rounding hides the face leaves at once.
    length = hit.distance;
    event = Event::leaves_box;
  }
  if (geometry_.has_cut())
    if (const auto exit = geometry_.crossing(Surface::cut, false, ray_.P, direction, length)) {
      hit = *exit;
      length = hit.distance;
      event = Event::leaves_cut;
    }
  if (may_absorb)
    if (const auto absorber = geometry_.absorber(ray_.P, direction, length)) {
      hit = *absorber;
      event = Event::absorber;
    }
  return event;
}

/// Repeats the step with the length that ends on the plane of `hit` (Newton's method), which keeps the order.
State Tracer::land(const State& next, double h, const Hit& hit) {
  if (hit.normal.isZero()) return ray_;
  const Eigen::Vector3d chord = next.P - ray_.P;
  const double to_plane = hit.normal.dot(chord) / chord.norm() * hit.distance;
  double length = h * hit.distance / chord.norm();
  State unused, landed = ray_;
  for (int i = 0; i < 4; ++i) {
    landed = step(length, unused);
    const double gap = (to_plane - hit.normal.dot(landed.P - ray_.P)) / hit.normal.dot(landed.V);
    if (!(std::abs(gap) <= h)) break;  // Light that grazes the plane.
    if (std::abs(gap) <= 1e-10 * h || i == 3) {
      landed.P += gap * landed.V;
      break;
    }
    length = std::clamp(length + gap, 0.0, h);
  }
  return landed;
}

/// Sets the next adaptive step from this one's error. @return the error over what is allowed.
double Tracer::control_step(const State& error) {
  const double excess = std::max(error.P.norm() / voxel_, error.V.norm()) / settings_.tolerance;
  const double factor = 0.9 * std::pow(std::max(excess, 1e-10), -1.0 / order(settings_.method));
  const double longest = settings_.step > 0 ? settings_.step : longest_adaptive_step;
  const double wanted = adaptive_step_ * (std::isfinite(factor) ? std::clamp(factor, 0.2, 5.0) : 0.2);
  adaptive_step_ = std::clamp(wanted, shortest_adaptive_step, longest);
  return excess;
}

/// In the field: step by step to an absorber, out of the box or out of the cut. Returns nothing in the last case.
std::optional<RayEnd> Tracer::bend() {
  const bool automatic = settings_.step == 0, controlled = adaptive(settings_.method);
  voxel_ = length_of_voxel();
  if (automatic) medium_.tensor(ray_.P);
  adaptive_step_ = automatic ? automatic_step() : settings_.step;
  while (true) {
    if (steps_ >= static_cast<std::uint32_t>(settings_.max_steps)) return RayEnd::step_limit;
    ++steps_;
    voxel_ = length_of_voxel();
    const double voxels = controlled ? adaptive_step_ : automatic ? automatic_step() : settings_.step;
    const double h = voxels * voxel_;
    State error;
    const State next = step(h, error);
    if (next.V.isZero() || !next.P.allFinite()) return RayEnd::degenerate;
    if (controlled && control_step(error) > 1 && voxels > shortest_adaptive_step) continue;

    Hit hit;
    const Event event = meet(next, hit);
    ray_ = event == Event::none ? next : land(next, h, hit);
    if (ray_.V.isZero() || !ray_.P.allFinite()) return RayEnd::degenerate;
    if (event == Event::absorber) return end_on(hit.surface);
    if (event == Event::leaves_box) return leave();
    if (event == Event::leaves_cut) return std::nullopt;
  }
}

RayEnd Tracer::trace(Eigen::Vector3d& position, Eigen::Vector3d& direction, double flexibility, std::uint32_t& steps) {
  ray_ = normalized({position, direction});
  medium_.s = flexibility;
  steps_ = 0;
  const auto follow = [&]() -> RayEnd {
    if (ray_.V.isZero() || !ray_.P.allFinite() || !std::isfinite(flexibility)) return RayEnd::degenerate;
    if (!field_.contains(ray_.P))
      if (const auto end = reach_box()) return *end;
    bool bends = geometry_.inside_cut(ray_.P);
    while (true) {
      if (const auto end = bends ? bend() : cross_box()) return *end;
      bends = !bends;
      ++steps_;
    }
  };
  const RayEnd end = follow();
  position = ray_.P;
  direction = ray_.V;
  steps = steps_;
  return end;
}

void check(const BendingSettings& settings) {
  if (!(settings.step >= 0) || !std::isfinite(settings.step))
    throw std::invalid_argument("bending.step must be automatic, or a positive number of voxels");
  if (!(settings.tolerance > 0)) throw std::invalid_argument("bending.tolerance must be positive");
  if (settings.max_steps < 1) throw std::invalid_argument("bending.max_steps must be positive");
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
  end.clear();
  steps.clear();
}

void RayBatch::add(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double s) {
  position.push_back(from);
  direction.push_back(along);
  flexibility.push_back(s);
}

void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch) {
  check(settings);
  Tracer tracer(field, geometry, settings);
  batch.end.resize(batch.size());
  batch.steps.resize(batch.size());
  for (std::size_t i = 0; i < batch.size(); ++i)
    batch.end[i] = tracer.trace(batch.position[i], batch.direction[i], batch.flexibility[i], batch.steps[i]);
  batch.tensor_samples += tracer.samples();
}

}  // namespace tensorray
