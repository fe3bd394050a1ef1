#include "integrators/flow/caustic.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <thread>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "renderer/film/area_deposit.h"

namespace tensorray {
namespace {

constexpr double even_part = 0.1;  // Densities of a square's halves that differ by less than this part of their sum ...
                                   // become one.
constexpr double most_parts = 16;  // Of a band.
constexpr std::size_t bands_of_thread = 4;     // Bands that are drawn before their sums are added to the film.
constexpr std::size_t most_memory = 1u << 28;  // Bytes for these, unless a band for each thread takes more.

/// The landings of positions at one place among the nodes.
struct Landings {
  std::vector<Eigen::Vector2d> at;  // Pixels.
  std::vector<RayEnd> ends;

  explicit Landings(std::size_t positions) : at(positions), ends(positions) {}

  void set(const FlowMap& map, std::size_t position, double node) {
    const FlowLanding landing = landing_at(map, position, node);
    at[position] = landing.at;
    ends[position] = landing.end;
  }
};

/// Power by the end of its light. `plate` also has the light that lands beside the plate.
using Power = std::array<double, ray_end_count>;

/// The density of a triangle for its edges. Light that is not spread over an area is added here.
/// @param unit  The power of a triangle of unit area.
double start_triangle(const FlowTriangle& triangle, const Landings& landings, double unit, AreaDeposit& deposit,
                      Power& power) {
  const auto [a, b, c] = triangle.corners;
  const double carried = unit * triangle.area;
  const auto landed = [&](std::uint32_t corner) { return landings.ends[corner] == RayEnd::plate; };
  if (landed(a) && landed(b) && landed(c)) {
    power[static_cast<int>(RayEnd::plate)] += carried;
    return deposit.triangle(landings.at[a], landings.at[b], landings.at[c], carried);
  }
  for (const std::uint32_t corner : triangle.corners) {
    if (landed(corner)) deposit.add_point(landings.at[corner], carried / 3);
    power[static_cast<int>(landings.ends[corner])] += carried / 3;
  }
  return 0;
}

/// Gives the two triangles of a square one density if theirs are nearly the same: the edge between them need not be
/// drawn then. Their power stays the same.
void even_out(double& a, double& b, double area_a, double area_b) {
  if (!(a * b > 0 && std::abs(a - b) < even_part * std::abs(a + b))) return;
  a = b = (area_a + area_b) / (area_a / a + area_b / b);
}

EndCounts count_ends(const Landings& landings, const Plate& plate) {
  EndCounts counts{};
  for (std::size_t i = 0; i < landings.at.size(); ++i) {
    const Eigen::Array2d at = landings.at[i].array();
    const bool beside = (at < 0).any() || (at > plate.resolution.cast<double>().array()).any();
    const RayEnd end = landings.ends[i] == RayEnd::plate && beside ? RayEnd::missed : landings.ends[i];
    ++counts[static_cast<int>(end)];
  }
  return counts;
}

/// A band that is being drawn.
struct Drawing {
  AreaDeposit deposit;
  Power power{};
  EndCounts ends{};
};

/// The triangles of a band that are drawn in the same number of parts.
struct Sweep {
  std::vector<std::uint32_t> triangles, positions;
  std::vector<const FlowEdge*> edges;  // All of which one side, at least, is one of the triangles.
};

/// Distance that the light of a position moves within a band, pixels; 0 if it does not land at both ends.
double movement(const FlowMap& map, std::size_t position, const CausticBand& band) {
  const double last = static_cast<double>(map.nodes - 1);
  const FlowLanding begin = landing_at(map, position, std::max(band.node - band.width / 2, 0.0)),
                    end = landing_at(map, position, std::min(band.node + band.width / 2, last));
  return begin.end == RayEnd::plate && end.end == RayEnd::plate ? (end.at - begin.at).norm() : 0;
}

/// Sorts the triangles by the number of their parts: those of n parts are at [n - 1].
std::vector<Sweep> sort_by_parts(const FlowMap& map, const CausticBand& band) {
  std::vector<std::uint8_t> parts_of_position(map.starts.size(), 1);
  for (std::size_t i = 0; band.width > 0 && i < map.starts.size(); ++i)
    parts_of_position[i] = static_cast<std::uint8_t>(std::clamp(std::ceil(movement(map, i, band)), 1.0, most_parts));
  std::vector<Sweep> sweeps(static_cast<std::size_t>(most_parts));
  std::vector<std::uint8_t> parts(map.triangles.size());
  std::vector<std::uint16_t> drawn_in(map.starts.size());  // A bit for each sweep.
  for (std::uint32_t t = 0; t < map.triangles.size(); ++t) {
    for (const std::uint32_t corner : map.triangles[t].corners)
      parts[t] = std::max(parts[t], parts_of_position[corner]);
    Sweep& sweep = sweeps[parts[t] - 1u];
    sweep.triangles.push_back(t);
    for (const std::uint32_t corner : map.triangles[t].corners) {
      const auto bit = static_cast<std::uint16_t>(1u << (parts[t] - 1u));
      if (!(drawn_in[corner] & bit)) sweep.positions.push_back(corner);
      drawn_in[corner] |= bit;
    }
  }
  for (const FlowEdge& edge : map.edges) {
    const int along = edge.along == FlowEdge::none ? 0 : parts[edge.along],
              against = edge.against == FlowEdge::none ? 0 : parts[edge.against];
    if (along > 0) sweeps[along - 1].edges.push_back(&edge);
    if (against > 0 && against != along) sweeps[against - 1].edges.push_back(&edge);
  }
  return sweeps;
}

/// Draws triangles at one place among the nodes.
/// @param densities  One for each triangle of the map; 0, before and afterwards.
void draw_triangles(const FlowMap& map, const Sweep& sweep, double node, double unit, Landings& landings,
                    std::vector<double>& densities, Drawing& drawing) {
  for (const std::uint32_t position : sweep.positions) landings.set(map, position, node);
  for (const std::uint32_t t : sweep.triangles)
    densities[t] = start_triangle(map.triangles[t], landings, unit, drawing.deposit, drawing.power);
  for (const FlowEdge* edge : sweep.edges)
    if (edge->is_diagonal)
      even_out(densities[edge->along], densities[edge->against], map.triangles[edge->along].area,
               map.triangles[edge->against].area);
  const auto density = [&](std::uint32_t triangle) { return triangle == FlowEdge::none ? 0 : densities[triangle]; };
  for (const FlowEdge* edge : sweep.edges) {
    const double difference = density(edge->along) - density(edge->against);
    if (difference != 0) drawing.deposit.add_edge(landings.at[edge->from], landings.at[edge->to], difference);
  }
  for (const std::uint32_t t : sweep.triangles) densities[t] = 0;
}

void draw_band(const FlowMap& map, const Plate& plate, const CausticBand& band, double unit, Drawing& drawing) {
  drawing.deposit.clear();
  drawing.power = {};
  Landings landings(map.starts.size());
  std::vector<double> densities(map.triangles.size());
  const std::vector<Sweep> sweeps = sort_by_parts(map, band);
  for (std::size_t parts = 1; parts <= sweeps.size(); ++parts)
    for (std::size_t part = 0; part < parts && !sweeps[parts - 1].triangles.empty(); ++part) {
      const double place = (static_cast<double>(part) + 0.5) / static_cast<double>(parts) - 0.5;
      draw_triangles(map, sweeps[parts - 1], band.node + place * band.width, unit / static_cast<double>(parts),
                     landings, densities, drawing);
    }
  for (std::size_t i = 0; i < map.starts.size(); ++i) landings.set(map, i, band.node);
  drawing.ends = count_ends(landings, plate);
}

/// Adds a group of bands to the films, in the order of the bands. @return the power on the plate, by band.
std::vector<double> add_to_films(const std::vector<Drawing>& drawings, const CausticBand* bands, std::size_t count,
                                 double gain, Caustic& caustic) {
  const auto width = static_cast<std::size_t>(caustic.color.width),
             height = static_cast<std::size_t>(caustic.color.height);
  std::vector<double> rows(count * height);
  tbb::parallel_for(std::size_t{0}, height, [&](std::size_t y) {
    std::vector<double> row(width);
    for (std::size_t k = 0; k < count; ++k) {
      drawings[k].deposit.read_row(static_cast<int>(y), row.data());
      rows[k * height + y] = std::accumulate(row.begin(), row.end(), 0.0);
      const auto add = [&](double* plane, double weight) {
        for (std::size_t x = 0; x < width; ++x) plane[y * width + x] += weight * row[x];
      };
      for (int c = 0; c < 3; ++c) add(caustic.color.plane(c), gain * bands[k].color[c]);
      if (caustic.irradiance.channels > 0)
        add(caustic.irradiance.plane(static_cast<int>(bands[k].channel)), gain * bands[k].weight);
    }
  });
  std::vector<double> sums(count);
  for (std::size_t i = 0; i < rows.size(); ++i) sums[i / height] += rows[i];
  return sums;
}

}  // namespace

Caustic draw_caustic(const FlowMap& map, const Plate& plate, const std::vector<CausticBand>& bands,
                     std::size_t channels, bool by_channel, const Progress& progress) {
  const int width = plate.resolution.x(), height = plate.resolution.y();
  Caustic caustic;
  caustic.color = Film(width, height, 3);
  if (by_channel) caustic.irradiance = Film(width, height, static_cast<int>(channels));
  caustic.power.assign(channels, {});
  caustic.ends.assign(channels, {});
  double area = 0;
  for (const FlowTriangle& triangle : map.triangles) area += triangle.area;
  const std::thread::id caller = std::this_thread::get_id();
  const auto threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  const std::size_t fitting = most_memory / (8 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const std::size_t at_once = std::clamp(fitting, threads, bands_of_thread * threads);
  std::vector<Drawing> drawings(std::min(at_once, bands.size()), Drawing{AreaDeposit(width, height)});
  for (std::size_t first = 0; first < bands.size(); first += drawings.size()) {
    const std::size_t count = std::min(drawings.size(), bands.size() - first);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t k) {
      if (progress.cancelled) throw Cancelled();
      if (std::this_thread::get_id() == caller) progress.update("drawing light", first + k, bands.size());
      draw_band(map, plate, bands[first + k], 1 / area, drawings[k]);
    });
    const std::vector<double> on_plate =
        add_to_films(drawings, &bands[first], count, area / plate.pixel_area(), caustic);
    for (std::size_t k = 0; k < count; ++k) {
      const CausticBand& band = bands[first + k];
      Power power = drawings[k].power;
      double& landed = power[static_cast<int>(RayEnd::plate)];
      power[static_cast<int>(RayEnd::missed)] += landed - on_plate[k];
      landed = on_plate[k];
      for (int end = 0; end < ray_end_count; ++end) caustic.power[band.channel][end] += band.weight * power[end];
      caustic.ends[band.channel] = drawings[k].ends;
    }
  }
  progress.update("drawing light", bands.size(), bands.size());
  return caustic;
}

}  // namespace tensorray
