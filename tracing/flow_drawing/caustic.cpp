#include "tracing/flow_drawing/caustic.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <thread>
#include <utility>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "renderer/coverage/area_deposit.h"
#include "tracing/flow_drawing/flow_pieces.h"

namespace tensorray {
namespace {

constexpr std::size_t max_memory = 1u << 28;  // Bytes of the deposits of all threads; but each has a row, at least.
constexpr double swept_share = 0.99;  // The part of the vertices whose light moves slowly enough from band to band.
constexpr std::size_t planes = DepositPlanes::count;

/// What is drawn together on the planes of a deposit: the colours, or the irradiance of some channels.
struct Pass {
  std::vector<AreaDeposit::PlaneWeights> plane_weights;  // Of each band.
  std::array<double*, planes> targets{};                 // The films' planes; null: none.
  double gain = 1;                                       // Of what was deposited.
  std::size_t first_channel = 0, end_channel = 0;        // The channels whose power is counted.

  bool counts(const CausticBand& band) const { return band.channel >= first_channel && band.channel < end_channel; }
};

/// Bands in a row that are drawn as light of one place among the wavelength samples, or in parts of a band.
struct BandRun {
  std::size_t first = 0, count = 1;
  double sample = 0, width = 0;
};

/// Power by channel and end, in units of 2^-54 of a channel's power: sums of integers have no order.
using PowerSums = std::vector<std::array<std::uint64_t, ray_end_count>>;
constexpr double power_unit = 18014398509481984.0;

/// Light of broken triangles that lands at a vertex, and the number of whole triangles that get it. (A triangle is
/// whole if all of it lands, and the map does not jump within it.)
struct CornerLight {
  double power = 0;
  int triangles = 0;
};

/// A thread's part of a pass.
struct Worker {
  AreaDeposit deposit;
  PowerSums power;
  std::vector<Eigen::Vector2d> at{};  // Landings of a piece's vertices, pixels.
  std::vector<RayEnd> ends{};
  Eigen::AlignedBox2d box{};     // Of the landings, if all of them are on the plate's plane.
  bool is_all_on_plate = false;  // Whether all light of the piece lands on the plate.
  std::vector<double> densities{};
  std::vector<CornerLight> corners{};  // Of a piece's vertices; empty if all its triangles are whole.
};

struct Drawing {
  const FlowMap& map;
  const FlowPieces& pieces;
  const Eigen::Vector2i plate;
  const std::vector<CausticBand>& bands;
  double beam_area = 0;
  Ranks* ranks = nullptr;
  const Progress& progress;
  std::size_t groups = 0;           // That are drawn, by all ranks, in all strips and passes.
  std::atomic<std::size_t>& drawn;  // Of these.
};

/// The number of bands that may be drawn as one: all if there are no gaps between them.
std::size_t joined_bands(const std::vector<CausticBand>& bands) {
  const bool are_together = std::all_of(bands.begin(), bands.end(), [&](const CausticBand& band) {
    return band.width > 0 || band.sample == bands[0].sample;
  });
  return are_together ? bands.size() : 1;
}

std::vector<BandRun> runs_at(Detail detail, const std::vector<CausticBand>& bands) {
  const std::size_t longest = std::size_t{1} << std::max(-detail, 0);
  std::vector<BandRun> runs;
  for (std::size_t first = 0; first < bands.size(); first += longest) {
    const std::size_t count = std::min(longest, bands.size() - first);
    runs.push_back({first, count, (bands[first].sample + bands[first + count - 1].sample) / 2, bands[first].width});
  }
  return runs;
}

void set_landings(const Drawing& drawing, const FlowPiece& piece, double sample, Worker& worker) {
  worker.at.clear();
  worker.ends.clear();
  worker.box.setEmpty();
  for (const std::uint32_t vertex : piece.vertices) {
    const FlowLanding landing = landing_at(drawing.map, vertex, sample);
    worker.at.push_back(landing.at);
    worker.ends.push_back(landing.end);
    worker.box.extend(landing.at);
  }
}

/// Power by the end of its light.
using Power = std::array<double, ray_end_count>;

bool is_whole(const FlowPiece::Triangle& triangle, const Worker& worker) {
  const auto [a, b, c] = triangle.corners;
  const auto landed = [&](std::uint16_t corner) { return worker.ends[corner] == RayEnd::plate; };
  const std::vector<Eigen::Vector2d>& at = worker.at;
  return landed(a) && landed(b) && landed(c) && !jumps(triangle.is_torn, at[a], at[b], at[c]);
}

/// Counts the power of a triangle. @return its density for its edges.
double start_light(const Drawing& drawing, const std::array<Eigen::Vector2d, 3>& at, double carried, Worker& worker,
                   Power& power) {
  const double on_plate = worker.is_all_on_plate ? 1 : part_on_plate(at[0], at[1], at[2], drawing.plate);
  power[static_cast<int>(RayEnd::plate)] += on_plate * carried;
  power[static_cast<int>(RayEnd::missed)] += (1 - on_plate) * carried;
  return worker.deposit.triangle(at[0], at[1], at[2], carried);
}

/// Draws the part of a broken triangle that is beside the edge of a shadow. @return false if that is not known.
bool draw_lit_part(const Drawing& drawing, const FlowPiece& piece, const FlowPiece::Triangle& triangle, double sample,
                   double carried, Worker& worker, Power& power) {
  std::array<std::uint32_t, 3> vertices{};
  std::array<Cutoff, 3> cutoffs;
  RayEnd dark = RayEnd::plate;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint16_t corner = triangle.corners[i];
    vertices[i] = piece.vertices[corner];
    cutoffs[i] = piece.cutoffs[corner];
    if (worker.ends[corner] != RayEnd::plate) dark = worker.ends[corner];
  }
  const auto lit = lit_part(drawing.map, vertices, cutoffs, sample);
  if (!lit) return false;
  for (const auto& [at, part] : *lit) {
    const double density = start_light(drawing, at, part * carried, worker, power);
    for (std::size_t i = 0; density != 0 && i < 3; ++i) worker.deposit.add_edge(at[i], at[(i + 1) % 3], density);
  }
  power[static_cast<int>(dark)] += std::max(1 - (*lit)[0].part - (*lit)[1].part, 0.0) * carried;
  return true;
}

/// Finds the light of broken triangles: each corner has a third, which whole triangles beside it get. In a pixel of its
/// own it would be a bright dot wherever the light around it is spread far. Only without such triangles it is added
/// here, as a point.
void share_corners(const Drawing& drawing, const FlowPiece& piece, double sample, double unit, Worker& worker,
                   Power& power) {
  worker.corners.clear();
  if (piece.always_lands && !piece.has_torn) return;
  worker.corners.resize(piece.vertices.size());
  for (const FlowPiece::Triangle& triangle : piece.triangles) {
    const bool whole = is_whole(triangle, worker);
    if (!whole && draw_lit_part(drawing, piece, triangle, sample, unit * triangle.area, worker, power)) continue;
    const double third = unit * triangle.area / 3;
    for (const std::uint16_t corner : triangle.corners) {
      const RayEnd end = worker.ends[corner];
      if (whole)
        ++worker.corners[corner].triangles;
      else if (end != RayEnd::plate)
        power[static_cast<int>(end)] += third;
      else if (is_on_plate(worker.at[corner], drawing.plate))
        worker.corners[corner].power += third;
      else  // Triangles beside the plate are large: their light must not come onto it.
        power[static_cast<int>(RayEnd::missed)] += third;
    }
  }
  for (std::size_t i = 0; i < worker.corners.size(); ++i) {
    const CornerLight& light = worker.corners[i];
    if (light.triangles > 0 || light.power == 0) continue;
    power[static_cast<int>(RayEnd::plate)] += light.power;
    worker.deposit.add_point(worker.at[i], light.power);
  }
}

/// The density of a triangle for its edges; 0 if it is broken.
/// @param carried  Its own power.
double start_triangle(const Drawing& drawing, const FlowPiece::Triangle& triangle, double carried, Worker& worker,
                      Power& power) {
  if (!worker.corners.empty()) {
    if (!is_whole(triangle, worker)) return 0;
    for (const std::uint16_t corner : triangle.corners)
      carried += worker.corners[corner].power / worker.corners[corner].triangles;
  }
  const auto [a, b, c] = triangle.corners;
  return start_light(drawing, {worker.at[a], worker.at[b], worker.at[c]}, carried, worker, power);
}

/// Draws a piece at one place among the wavelength samples.
/// @param unit  The power of a triangle of unit area.
void draw_piece(const Drawing& drawing, const FlowPiece& piece, double sample, double unit, Worker& worker,
                Power& power) {
  set_landings(drawing, piece, sample, worker);
  const Eigen::AlignedBox2d plate(Eigen::Vector2d::Zero(), drawing.plate.cast<double>());
  if (piece.always_lands && !plate.intersects(worker.box)) {
    power[static_cast<int>(RayEnd::missed)] += unit * piece.area;
    return;
  }
  worker.is_all_on_plate = piece.always_lands && plate.contains(worker.box);
  std::vector<double>& densities = worker.densities;
  densities.clear();
  share_corners(drawing, piece, sample, unit, worker, power);
  for (const FlowPiece::Triangle& triangle : piece.triangles)
    densities.push_back(start_triangle(drawing, triangle, unit * triangle.area, worker, power));
  const auto density = [&](std::uint16_t triangle) {
    return triangle == FlowPiece::Edge::none ? 0 : densities[triangle];
  };
  for (const FlowPiece::Edge& edge : piece.edges) {
    const double difference = density(edge.along) - density(edge.against);
    if (difference != 0) worker.deposit.add_edge(worker.at[edge.from], worker.at[edge.to], difference);
  }
}

void add_power(const Drawing& drawing, const Pass& pass, const BandRun& run, const Power& power, PowerSums& sums) {
  for (std::size_t i = run.first; i < run.first + run.count; ++i) {
    const CausticBand& band = drawing.bands[i];
    if (!pass.counts(band)) continue;
    for (int end = 0; end < ray_end_count; ++end)
      sums[band.channel][end] += static_cast<std::uint64_t>(power_unit * band.weight * power[end]);
  }
}

/// Draws the triangles of a group at all their places.
/// @param counts  Whether their power is counted.
void draw_group(const Drawing& drawing, const Pass& pass, std::size_t group, bool counts, Worker& worker) {
  for (const FlowPiece& piece : pieces_of(drawing.pieces, group))
    for (const BandRun& run : runs_at(piece.detail, drawing.bands)) {
      AreaDeposit::PlaneWeights plane_weights{};
      bool has_power = false;  // Light without colour has power, too.
      for (std::size_t i = run.first; i < run.first + run.count; ++i) {
        for (std::size_t k = 0; k < planes; ++k) plane_weights[k] += pass.plane_weights[i][k];
        has_power = has_power || (counts && pass.counts(drawing.bands[i]));
      }
      if (plane_weights == AreaDeposit::PlaneWeights{} && !has_power) continue;
      worker.deposit.set_plane_weights(plane_weights);
      Power power{};
      const int parts = std::max(piece.detail, 0) + 1;
      for (int part = 0; part < parts; ++part)
        draw_piece(drawing, piece, run.sample + ((part + 0.5) / parts - 0.5) * run.width, 1 / drawing.beam_area / parts,
                   worker, power);
      if (counts) add_power(drawing, pass, run, power, worker.power);
    }
}

/// Rows of the plate that are drawn together.
struct Strip {
  int first = 0, end = 0;

  /// Whether the power of a group is counted with this strip: it is the first one that has its light.
  bool counts(std::pair<float, float> rows, int height) const {
    const float row = std::clamp(rows.first, 0.0f, static_cast<float>(height - 1));
    return row >= static_cast<float>(first) && row < static_cast<float>(end);
  }
  bool has_light(std::pair<float, float> rows) const {
    return rows.first <= static_cast<float>(end) && rows.second >= static_cast<float>(first);
  }
};

/// As many rows as the memory of all threads of the root allows. The result does not depend on it.
std::vector<Strip> strips_of(const Eigen::Vector2i& plate, Ranks* ranks) {
  const auto threads = static_cast<std::size_t>(broadcast(ranks, tbb::this_task_arena::max_concurrency()));
  const std::size_t row = 8 * planes * (static_cast<std::size_t>(plate.x()) + 3);
  const int rows = static_cast<int>(std::clamp<std::size_t>(max_memory / (threads * row), 1, plate.y()));
  std::vector<Strip> strips;
  for (int first = 0; first < plate.y(); first += rows) strips.push_back({first, std::min(first + rows, plate.y())});
  return strips;
}

/// Adds what the threads have deposited to the films.
void add_to_films(const Pass& pass, const std::vector<AreaDeposit>& joined, const Strip& strip, int width) {
  std::vector<const AreaDeposit*> deposits;
  for (const AreaDeposit& each : joined) deposits.push_back(&each);
  tbb::parallel_for(strip.first, strip.end, [&](int y) {
    std::vector<double> row(static_cast<std::size_t>(width));
    for (std::size_t k = 0; k < planes; ++k) {
      if (!pass.targets[k]) continue;
      AreaDeposit::read_row(deposits, y, static_cast<int>(k), row.data());
      double* const target = pass.targets[k] + static_cast<std::size_t>(y) * row.size();
      for (std::size_t x = 0; x < row.size(); ++x) target[x] += pass.gain * row[x];
    }
  });
}

/// The passes that fill the films. Without irradiance the power of all channels is counted with the colours.
std::vector<Pass> passes_of(const std::vector<CausticBand>& bands, double gain, Caustic& caustic) {
  const auto channels = caustic.power.size();
  std::vector<Pass> passes;
  const auto add = [&](Pass pass) {
    // Weights are divided by the greatest sum of a plane, so that no sum of integers is too great.
    AreaDeposit::PlaneWeights sums{};
    for (const AreaDeposit::PlaneWeights& each : pass.plane_weights)
      for (std::size_t k = 0; k < planes; ++k) sums[k] += std::abs(each[k]);
    const double greatest = *std::max_element(sums.begin(), sums.end());
    if (greatest == 0 && pass.first_channel == pass.end_channel) return;
    for (AreaDeposit::PlaneWeights& plane_weights : pass.plane_weights)
      for (double& share : plane_weights) share /= greatest > 0 ? greatest : 1;
    pass.gain = gain * greatest;
    passes.push_back(std::move(pass));
  };
  Pass colors;
  for (const CausticBand& band : bands)
    colors.plane_weights.push_back({band.color[0], band.color[1], band.color[2], 0});
  for (int c = 0; c < 3; ++c) colors.targets[static_cast<std::size_t>(c)] = caustic.color.plane(c);
  if (caustic.irradiance.channels == 0) colors.end_channel = channels;
  add(std::move(colors));
  for (std::size_t first = 0; first < channels && caustic.irradiance.channels > 0; first += planes) {
    Pass pass;
    pass.first_channel = first;
    pass.end_channel = std::min(first + planes, channels);
    for (std::size_t channel = first; channel < pass.end_channel; ++channel)
      pass.targets[channel - first] = caustic.irradiance.plane(static_cast<int>(channel));
    for (const CausticBand& band : bands) {
      AreaDeposit::PlaneWeights plane_weights{};
      if (band.channel >= first && band.channel < pass.end_channel) plane_weights[band.channel - first] = band.weight;
      pass.plane_weights.push_back(plane_weights);
    }
    add(std::move(pass));
  }
  return passes;
}

/// The ends of each channel's light, at its last band.
void count_ends(const FlowMap& map, const Plate& plate, const std::vector<CausticBand>& bands, Caustic& caustic) {
  std::vector<double> samples(caustic.ends.size(), -1);
  for (const CausticBand& band : bands) samples[band.channel] = band.sample;
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t channel) {
    for (std::size_t i = 0; i < map.starts.size() && samples[channel] >= 0; ++i) {
      const FlowLanding landing = landing_at(map, i, samples[channel]);
      const bool is_beside = landing.end == RayEnd::plate && !is_on_plate(landing.at, plate.resolution);
      ++caustic.ends[channel][static_cast<int>(is_beside ? RayEnd::missed : landing.end)];
    }
  });
}

void add_power(const PowerSums& more, PowerSums& power) {
  for (std::size_t channel = 0; channel < power.size(); ++channel)
    for (int end = 0; end < ray_end_count; ++end) power[channel][end] += more[channel][end];
}

/// Adds up what all ranks have drawn of a strip.
/// @param deposits  Of the threads of this rank; afterwards one, of all.
/// @param power     Of this rank; at the root, of all.
void join_strip(const Drawing& drawing, const Strip& strip, std::vector<AreaDeposit>& deposits, PowerSums& power) {
  if (deposits.empty()) deposits.emplace_back(drawing.plate.x(), drawing.plate.y(), strip.first, strip.end);
  for (; deposits.size() > 1; deposits.pop_back()) deposits[0].add(deposits.back().sums());
  gather_in_turn(drawing.ranks, [&](Archive& archive) {
    for (auto& of_channel : power) archive.copy_sums(of_channel.data(), of_channel.size());
  });
  drawing.ranks->sum(deposits[0].sums());
}

void draw_strip(const Drawing& drawing, const Pass& pass, const Strip& strip, PowerSums& power) {
  const std::thread::id caller = std::this_thread::get_id();
  const int width = drawing.plate.x(), height = drawing.plate.y();
  tbb::enumerable_thread_specific<Worker> workers([&] {
    return Worker{AreaDeposit(width, height, strip.first, strip.end), PowerSums(power.size())};
  });
  tbb::parallel_for(std::size_t{0}, drawing.pieces.groups(), [&](std::size_t group) {
    if (drawing.progress.cancelled) throw Cancelled();
    const bool counts = strip.counts(drawing.pieces.rows[group], height);
    if (is_mine(drawing.ranks, group) && (counts || strip.has_light(drawing.pieces.rows[group])))
      draw_group(drawing, pass, group, counts, workers.local());
    const std::size_t drawn = ++drawing.drawn;
    if (std::this_thread::get_id() == caller) drawing.progress.update("drawing light", drawn, drawing.groups);
  });
  std::vector<AreaDeposit> deposits;
  PowerSums drawn(power.size());
  for (Worker& worker : workers) {
    worker.deposit.flush();
    deposits.push_back(std::move(worker.deposit));
    add_power(worker.power, drawn);
  }
  if (drawing.ranks) join_strip(drawing, strip, deposits, drawn);
  add_power(drawn, power);
  if (!deposits.empty()) add_to_films(pass, deposits, strip, width);
}

}  // namespace

int band_count(const FlowMap& map, int channels, const BandStep& step) {
  if (map.wavelengths == 1) return channels;
  std::vector<float> sweeps;
  for (std::size_t i = 0; i < map.starts.size(); ++i) {
    float sweep = 0;
    for (std::size_t sample = 1; sample < map.wavelengths; ++sample) {
      const std::size_t at = i * map.wavelengths + sample;
      if (map.ends[at] == RayEnd::plate && map.ends[at - 1] == RayEnd::plate)
        sweep += (map.landings[at] - map.landings[at - 1]).norm();
    }
    if (sweep > 0) sweeps.push_back(sweep);  // Straight light does not count.
  }
  if (sweeps.empty()) sweeps.push_back(0);
  const auto place = static_cast<std::ptrdiff_t>(swept_share * static_cast<double>(sweeps.size() - 1));
  std::nth_element(sweeps.begin(), sweeps.begin() + place, sweeps.end());
  const double wanted = std::max<double>(step.least, sweeps[static_cast<std::size_t>(place)] / step.pixels);
  const double most = std::max(1.0, std::floor(static_cast<double>(step.most) / channels));
  return channels * static_cast<int>(std::clamp(std::ceil(wanted / channels), 1.0, most));
}

Caustic draw_caustic(const FlowMap& map, const Plate& plate, const std::vector<CausticBand>& bands,
                     const CausticSettings& settings, const Progress& progress) {
  const std::size_t channels = settings.channels;
  const int width = plate.resolution.x(), height = plate.resolution.y();
  Caustic caustic;
  caustic.color = Film(width, height, 3);
  if (settings.by_channel) caustic.irradiance = Film(width, height, static_cast<int>(channels));
  caustic.power.assign(channels, {});
  caustic.ends.assign(channels, {});
  count_ends(map, plate, bands, caustic);
  double area = 0, widest = 0;
  for (const FlowTriangle& triangle : map.triangles) area += triangle.area;
  for (const CausticBand& band : bands) widest = std::max(widest, band.width);
  const FlowPieces pieces = divide_map(map, widest / settings.step, joined_bands(bands));
  const std::vector<Pass> passes = passes_of(bands, area / plate.pixel_area(), caustic);
  const std::vector<Strip> strips = strips_of(plate.resolution, settings.ranks);
  const std::size_t all = passes.size() * strips.size() * pieces.groups();
  std::atomic<std::size_t> drawn{0};
  const Drawing drawing{map, pieces, plate.resolution, bands, area, settings.ranks, progress, all, drawn};
  PowerSums power(channels);
  for (const Pass& pass : passes)
    for (const Strip& strip : strips) draw_strip(drawing, pass, strip, power);
  for (std::size_t channel = 0; channel < channels; ++channel)
    for (int end = 0; end < ray_end_count; ++end)
      caustic.power[channel][end] = static_cast<double>(power[channel][end]) / power_unit;
  progress.update("drawing light", all, all);
  return caustic;
}

}  // namespace tensorray
