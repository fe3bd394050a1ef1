#include "integrators/lens/lens.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "integrators/lens/lens_mesh.h"

namespace tensorray {
namespace {

/// What the threads share and do not change.
struct LensJob {
  const LensMap& map;
  const std::vector<LightChannel>& channels;
  const Plate& receiver;
  const LensImage& image;
  const LensSettings& settings;
  const Progress& progress;
  std::vector<double> flexibilities{};  // Of the map's light: with opposite sign for `gather`.

  /// From pixels of the receiver to the point of the image's plane that straight light shows there.
  Eigen::Affine2d straight = Eigen::Affine2d::Identity();
};

/// Coordinates, in the receiver's plane, of a position in pixels.
Eigen::Vector2d receiver_point(const LensJob& job, const Eigen::Vector2d& pixel) {
  return plane_coordinates(job.receiver, job.receiver.to_world(pixel));
}

/// Positions of a pixel's samples, in pixels.
std::vector<Eigen::Vector2d> sample_points(const LensJob& job, int x, int y) {
  std::vector<Eigen::Vector2d> points;
  const int n = job.settings.samples;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) points.emplace_back(x + (i + 0.5) / n, y + (j + 0.5) / n);
  return points;
}

Eigen::Vector2d texture_coordinates(const LensJob& job, const Eigen::Vector2d& at) {
  return (at.array() / job.image.plane.size.array() + 0.5).matrix();
}

/// Change of (s, t) per pixel along x and y, from ∂image/∂receiver.
Eigen::Matrix2d per_pixel(const LensJob& job, const Eigen::Matrix2d& image_by_receiver) {
  const Eigen::Vector2d pixel = job.receiver.pixel_size();
  return job.image.plane.size.cwiseInverse().asDiagonal() * image_by_receiver *
         Eigen::Vector2d(pixel.x(), -pixel.y()).asDiagonal();
}

bool sees_image(const LensJob& job, const Eigen::Vector2d& st) {
  constexpr double rounding = 1e-9;
  return job.image.wraps || ((st.array() >= -rounding).all() && (st.array() <= 1 + rounding).all());
}

/// What one sample of a channel adds to its pixel.
struct Shade {
  double radiance = 0, alpha = 0;
};

Shade shade(const LensJob& job, std::size_t channel, const Eigen::Vector2d& at,
            const Eigen::Matrix2d& image_by_receiver) {
  const Eigen::Vector2d st = texture_coordinates(job, at);
  if (!sees_image(job, st)) return {};
  const Eigen::Matrix2d footprint = per_pixel(job, image_by_receiver) / job.settings.samples;
  const Eigen::Vector4d texel = job.image.texture->lookup(st, footprint).cast<double>();
  const double part = 1.0 / (job.settings.samples * job.settings.samples);
  if (!(texel.w() > 0)) return {};
  return {part * texel.w() * job.image.radiance(texel.head<3>() / texel.w(), channel), part * texel.w()};
}

/// ln σ₁ >= ln σ₂ of a matrix; −∞ where it is singular, 0 where it is not finite.
Eigen::Vector2d log_singular_values(const Eigen::Matrix2d& m) {
  if (!m.allFinite()) return Eigen::Vector2d::Zero();
  const double greater =
      (std::hypot(m(0, 0) + m(1, 1), m(0, 1) - m(1, 0)) + std::hypot(m(0, 0) - m(1, 1), m(0, 1) + m(1, 0))) / 2;
  return {std::log(greater), std::log(std::abs(m.determinant())) - std::log(greater)};
}

/// The LensPoint of a position (in pixels) of the receiver that shows the point `at` of the image's plane.
/// @param log_stretch  ln σ₁ >= ln σ₂ of ∂receiver/∂image.
LensPoint make_point(const LensJob& job, const Eigen::Vector2d& pixel, const Eigen::Vector2d& at,
                     const Eigen::Matrix2d& image_by_receiver, const Eigen::Vector2d& log_stretch, double length) {
  LensPoint point;
  point.st = texture_coordinates(job, at);
  point.end = sees_image(job, point.st) ? LensEnd::image : LensEnd::outside;
  point.per_pixel = per_pixel(job, image_by_receiver);
  point.displacement = plane_point(job.image.plane, at) - plane_point(job.image.plane, job.straight * pixel);
  point.log_stretch = log_stretch;
  point.log_magnification = log_stretch.sum();
  point.length = length;
  return point;
}

void count_ends(const std::vector<LensLanding>& landings, std::size_t channels, std::vector<EndCounts>& ends) {
  for (std::size_t i = 0; i < landings.size(); ++i) ++ends[i % channels][static_cast<int>(landings[i].end)];
}

/// Counts of one row of pixels.
struct GatheredRow {
  TraceCounts counts;
  std::vector<EndCounts> ends;
};

/// The landing of the pixel's centre in the reference channel.
LensLanding reference_landing(const LensJob& job, int x, int y, const std::vector<LensLanding>& landings,
                              TraceCounts& counts) {
  const int n = job.settings.samples;
  if (n % 2 == 1) return landings[(n * n / 2) * job.channels.size() + job.settings.reference];
  LensLanding landing;
  const Eigen::Vector2d center = receiver_point(job, {x + 0.5, y + 0.5});
  counts += job.map.trace({center}, {job.flexibilities[job.settings.reference]}, &landing);
  return landing;
}

void gather_row(const LensJob& job, int y, LensPicture& picture, std::vector<LensLanding>& references,
                GatheredRow& row) {
  const std::size_t channels = job.channels.size();
  row.ends.assign(channels, EndCounts{});
  std::vector<LensLanding> landings(static_cast<std::size_t>(job.settings.samples) * job.settings.samples * channels);
  for (int x = 0; x < job.receiver.resolution.x(); ++x) {
    if (job.progress.cancelled) throw Cancelled();
    std::vector<Eigen::Vector2d> starts = sample_points(job, x, y);
    for (Eigen::Vector2d& start : starts) start = receiver_point(job, start);
    row.counts += job.map.trace(starts, job.flexibilities, landings.data());
    count_ends(landings, channels, row.ends);
    const std::size_t pixel = static_cast<std::size_t>(y) * job.receiver.resolution.x() + x;
    std::vector<double> alpha(channels);
    for (std::size_t i = 0; i < landings.size(); ++i) {
      if (landings[i].end != RayEnd::plate) continue;
      const std::size_t channel = i % channels;
      const Shade seen = shade(job, channel, landings[i].at, landings[i].jacobian);
      picture.radiance.plane(static_cast<int>(channel))[pixel] += seen.radiance;
      alpha[channel] += seen.alpha;
    }
    picture.alpha[pixel] = *std::max_element(alpha.begin(), alpha.end());
    const LensLanding& landing = references[pixel] = reference_landing(job, x, y, landings, row.counts);
    LensPoint& point = picture.points[pixel];
    point.end = static_cast<LensEnd>(landing.end);
    if (landing.end != RayEnd::plate) continue;
    const Eigen::Vector2d log_stretch = -log_singular_values(landing.jacobian).reverse();
    point = make_point(job, {x + 0.5, y + 0.5}, landing.at, landing.jacobian, log_stretch, landing.length);
  }
}

/// Calls `work(y)` for each row of the picture on all threads. Between groups of rows it calls `tell(y)` on the calling
/// thread.
template <class Tell, class Work>
void for_rows(const LensJob& job, const Tell& tell, const Work& work) {
  const int height = job.receiver.resolution.y(), rows_at_once = 8 * tbb::this_task_arena::max_concurrency();
  for (int first = 0; first < height; first += rows_at_once) {
    tell(first);
    tbb::parallel_for(first, std::min(first + rows_at_once, height), [&](int y) {
      if (job.progress.cancelled) throw Cancelled();
      work(y);
    });
  }
}

/// Counts the places of the picture that show what each pixel sees. The map from the picture to the image, as a mesh,
/// may fold; each sheet is one place.
void count_places(const LensJob& job, std::vector<LensLanding> references, LensPicture& picture) {
  const Eigen::Vector2i size = job.receiver.resolution;
  std::vector<Eigen::Vector2d> starts;
  for (int y = 0; y < size.y(); ++y)
    for (int x = 0; x < size.x(); ++x) starts.push_back(receiver_point(job, {x + 0.5, y + 0.5}));
  const double pixel = job.receiver.pixel_size().minCoeff();
  const LensMesh mesh = lattice_mesh(std::move(starts), std::move(references), size.x(), size.y(), pixel);
  const SheetSearch search(mesh, pixel);
  const auto width = static_cast<std::size_t>(size.x());
  const auto tell = [&](int y) { job.progress.update("counting folds", y, size.y()); };
  for_rows(job, tell, [&](int y) {
    std::vector<Sheet> sheets;
    for (std::size_t i = y * width; i < (y + 1) * width; ++i) {
      if (mesh.landings[i].end != RayEnd::plate) continue;
      search.find(mesh.landings[i].at, sheets);
      picture.points[i].folds = std::max(1, static_cast<int>(sheets.size()));  // At least the pixel itself.
    }
  });
}

void gather(const LensJob& job, LensPicture& picture) {
  const int height = job.receiver.resolution.y();
  std::vector<LensLanding> references(picture.points.size());
  std::vector<GatheredRow> rows(static_cast<std::size_t>(height));
  const auto tell = [&](int y) { job.progress.update("tracing rays", y, height); };
  for_rows(job, tell, [&](int y) { gather_row(job, y, picture, references, rows[static_cast<std::size_t>(y)]); });
  for (const GatheredRow& row : rows) {
    picture.counts += row.counts;
    for (std::size_t channel = 0; channel < row.ends.size(); ++channel)
      for (int end = 0; end < ray_end_count; ++end) picture.ends[channel][end] += row.ends[channel][end];
  }
  count_places(job, std::move(references), picture);
}

/// The sheet whose start is nearest to that of straight light; of equally near ones, the first.
Sheet nearest_sheet(const std::vector<Sheet>& sheets, const Eigen::Vector2d& straight) {
  return *std::min_element(sheets.begin(), sheets.end(), [&](const Sheet& a, const Sheet& b) {
    return (a.start - straight).squaredNorm() < (b.start - straight).squaredNorm();
  });
}

void scatter_row(const LensJob& job, int y, std::size_t channel, const SheetSearch& search, LensPicture& picture) {
  std::vector<Sheet> sheets;
  for (int x = 0; x < job.receiver.resolution.x(); ++x) {
    const std::size_t pixel = static_cast<std::size_t>(y) * job.receiver.resolution.x() + x;
    double alpha = 0;
    for (const Eigen::Vector2d& sample : sample_points(job, x, y)) {
      search.find(receiver_point(job, sample), sheets);
      if (sheets.empty()) continue;
      const Sheet sheet = nearest_sheet(sheets, job.straight * sample);
      const Shade seen = shade(job, channel, sheet.start, sheet.jacobian.inverse());
      picture.radiance.plane(static_cast<int>(channel))[pixel] += seen.radiance;
      alpha += seen.alpha;
    }
    picture.alpha[pixel] = std::max(picture.alpha[pixel], alpha);
    if (channel != job.settings.reference) continue;
    const Eigen::Vector2d center(x + 0.5, y + 0.5);
    search.find(receiver_point(job, center), sheets);
    if (sheets.empty()) continue;
    const Sheet sheet = nearest_sheet(sheets, job.straight * center);
    picture.points[pixel] = make_point(job, center, sheet.start, sheet.jacobian.inverse(),
                                       log_singular_values(sheet.jacobian), sheet.length);
    picture.points[pixel].folds = static_cast<int>(sheets.size());
  }
}

/// The part of the image whose light may reach the receiver: the part in front of the volume, and the part that
/// straight light shows.
Eigen::AlignedBox2d useful_starts(const LensJob& job, const TriangleMesh& volume, const Eigen::Vector3d& direction) {
  const Plate& plane = job.image.plane;
  Eigen::AlignedBox2d useful;
  for (const Eigen::Vector3d& vertex : volume.vertices) {
    const double ahead = plane.normal().dot(vertex - plane.center) / plane.normal().dot(direction);
    useful.extend(plane_coordinates(plane, vertex - ahead * direction));
  }
  const Eigen::Vector2d size = job.receiver.resolution.cast<double>();
  for (const Eigen::Vector2d& corner :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(size.x(), 0), Eigen::Vector2d(0, size.y()), size})
    useful.extend(job.straight * corner);
  const Eigen::AlignedBox2d image(-plane.size / 2, plane.size / 2);
  const Eigen::AlignedBox2d part = useful.intersection(image);
  return part.isEmpty() ? image : part;
}

/// The rotation that is nearest to the map of directions, by straight light, from the image's plane to the receiver's.
Eigen::Matrix2d straight_turn(const LensJob& job) {
  const Eigen::Vector2d pixel = job.receiver.pixel_size();
  const Eigen::Matrix2d image_by_receiver =
      job.straight.linear() * Eigen::Vector2d(1 / pixel.x(), -1 / pixel.y()).asDiagonal();
  const Eigen::JacobiSVD<Eigen::Matrix2d> svd(image_by_receiver, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixV() * svd.matrixU().transpose();
}

/// Adds to the picture what the mesh shows, row by row.
void scatter_rows(const LensJob& job, std::size_t channel, const LensMesh& mesh, const MeshReport& report,
                  LensPicture& picture) {
  const SheetSearch search(mesh, job.receiver.pixel_size().minCoeff());
  const auto tell = [&](int y) { report(static_cast<double>(y) / job.receiver.resolution.y()); };
  for_rows(job, tell, [&](int y) { scatter_row(job, y, channel, search, picture); });
}

void scatter(const LensJob& job, const TriangleMesh& volume, const Eigen::Vector3d& direction, LensPicture& picture) {
  LensMeshSettings settings;
  settings.starts = useful_starts(job, volume, direction);
  settings.target = job.receiver.size;
  settings.pixel = job.receiver.pixel_size();
  settings.turn = straight_turn(job);
  // Progress steps of a channel: half for its mesh, and half for the rows of the picture.
  constexpr std::uint64_t parts = 1000;
  for (std::size_t channel = 0; channel < job.channels.size(); ++channel) {
    const auto tell = [&](double part) {
      job.progress.update("tracing rays", channel * parts + static_cast<std::uint64_t>(part * parts),
                          job.channels.size() * parts);
    };
    const LensMesh mesh = make_lens_mesh(job.map, job.flexibilities[channel], settings, picture.counts, job.progress,
                                         [&](double part) { tell(part / 2); });
    for (const LensLanding& landing : mesh.landings) ++picture.ends[channel][static_cast<int>(landing.end)];
    scatter_rows(
        job, channel, mesh, [&](double part) { tell((1 + part) / 2); }, picture);
  }
}

/// Maps pixels of the receiver along the light to coordinates in the image's plane.
Eigen::Affine2d straight_map(const Plate& receiver, const Plate& image, const Eigen::Vector3d& direction) {
  const auto seen = [&](const Eigen::Vector2d& pixel) {
    const Eigen::Vector3d point = receiver.to_world(pixel), normal = image.normal();
    return plane_coordinates(image, point + normal.dot(image.center - point) / normal.dot(direction) * direction);
  };
  Eigen::Affine2d map;
  map.translation() = seen({0, 0});
  map.linear() << seen({1, 0}) - map.translation(), seen({0, 1}) - map.translation();
  return map;
}

void check(const std::vector<LightChannel>& channels, const LensImage& image, const LensSettings& settings) {
  if (channels.empty()) throw std::invalid_argument("a lens needs at least one wavelength");
  if (!image.texture || !image.radiance) throw std::invalid_argument("a lens needs an image");
  if (settings.samples < 1) throw std::invalid_argument("integrator.samples must be positive");
  if (settings.reference >= channels.size())
    throw std::invalid_argument("the reference channel is out of range: it must be below the number of wavelengths");
}

}  // namespace

const char* to_string(LensEnd end) {
  constexpr const char* names[lens_end_count] = {"image", "missed", "obstacle", "step_limit", "degenerate", "outside"};
  return names[static_cast<int>(end)];
}

LensPicture simulate_lens(const TensorField& field, const Surfaces& surfaces, const BendingSettings& bending,
                          const std::vector<LightChannel>& channels, const Eigen::Vector3d& direction,
                          const Plate& receiver, const LensImage& image, const LensSettings& settings,
                          const Progress& progress) {
  check(channels, image, settings);
  const auto start = std::chrono::steady_clock::now();
  const bool gathers = settings.mode == LensMode::gather;
  // Light that is traced back from its end obeys the rule with the opposite sign of s.
  const LensMap map = gathers ? LensMap(field, surfaces, bending, receiver, image.plane, -direction)
                              : LensMap(field, surfaces, bending, image.plane, receiver, direction);
  LensJob job{map, channels, receiver, image, settings, progress};  // Each has a different type.
  job.straight = straight_map(receiver, image.plane, direction);
  for (const LightChannel& channel : channels)
    job.flexibilities.push_back(gathers ? -channel.flexibility : channel.flexibility);

  const Eigen::Vector2i size = receiver.resolution;
  LensPicture picture;
  picture.radiance = Film(size.x(), size.y(), static_cast<int>(channels.size()));
  picture.alpha.resize(picture.radiance.plane_size());
  picture.points.resize(picture.radiance.plane_size());
  picture.ends.assign(channels.size(), EndCounts{});
  for (int i = 0; i < 2; ++i) picture.straight.linear().row(i) = job.straight.linear().row(i) / image.plane.size[i];
  picture.straight.translation() = texture_coordinates(job, job.straight.translation());
  if (gathers) {
    gather(job, picture);
  } else {
    scatter(job, surfaces.bounds, direction, picture);
  }
  picture.seconds_tracing = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return picture;
}

}  // namespace tensorray
