#include "integrators/lens/lens.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/LU>
#include <tbb/parallel_for.h>

#include "base/process/job.h"
#include "base/process/seconds.h"
#include "integrators/lens/lens_view.h"
#include "renderer/coverage/planar_mesh.h"
#include "tracing/flow_drawing/flow_view.h"

namespace tensorray {
namespace {

using Eigen::Affine2d;
using Eigen::Vector2d;

constexpr double tolerance = 0.5;             // Wanted error of landings, pixels.
constexpr double finest_of_scatter = 0.25;    // Size of the smallest quads, pixels: gaps at tears are as wide.
constexpr double finest_of_gather = 1;        // There, samples in torn quads are traced on their own.
constexpr double same_place = 1e-3;           // Pixels: sheets whose starts are nearer than this count as one.
constexpr std::size_t max_starts = 1u << 14;  // The map has at most so many vertices, plus `starts_per_pixel`.

/// Maps pixels of the receiver along the light to coordinates in the image's plane.
Affine2d straight_map(const Plate& receiver, const Plate& image, const Eigen::Vector3d& direction) {
  const auto seen = [&](const Vector2d& pixel) {
    const Eigen::Vector3d point = receiver.to_world(pixel), normal = image.normal();
    return plane_coordinates(image, point + normal.dot(image.center - point) / normal.dot(direction) * direction);
  };
  Affine2d map;
  map.translation() = seen({0, 0});
  map.linear() << seen({1, 0}) - map.translation(), seen({0, 1}) - map.translation();
  return map;
}

/// The part of the image whose light may reach the receiver: what is before the volume, and what straight light shows.
Eigen::AlignedBox2d useful_starts(const LensLight& light, const TriangleMesh& volume) {
  const Plate& plane = light.setup.image.plane;
  Eigen::AlignedBox2d useful;
  for (const Eigen::Vector3d& vertex : volume.vertices) {
    const double ahead = plane.normal().dot(vertex - plane.center) / plane.normal().dot(light.setup.direction);
    useful.extend(plane_coordinates(plane, vertex - ahead * light.setup.direction));
  }
  const Vector2d size = light.setup.receiver.resolution.cast<double>();
  for (const Vector2d& corner : {Vector2d(0, 0), Vector2d(size.x(), 0), Vector2d(0, size.y()), size})
    useful.extend(light.straight * corner);
  const Eigen::AlignedBox2d image(-plane.size / 2, plane.size / 2);
  const Eigen::AlignedBox2d part = useful.intersection(image);
  return part.isEmpty() ? image : part;
}

/// The plate of the map. In `gather` its pixels are those of the receiver, as straight light projects them.
Plate plate_of_landings(const LensLight& light) {
  if (!gathers(light)) return light.setup.receiver;
  Plate plate = light.setup.image.plane;
  const double pixel = std::sqrt(std::abs(light.straight.linear().determinant()));
  plate.resolution = (plate.size / pixel).array().ceil().max(1).min(1e6).cast<int>();
  plate.size = pixel * plate.resolution.cast<double>();
  return plate;
}

/// Parallel light that starts on a rectangle of a plane.
Beam beam_from(const Plate& plane, const Eigen::AlignedBox2d& starts, const Eigen::Vector3d& direction) {
  Beam beam;
  beam.direction = direction;
  beam.center = plane.center;
  beam.right = plane.right;
  beam.up = plane.up;
  using Box = Eigen::AlignedBox2d;
  for (const Box::CornerType corner : {Box::BottomLeft, Box::BottomRight, Box::TopRight, Box::TopLeft})
    beam.aperture.push_back(starts.corner(corner));
  return beam;
}

FlowSettings flow_settings(const LensLight& light) {
  FlowSettings settings;
  settings.flexibilities = light.settings.flexibilities;
  // Light that is traced back from its end obeys the rule with the opposite sign of s.
  if (gathers(light))
    for (double& flexibility : settings.flexibilities) flexibility = -flexibility;
  settings.range = light.settings.range;
  settings.plate = light.landings;
  settings.tolerance = tolerance;
  settings.finest = gathers(light) ? finest_of_gather : finest_of_scatter;
  settings.silhouette = false;
  settings.beside = gathers(light) && light.setup.image.wraps;
  settings.job = light.settings.job;
  settings.is_kept = true;
  settings.max_starts =
      max_starts + starts_per_pixel * static_cast<std::size_t>(light.setup.receiver.resolution.prod());
  return settings;
}

/// The LensPoint of a place on the receiver.
/// @param pixel  The place, in pixels.
LensPoint make_point(const LensView& view, const Vector2d& pixel, const FlowPoint& seen) {
  const LensLight& light = view.light;
  LensPoint point;
  point.end = static_cast<LensEnd>(seen.end);
  if (seen.end != RayEnd::plate) return point;
  const Vector2d at = image_point(view, seen);
  const Eigen::Matrix2d by_pixel = image_by_pixel(view, seen);
  point.st = texture_coordinates(light, at);
  point.end = sees_image(light, point.st) ? LensEnd::image : LensEnd::outside;
  point.per_pixel = light.setup.image.plane.size.cwiseInverse().asDiagonal() * by_pixel;
  point.displacement =
      plane_point(light.setup.image.plane, at) - plane_point(light.setup.image.plane, light.straight * pixel);
  point.log_stretch = -principal_stretch(by_pixel * to_pixels(light.setup.receiver).linear()).logs.reverse();
  point.log_magnification = point.log_stretch.sum();
  point.length = seen.length;
  point.folds = seen.sheets;
  return point;
}

/// @param obstacles  That the picture shows, if any.
void draw_tile(const LensView& view, int tile, const std::optional<Geometry>& obstacles, LensPicture& picture,
               TraceCounts& counts) {
  const Eigen::AlignedBox2i box = view.flow.pixels(tile);
  const int columns = box.sizes().x() + 1, rows = box.sizes().y() + 1;
  const std::size_t reference = view.reference;
  const TileView centers = view_tile(view, tile, 1, {{0, 0, reference, reference}}, {}, counts);
  TileShader shader(view, tile, counts);
  PixelLight light;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      light.color.setZero();
      light.channels.assign(picture.ends.size(), 0);
      light.alpha.assign(view.bands.size(), 0);
      shader.shade(x, y, light);
      const Eigen::Vector2i at = box.min() + Eigen::Vector2i(x, y);
      const auto pixel = static_cast<std::size_t>(at.y()) * picture.color.width + at.x();
      const double alpha = *std::max_element(light.alpha.begin(), light.alpha.end());
      Eigen::Vector4d seen;
      seen << light.color, std::min(alpha, 1.0);  // Rounding may make the sum greater than 1.
      if (obstacles) draw_obstacles(*obstacles, view.light.setup, view.light.settings.samples, at, seen);
      for (int c = 0; c < 3; ++c) picture.color.plane(c)[pixel] = seen[c];
      picture.alpha[pixel] = seen[3];
      for (int c = 0; c < picture.radiance.channels; ++c)
        picture.radiance.plane(c)[pixel] = light.channels[static_cast<std::size_t>(c)];
      picture.points[pixel] = make_point(view, at.cast<double>() + Vector2d(0.5, 0.5),
                                         centers[reference][static_cast<std::size_t>(y * columns + x)]);
    }
}

/// Copies the pixels of a tile to or from bytes.
void copy_tile(const LensView& view, int tile, LensPicture& picture, Archive& archive) {
  const Eigen::AlignedBox2i box = view.flow.pixels(tile);
  const auto columns = static_cast<std::size_t>(box.sizes().x()) + 1;
  for (int y = box.min().y(); y <= box.max().y(); ++y) {
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.color.width) +
                              static_cast<std::size_t>(box.min().x());
    const auto copy = [&](auto* values) { archive.copy(values + first, columns * sizeof *values); };
    for (int c = 0; c < 3; ++c) copy(picture.color.plane(c));
    for (int c = 0; c < picture.radiance.channels; ++c) copy(picture.radiance.plane(c));
    copy(picture.alpha.data());
    copy(picture.points.data());
  }
}

/// The landings at the reference.
PlanarMesh reference_mesh(const LensLight& light) {
  PlanarMesh mesh;
  std::vector<bool> landed;
  for (std::size_t i = 0; i < light.map.starts.size(); ++i) {
    const FlowLanding landing = landing_at(light.map, i, sample_place(light, light.settings.reference));
    mesh.vertices.push_back(landing.at);
    landed.push_back(landing.end == RayEnd::plate);
  }
  for (const FlowTriangle& triangle : light.map.triangles) {
    const auto& [a, b, c] = triangle.corners;
    if (!triangle.is_torn && landed[a] && landed[b] && landed[c]) mesh.triangles.push_back(triangle.corners);
  }
  return mesh;
}

/// Counts the places of the picture that show what each pixel sees, in `gather`: one on each sheet of the map.
void count_places(const LensView& view, LensPicture& picture) {
  const LensSetup& setup = view.light.setup;
  const PlanarMesh mesh = reference_mesh(view.light);
  const PlanarMeshSearch search(mesh);
  const double least = same_place * setup.receiver.pixel_size().minCoeff();
  tbb::parallel_for(std::size_t{0}, picture.points.size(), [&](std::size_t i) {
    LensPoint& point = picture.points[i];
    if (point.end != LensEnd::image && point.end != LensEnd::outside) return;
    thread_local std::vector<PlanarHit> hits;
    thread_local std::vector<Vector2d> places;
    search.find(view.landings * ((point.st.array() - 0.5) * setup.image.plane.size.array()).matrix(), hits);
    places.clear();
    for (const PlanarHit& hit : hits) {
      Vector2d start(0, 0);
      for (int k = 0; k < 3; ++k) start += hit.weights[k] * view.light.map.starts[mesh.triangles[hit.triangle][k]];
      if (std::none_of(places.begin(), places.end(), [&](const Vector2d& s) { return (s - start).norm() < least; }))
        places.push_back(start);
    }
    point.folds = std::max(1, static_cast<int>(places.size()));  // At least the pixel itself.
  });
}

/// The number of vertices by end, at the middle of each channel.
std::vector<EndCounts> count_ends(const LensLight& light, const std::vector<LensBand>& bands, std::size_t channels) {
  std::vector<EndCounts> ends(channels, EndCounts{});
  for (std::size_t channel = 0; channel < channels; ++channel) {
    double first = 1, last = 0;
    for (const LensBand& band : bands) {
      if (band.channel != channel) continue;
      first = std::min(first, band.begin);
      last = std::max(last, band.end);
    }
    const double place = sample_place(light, (first + last) / 2);
    for (std::size_t i = 0; i < light.map.starts.size(); ++i)
      ++ends[channel][static_cast<int>(landing_at(light.map, i, place).end)];
  }
  return ends;
}

void check(const LensImage& image, const LensSettings& settings) {
  if (settings.flexibilities.empty()) throw std::invalid_argument("a lens needs at least one wavelength");
  if (!image.texture) throw std::invalid_argument("a lens needs an image");
  if (settings.samples < 1) throw std::invalid_argument("integrator.samples must be positive");
  if (!(settings.reference >= 0 && settings.reference <= 1))
    throw std::invalid_argument("the reference is out of range: it must be a place between two flexibilities, 0 to 1");
}

constexpr double face_on = 0.45, edge_on = 0.1;  // Radiance of an obstacle; 1 is the white of the image.

/// Radiance and alpha at a place of the receiver.
Eigen::Vector2d see_obstacle(const Geometry& obstacles, const LensSetup& setup, const Eigen::Vector2d& pixel) {
  const Plate& plane = setup.image.plane;
  const Eigen::Vector3d point = setup.receiver.to_world(pixel), normal = plane.normal();
  const double to_plane = normal.dot(point - plane.center) / normal.dot(setup.direction);
  const std::optional<Hit> hit = obstacles.absorber(point, -setup.direction, to_plane);
  if (!hit) return {0, 0};
  return {edge_on + (face_on - edge_on) * std::abs(hit->normal.dot(setup.direction)), 1};
}

}  // namespace

const char* to_string(LensEnd end) {
  constexpr const char* names[lens_end_count] = {"image", "missed", "obstacle", "step_limit", "degenerate", "outside"};
  return names[static_cast<int>(end)];
}

LensLight trace_lens(const TensorField& field, const Surfaces& surfaces, const BendingSettings& bending,
                     const LensSetup& setup, const LensSettings& settings, const Progress& progress) {
  check(setup.image, settings);
  const auto start = Clock::now();
  const Plate &receiver = setup.receiver, &image = setup.image.plane;
  const bool back = settings.mode == LensMode::gather;
  const Plate &from = back ? receiver : image, &to = back ? image : receiver;
  const Eigen::Vector3d along = back ? Eigen::Vector3d(-setup.direction) : setup.direction;
  LensLight light{settings,
                  setup,
                  straight_map(receiver, image, setup.direction),
                  LensMap(field, surfaces, bending, from, to, along),
                  {},
                  {}};
  light.landings = plate_of_landings(light);
  const Eigen::AlignedBox2d starts =
      back ? Eigen::AlignedBox2d(-receiver.size / 2, receiver.size / 2) : useful_starts(light, surfaces.bounds);
  FlowSettings flow = flow_settings(light);
  if (settings.show)
    flow.show = [&](const std::function<FlowMap()>& so_far) {
      settings.show([&]() -> const LensLight& {
        light.map = so_far();
        light.settings.job = nullptr;
        return light;
      });
      light.settings.job = settings.job;
    };
  light.map = trace_flow_map(field, light.planes.geometry(), beam_from(from, starts, along), bending, flow, progress);
  light.seconds_tracing = seconds_since(start);
  return light;
}

LensPicture draw_lens(const LensLight& light, const std::vector<LensBand>& bands, const LensRadiance& radiance,
                      std::size_t channels, bool by_channel, const Progress& progress) {
  const auto start = Clock::now();
  const Eigen::Vector2i size = light.setup.receiver.resolution;
  LensPicture picture;
  picture.color = Film(size.x(), size.y(), 3);
  if (by_channel) picture.radiance = Film(size.x(), size.y(), static_cast<int>(channels));
  picture.alpha.resize(picture.color.plane_size());
  picture.points.resize(picture.color.plane_size());
  picture.ends = count_ends(light, bands, channels);
  for (int i = 0; i < 2; ++i)
    picture.straight.linear().row(i) = light.straight.linear().row(i) / light.setup.image.plane.size[i];
  picture.straight.translation() = texture_coordinates(light, light.straight.translation());

  const LensView view = make_lens_view(light, bands, radiance);
  std::optional<Geometry> obstacles;
  if (const Surfaces* shown = light.settings.obstacles) obstacles.emplace(obstacles_of(*shown));
  std::vector<TraceCounts> counts(static_cast<std::size_t>(view.flow.tiles()));
  Units tiles;
  tiles.count = counts.size();
  tiles.round = FlowView::tiles_at_once;
  tiles.make = [&](std::size_t tile) { draw_tile(view, static_cast<int>(tile), obstacles, picture, counts[tile]); };
  tiles.copy = [&](std::size_t tile, Archive& archive) { copy_tile(view, static_cast<int>(tile), picture, archive); };
  make_units(tiles, light.settings.job, "drawing the picture", progress);
  if (gathers(light) && is_root(light.settings.job ? light.settings.job->ranks : nullptr)) count_places(view, picture);
  picture.counts = {light.map.ray_steps, light.map.tensor_samples};
  for (const TraceCounts& each : counts) picture.counts += each;
  picture.seconds_drawing = seconds_since(start);
  return picture;
}

Geometry obstacles_of(const Surfaces& surfaces) {
  return Geometry({surfaces.bounds, std::nullopt, std::nullopt, surfaces.obstacles});
}

void draw_obstacles(const Geometry& obstacles, const LensSetup& setup, int samples, const Eigen::Vector2i& at,
                    Eigen::Vector4d& pixel) {
  const double open = 1 - pixel[3];
  if (!(open > 0)) return;
  Vector2d seen(0, 0);
  for (int i = 0; i < samples * samples; ++i)
    seen +=
        see_obstacle(obstacles, setup, at.cast<double>() + Vector2d(i % samples + 0.5, i / samples + 0.5) / samples);
  seen *= open / (samples * samples);
  pixel.head<3>().array() += seen[0];
  pixel[3] = std::min(pixel[3] + seen[1], 1.0);
}

}  // namespace tensorray
