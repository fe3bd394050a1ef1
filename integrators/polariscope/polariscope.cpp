#include "integrators/polariscope/polariscope.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <tbb/enumerable_thread_specific.h>

#include "base/constants.h"
#include "integrators/polariscope/differences.h"
#include "integrators/polariscope/turning.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr int most_threes = 5;        // A band has 3⁵ wavelengths at most.
constexpr int most_sections = 10000;  // Of a ray in the body: a limit that no body reaches.

/// Middle of a step along its ray, from the plate, and its length.
struct RayStep {
  double middle, length;
};

/// From where to where a ray is in a box; the plate is at 0.
std::pair<double, double> section_of(const Eigen::AlignedBox3d& box, const Vector3d& origin, const Vector3d& along) {
  double begin = -std::numeric_limits<double>::infinity(), end = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box.min()[axis] - origin[axis], high = box.max()[axis] - origin[axis];
    if (along[axis] == 0 && (low > 0 || high < 0)) return {0, 0};
    if (along[axis] == 0) continue;
    begin = std::max(begin, std::min(low / along[axis], high / along[axis]));
    end = std::min(end, std::max(low / along[axis], high / along[axis]));
  }
  return {begin, end};
}

}  // namespace

struct PolarTracer::Ray {
  Vector3d origin, index;  // On the plate, in world and in index space.
  std::vector<RayStep> steps;
  double phase = 0, length = 0;  // Σ √(a² + b²) h, at the reference; Σ h.
  bool is_lit = true;
};

/// Rays side by side.
struct PolarTracer::Packet {
  std::array<Ray, ray_lanes> rays;
  RaySteps steps;
  std::vector<RayTurns> turns;
  std::vector<float> planes;
  /// Of each pixel: quaternions w, x, y, z; samples in the field.
  struct Sum {
    Eigen::Vector4d mean = Eigen::Vector4d::Zero();
    int inside = 0;
  };
  std::vector<Sum> sums;
};

struct PolarTracer::Samplers : tbb::enumerable_thread_specific<DifferenceSampler> {
  using enumerable_thread_specific::enumerable_thread_specific;
};

PolarTracer::PolarTracer(const TensorField& field, const Geometry& geometry, const PolarizedLight& light,
                         const Plate& plate)
    : field_(field),
      geometry_(geometry),
      light_(light),
      plate_(plate),
      across_(field.to_index().linear() * light.direction),
      steps_per_length_(std::ldexp(across_.norm(), field.levels() - 1)),
      room_(turning_room(light.bands.size())),
      samplers_(std::make_unique<Samplers>(
          [this] { return DifferenceSampler(field_, across_, light_.right, light_.up, light_.strength); })) {
  for (const Band& band : light.bands)
    widest_ = std::max(widest_, std::abs(light.relative(band.wavelength + band.width / 2) -
                                         light.relative(band.wavelength - band.width / 2)));
  for (int threes = 0, count = 1; threes <= most_threes; ++threes, count *= 3) {
    auto& level = strengths_.emplace_back();
    for (int i = 0; i < count; ++i) {
      std::vector<float>& strengths = level.emplace_back(room_, 0.0f);
      for (std::size_t k = 0; k < light.bands.size(); ++k) {
        const Band& band = light.bands[k];
        strengths[k] = static_cast<float>(light.relative(band.wavelength + band.width * ((i + 0.5) / count - 0.5)));
        greatest_ = std::max(greatest_, std::abs(static_cast<double>(strengths[k])));
      }
    }
  }
}

PolarTracer::~PolarTracer() = default;

const std::vector<std::vector<float>>& PolarTracer::wavelengths_for(double phase) const {
  std::size_t threes = 0;
  double change = 2 * phase * widest_;
  for (; change > 1 && threes < most_threes; change /= 3) ++threes;
  return strengths_[threes];
}

void PolarTracer::find_steps(Ray& ray) const {
  const Vector3d& k = light_.direction;
  const Vector3d from_start = ray.origin - light_.start;
  ray.is_lit = true;
  if (light_.aperture) ray.is_lit = light_.aperture->contains(Eigen::Vector2d(light_.aperture_axes * from_start));
  if (ray.is_lit && !geometry_.surfaces().obstacles.empty()) {
    const double way = from_start.dot(k);
    const auto hit = geometry_.absorber(ray.origin - way * k, k, way);
    ray.is_lit = !hit || hit->surface != Surface::obstacle;
  }
  if (!ray.is_lit) return;
  const auto [begin, end] = section_of(field_.index_bounds(), ray.index, across_);
  if (!(end > begin)) return;
  const auto add_steps = [&](double from, double to) {
    if (!(to > from)) return;
    const double count = std::max(1.0, std::ceil((to - from) * steps_per_length_ - 1e-6)), length = (to - from) / count;
    for (int i = 0; i < count; ++i) ray.steps.push_back({from + (i + 0.5) * length, length});
    ray.length += to - from;
  };
  if (!geometry_.has_cut()) return add_steps(begin, end);
  double at = begin;
  bool is_inside = geometry_.inside_cut(ray.origin + at * k, k);
  for (int i = 0; i < most_sections; ++i) {
    const auto hit = geometry_.crossing(Surface::cut, !is_inside, ray.origin + at * k, k, end - at);
    const double next = hit ? at + hit->distance : end;
    if (is_inside) add_steps(at, next);
    if (!hit) return;
    is_inside = !is_inside;
    at = next;
  }
}

/// Finds the turns and phases of all rays, step by step.
void PolarTracer::sample(Packet& packet) const {
  DifferenceSampler& sampler = samplers_->local();
  RaySteps& steps = packet.steps;
  std::size_t most = 0;
  for (std::size_t i = 0; i < ray_lanes; ++i) {
    most = std::max(most, packet.rays[i].steps.size());
    for (int axis = 0; axis < 3; ++axis) steps.origin[axis][i] = packet.rays[i].index[axis];
  }
  packet.turns.clear();
  for (std::size_t step = 0; step < most; ++step) {
    for (std::size_t i = 0; i < ray_lanes; ++i) {
      const Ray& ray = packet.rays[i];
      const RayStep at = step < ray.steps.size() ? ray.steps[step] : RayStep{0, 0};
      steps.place[0][i] = at.middle - gauss_point * at.length;
      steps.place[1][i] = at.middle + gauss_point * at.length;
      steps.length[i] = static_cast<float>(at.length);
    }
    sampler.sample(steps);
    if (room_ > 0) add_steps(steps, greatest_, packet.turns);
    const auto difference = [&](int point, std::size_t i) {
      const double a = steps.a[point][i], b = steps.b[point][i];  // Squares may be beyond single precision.
      return std::sqrt(a * a + b * b);
    };
    for (std::size_t i = 0; i < ray_lanes; ++i)
      packet.rays[i].phase += steps.length[i] * (difference(0, i) + difference(1, i)) / 2;
  }
}

/// Adds a ray to the light of its pixel.
void PolarTracer::add(std::size_t lane, float weight, std::size_t x, Packet& packet, LightRow& row) const {
  const Ray& ray = packet.rays[lane];
  if (!ray.is_lit) return;
  row.lit[x] += weight;
  float* const rotations = room_ > 0 ? &row.rotations[9 * room_ * x] : nullptr;
  if (ray.steps.empty()) {
    for (const std::size_t i : {0, 4, 8})
      for (std::size_t k = 0; k < room_; ++k) rotations[i * room_ + k] += weight;
    return;
  }
  PolarPoint& point = row.points[x];
  point.integral += static_cast<float>(2 * ray.phase);
  point.length += static_cast<float>(ray.length);
  ++packet.sums[x].inside;
  if (room_ == 0) return;
  packet.planes.resize(4 * room_);
  const auto& wavelengths = wavelengths_for(ray.phase);
  for (std::size_t i = 0; i < wavelengths.size(); ++i) {
    turn(packet.turns, lane, wavelengths[i].data(), room_, packet.planes.data());
    add_rotations(packet.planes.data(), weight / static_cast<float>(wavelengths.size()), room_, rotations);
    if (i == wavelengths.size() / 2)  // The middle of the band.
      for (std::size_t c = 0; c < 4; ++c)
        packet.sums[x].mean[static_cast<int>(c)] += packet.planes[c * room_ + light_.reference];
  }
}

LightRow PolarTracer::row(int y) const {
  const auto width = static_cast<std::size_t>(plate_.resolution.x()), n = static_cast<std::size_t>(light_.samples);
  LightRow row;
  row.room = room_;
  row.rotations.resize(9 * room_ * width);
  row.lit.resize(width);
  row.points.resize(width);
  Packet packet;
  packet.sums.resize(width);
  // Pixel by pixel, so that rays side by side are close to each other.
  for (std::size_t begin = 0; begin < width * n * n; begin += ray_lanes) {
    for (std::size_t i = 0; i < ray_lanes; ++i) {
      const std::size_t pixel = (begin + i) / (n * n), sample = (begin + i) % (n * n);
      Ray& ray = packet.rays[i];
      ray.steps.clear();
      ray.phase = ray.length = 0;
      const auto place = [&](std::size_t step) { return (static_cast<double>(step) + 0.5) / light_.samples; };
      ray.origin = plate_.to_world({static_cast<double>(pixel) + place(sample % n), y + place(sample / n)});
      ray.index = field_.to_index() * ray.origin;
      if (pixel < width) find_steps(ray);
    }
    sample(packet);
    for (std::size_t i = 0; i < std::min<std::size_t>(ray_lanes, width * n * n - begin); ++i)
      add(i, 1 / static_cast<float>(n * n), (begin + i) / (n * n), packet, row);
  }
  for (std::size_t x = 0; x < width; ++x) {
    const auto inside = static_cast<float>(packet.sums[x].inside);
    if (inside == 0) continue;
    PolarPoint& point = row.points[x];
    point.integral /= inside;
    point.length /= inside;
    // The mean of unitary matrices is that of the middle, as they are smooth.
    const Eigen::Vector4d mean = packet.sums[x].mean.normalized();
    const EquivalentRetarder retarder = equivalent_retarder({mean[0], mean[1], mean[2], mean[3]});
    point.phase = static_cast<float>(retarder.phase);
    point.azimuth = static_cast<float>(retarder.azimuth);
    point.rotation = static_cast<float>(retarder.rotation);
  }
  return row;
}

void PolarView::Analyses::set(std::size_t band, const Analysis& analysis) {
  const auto row = static_cast<Eigen::Index>(band);
  through[row] = static_cast<float>(analysis.through);
  for (int i = 0; i < 9; ++i) by_rotation(row, i) = static_cast<float>(analysis.by_rotation(i / 3, i % 3));
}

Eigen::VectorXf PolarView::Analyses::powers(const LightRow& row, std::size_t x) const {
  return row.lit[x] * through + by_rotation.cwiseProduct(rotations_of(row, x)).rowwise().sum();
}

PolarView::PolarView(const Arrangement& arrangement, const std::vector<Band>& bands,
                     const std::vector<Vector3d>& colors, bool stokes)
    : bands_(static_cast<Eigen::Index>(bands.size())) {
  const auto room = static_cast<Eigen::Index>(turning_room(bands.size()));
  shown_ = {Eigen::VectorXf::Zero(room), BandRotations::Zero(room, 9)};
  spectra_.assign(stokes ? 4 : 0, shown_);
  colors_ = Eigen::Matrix3Xf::Zero(3, room);
  for (std::size_t k = 0; k < bands.size(); ++k) {
    shown_.set(k, analysis_of(arrangement, bands[k].wavelength));
    for (std::size_t s = 0; s < spectra_.size(); ++s)
      spectra_[s].set(k, stokes_of(arrangement, bands[k].wavelength)[s]);
    const auto column = static_cast<Eigen::Index>(k);
    colors_.col(column) = colors[k].cast<float>();
    achromatic_ &=
        shown_.through[column] == shown_.through[0] && shown_.by_rotation.row(column) == shown_.by_rotation.row(0);
  }
  if (!stokes) spectra_.push_back(shown_);
  through_ = colors_ * shown_.through;
}

void PolarView::set_sums(LightRow& row) const {
  row.sums.resize(27 * row.lit.size());
  for (std::size_t x = 0; x < row.lit.size(); ++x)
    Eigen::Map<Eigen::Matrix<float, 3, 9>>(&row.sums[27 * x]).noalias() = colors_ * rotations_of(row, x);
}

Eigen::Vector3f PolarView::color(const LightRow& row, std::size_t x) const {
  if (!achromatic_) return colors_ * shown_.powers(row, x);
  const Eigen::Map<const Eigen::Matrix<float, 3, 9>> sums(&row.sums[27 * x]);
  return row.lit[x] * through_ + sums * shown_.by_rotation.row(0).transpose();
}

void PolarView::spectrum(const LightRow& row, std::size_t x, float* spectrum) const {
  for (const Analyses& parameter : spectra_) {
    Eigen::Map<Eigen::VectorXf>(spectrum, bands_) = parameter.powers(row, x).head(bands_);
    spectrum += bands_;
  }
}

}  // namespace tensorray
