#include "integrators/polariscope/polariscope.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <tbb/enumerable_thread_specific.h>

#include "base/constants.h"
#include "base/geometry/box.h"
#include "integrators/polariscope/differences.h"
#include "integrators/polariscope/turning.h"

namespace tensorray {

using Eigen::Vector3d;

constexpr std::size_t most_wavelengths = 243;  // Of a band: a power of three, so that coarser divisions are part of it.
constexpr int most_sections = 10000;           // Of a ray in the body: a limit that no body reaches.

struct PolarTracer::Ray {
  Vector3d origin, index;    // On the plate, in world and in index space.
  std::size_t sections = 0;  // In the body.
  double length = 0;         // Of all.
  bool is_lit = true;
};

/// Rays side by side.
struct PolarTracer::Packet {
  std::array<Ray, ray_lanes> rays;
  struct Section {  // One of each ray: `count` steps of `length`.
    double begin[ray_lanes] = {}, length[ray_lanes] = {}, count[ray_lanes] = {};
  };
  std::vector<Section> sections;
  RaySteps sampled;
  std::array<std::vector<Turn>, ray_lanes> turns;
  std::array<double, ray_lanes> phase;  // Σ √(a² + b²) h, of a relative strength of 1.
  std::vector<float> planes;
  struct Sum {  // Of each pixel: quaternions w, x, y, z; samples in the field.
    Eigen::Vector4d mean = Eigen::Vector4d::Zero();
    int inside = 0;
  };
  std::vector<Sum> sums;
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
      greatest_(light.bands.empty() ? 1 : 0),
      strengths_(most_wavelengths, std::vector<float>(room_)) {
  const auto relative = [&](const Band& band, double place) {  // From 0 to 1 within the band.
    return light.relative(band.wavelength + band.width * (place - 0.5));
  };
  const auto place = [](std::size_t i) { return (static_cast<double>(i) + 0.5) / most_wavelengths; };
  for (const Band& band : light.bands) {
    widest_ = std::max(widest_, std::abs(relative(band, 1) - relative(band, 0)));
    for (std::size_t i = 0; i < most_wavelengths; ++i)
      greatest_ = std::max(greatest_, std::abs(relative(band, place(i))));
  }
  for (std::size_t i = 0; i < most_wavelengths; ++i)
    for (std::size_t k = 0; k < light.bands.size(); ++k)
      strengths_[i][k] = static_cast<float>(relative(light.bands[k], place(i)) / greatest_);
  const auto samplers = std::make_shared<tbb::enumerable_thread_specific<DifferenceSampler>>(
      [this] { return DifferenceSampler(field_, across_, light_.right, light_.up, light_.strength * greatest_); });
  sampler_ = [samplers]() -> DifferenceSampler& { return samplers->local(); };
}

void PolarTracer::find_steps(std::size_t lane, Packet& packet) const {
  Ray& ray = packet.rays[lane];
  const Vector3d& k = light_.direction;
  const Vector3d from_start = ray.origin - light_.start;
  if (light_.aperture) ray.is_lit = light_.aperture->contains(Eigen::Vector2d(light_.aperture_axes * from_start));
  if (ray.is_lit && !geometry_.surfaces().obstacles.empty()) {
    const double way = from_start.dot(k);
    const auto hit = geometry_.absorber(ray.origin - way * k, k, way);
    ray.is_lit = !hit || hit->surface != Surface::obstacle;
  }
  if (!ray.is_lit) return;
  const auto [begin, leaves] = section_in(field_.index_bounds(), ray.index, across_);
  const double end = std::min(leaves, 0.0);  // The plate is at 0.
  if (!(end > begin)) return;
  const auto add_steps = [&](double from, double to) {
    if (!(to > from)) return;
    const double count = std::max(1.0, std::ceil((to - from) * steps_per_length_ - 1e-6)), length = (to - from) / count;
    if (ray.sections == packet.sections.size()) packet.sections.emplace_back();
    Packet::Section& section = packet.sections[ray.sections++];
    section.begin[lane] = from;
    section.length[lane] = length;
    section.count[lane] = count;
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
  DifferenceSampler& sampler = sampler_();
  RaySteps& sampled = packet.sampled;
  for (std::size_t i = 0; i < ray_lanes; ++i)
    for (int axis = 0; axis < 3; ++axis) sampled.origin[axis][i] = packet.rays[i].index[axis];
  packet.phase.fill(0);
  for (std::vector<Turn>& turns : packet.turns) turns.clear();
  RayTurns last{};
  for (const Packet::Section& section : packet.sections) {
    const double most = *std::max_element(std::begin(section.count), std::end(section.count));
    for (double step = 0; step < most; ++step) {
      for (std::size_t i = 0; i < ray_lanes; ++i) {
        const double length = step < section.count[i] ? section.length[i] : 0;
        const double middle = section.begin[i] + (step + 0.5) * section.length[i];
        sampled.place[0][i] = middle - gauss_point * length;
        sampled.place[1][i] = middle + gauss_point * length;
        sampled.length[i] = static_cast<float>(length);
      }
      sampler.sample(sampled);
      add_turns(sampled, last);
      for (std::size_t i = 0; i < ray_lanes; ++i) {
        if (!last.joined[i] || packet.turns[i].empty()) packet.turns[i].emplace_back();
        packet.turns[i].back() = {last.alpha[i], last.beta[i], last.gamma[i], last.squares[i]};
        packet.phase[i] += last.phase[i];
      }
    }
  }
}

/// Adds a ray to the light of its pixel.
void PolarTracer::add(std::size_t lane, float weight, std::size_t x, Packet& packet, LightRow& row) const {
  const Ray& ray = packet.rays[lane];
  if (!ray.is_lit) return;
  const bool is_inside = ray.sections > 0;
  const double phase = 2 * packet.phase[lane] / greatest_;
  row.points[x].integral += std::copysign(phase, light_.strength);
  row.points[x].length += ray.length;
  if (is_inside) ++packet.sums[x].inside;
  if (room_ == 0) return;
  packet.planes.resize(4 * room_);
  std::size_t stride = most_wavelengths;
  for (double change = phase * widest_; change > 1 && stride > 1; change /= 3) stride /= 3;
  const float part = weight * static_cast<float>(stride) / most_wavelengths;
  for (std::size_t i = stride / 2; i < most_wavelengths; i += stride) {
    turn(packet.turns[lane], strengths_[i].data(), room_, part, packet.planes.data(),
         row.bands.data() + 10 * room_ * x);
    if (is_inside && i == most_wavelengths / 2)  // The middle of the band.
      for (std::size_t c = 0; c < 4; ++c)
        packet.sums[x].mean[static_cast<int>(c)] += packet.planes[c * room_ + light_.reference];
  }
}

LightRow PolarTracer::row(int y) const {
  const auto width = static_cast<std::size_t>(plate_.resolution.x()), n = static_cast<std::size_t>(light_.samples);
  LightRow row;
  row.room = room_;
  row.bands.resize(10 * room_ * width);
  row.points.resize(width);
  Packet packet;
  packet.sums.resize(width);
  // Pixel by pixel, so that rays side by side are close to each other.
  for (std::size_t begin = 0; begin < width * n * n; begin += ray_lanes) {
    packet.sections.clear();
    for (std::size_t i = 0; i < ray_lanes; ++i) {
      const std::size_t pixel = (begin + i) / (n * n), sample = (begin + i) % (n * n);
      Ray& ray = packet.rays[i] = {};
      const auto place = [&](std::size_t step) { return (static_cast<double>(step) + 0.5) / light_.samples; };
      ray.origin = plate_.to_world({static_cast<double>(pixel) + place(sample % n), y + place(sample / n)});
      ray.index = field_.to_index() * ray.origin;
      if (pixel < width) find_steps(i, packet);
    }
    sample(packet);
    for (std::size_t i = 0; i < std::min<std::size_t>(ray_lanes, width * n * n - begin); ++i)
      add(i, 1 / static_cast<float>(n * n), (begin + i) / (n * n), packet, row);
  }
  for (std::size_t x = 0; x < width; ++x) {
    const int inside = packet.sums[x].inside;
    if (inside == 0) continue;
    row.points[x].integral /= inside;
    row.points[x].length /= inside;
    // The mean of unitary matrices is that of the middle, as they are smooth.
    const Eigen::Vector4d mean = packet.sums[x].mean.normalized();
    row.points[x].retarder = equivalent_retarder({mean[0], mean[1], mean[2], mean[3]});
  }
  return row;
}

PolarView::PolarView(const Arrangement& arrangement, const std::vector<Band>& bands, const Eigen::Matrix3Xd& colors,
                     bool stokes)
    : bands_(colors.cols()) {
  const auto room = static_cast<Eigen::Index>(turning_room(bands.size()));
  analyses_.assign(stokes ? 5 : 1, BandLight::Zero(room, 10));
  for (Eigen::Index k = 0; k < bands_; ++k) {
    const std::array<MeanLight, 5> analyses = analyses_of(arrangement, bands[static_cast<std::size_t>(k)].wavelength);
    for (std::size_t i = 0; i < analyses_.size(); ++i) analyses_[i].row(k) = analyses[i].cast<float>().transpose();
  }
  colors_ = Eigen::Matrix3Xf::Zero(3, room);
  colors_.leftCols(bands_) = colors.cast<float>();
  const BandLight& shown = analyses_.front();
  achromatic_ = shown.topRows(bands_) == shown.row(0).replicate(bands_, 1);
}

void PolarView::set_sums(LightRow& row) const {
  row.sums.resize(30 * row.points.size());
  for (std::size_t x = 0; x < row.points.size(); ++x)
    Eigen::Map<Eigen::Matrix<float, 3, 10>>(&row.sums[30 * x]).noalias() = colors_ * bands_of(row, x);
}

Eigen::Vector3f PolarView::color(const LightRow& row, std::size_t x) const {
  const BandLight& shown = analyses_.front();
  if (!achromatic_) return colors_ * shown.cwiseProduct(bands_of(row, x)).rowwise().sum();
  return Eigen::Map<const Eigen::Matrix<float, 3, 10>>(&row.sums[30 * x]) * shown.row(0).transpose();
}

Eigen::MatrixXf PolarView::spectrum(const LightRow& row, std::size_t x) const {
  const std::size_t first = analyses_.size() > 1 ? 1 : 0;
  Eigen::MatrixXf result(bands_, analyses_.size() - first);
  for (std::size_t i = first; i < analyses_.size(); ++i)
    result.col(static_cast<Eigen::Index>(i - first)) =
        analyses_[i].cwiseProduct(bands_of(row, x)).rowwise().sum().head(bands_);
  return result;
}

}  // namespace tensorray
