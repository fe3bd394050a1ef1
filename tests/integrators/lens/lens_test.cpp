#include "integrators/lens/lens.h"

#include <map>
#include <numeric>

#include <Eigen/LU>
#include <tbb/global_control.h>

#include "renderer/sampling/random.h"
#include "tests/tracing/support.h"

namespace tensorray {
namespace {

const LensMode modes[] = {LensMode::gather, LensMode::scatter};

/// Across z, its normal +z: light goes along it.
Plate lens_plate(double z, const Vector2d& size, const Vector2i& resolution = {1, 1}) {
  Plate plate;
  plate.center = {0, 0, z};
  plate.size = size;
  plate.resolution = resolution;
  return plate;
}

/// Noise without a pattern.
Image noise(int width, int height) {
  Image image(width, height, {"R", "G", "B"});
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(random_uniform(1, i, 0));
  return image;
}

/// A square of greys.
Image grey(int size, const std::function<double(int x, int y)>& value) {
  Image image(size, size, {"R", "G", "B"});
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) std::fill_n(image.pixel(x, y), 3, static_cast<float>(value(x, y)));
  return image;
}

Image uniform(double value) {
  return grey(16, [value](int, int) { return value; });
}

/// The tensor by which light along z bends towards a vector.
Matrix3d bends_along_z(const Vector3d& towards) {
  Matrix3d T = Matrix3d::Zero();
  T.col(2) = towards;
  return T;
}

BendingSettings precise_bending() {
  BendingSettings settings = settings_of(BendingMethod::dopri5, 0.5);
  settings.tolerance = 1e-8;
  return settings;
}

/// Light along +z of the flexibility 0.1 from an image to a receiver, either 1.5 from the middle of the field.
struct Bench {
  TensorField field;
  Surfaces surfaces;
  BendingSettings bending = precise_bending();
  Plate receiver;
  Texture texture;
  LensImage image;
  LensSettings settings;

  Bench(TensorField field_, const Plate& receiver_, const Vector2d& image_size, Image picture, Wrap wrap = Wrap::none)
      : field(std::move(field_)), surfaces(surfaces_of(field)), receiver(receiver_), texture(std::move(picture), wrap) {
    image.texture = &texture;
    image.plane = lens_plate(-1.5, image_size);
    image.wraps = wrap == Wrap::repeat || wrap == Wrap::mirror;
    settings.flexibilities = {0.1};
  }

  /// The red of the image, as the one channel of these bands.
  LensPicture simulate(LensMode mode, const std::vector<LensBand>& bands, const Progress& progress) const {
    LensSettings with_mode = settings;
    with_mode.mode = mode;
    const LensLight light =
        trace_lens(field, surfaces, bending, {receiver, image, Vector3d::UnitZ()}, with_mode, progress);
    const auto radiance = [](const Vector3d& rgb, std::size_t first, std::size_t last, double* radiances) {
      std::fill(radiances, radiances + (last - first), rgb.x());
    };
    return draw_lens(light, bands, radiance, 1, true, progress);
  }
  LensPicture simulate(LensMode mode, const Progress& progress = Progress()) const {
    return simulate(mode, {{0, 0, 0, 1, Vector3d::UnitX()}}, progress);
  }

  /// Of light of the flexibility `s`.
  LensPicture simulate(LensMode mode, double s) {
    settings.flexibilities = {s};
    return simulate(mode);
  }

  /// In the light of equal bands of a range of flexibilities, or of single ones.
  LensPicture simulate(LensMode mode, const std::vector<double>& flexibilities, bool range, int count) {
    settings.flexibilities = flexibilities;
    settings.range = range;
    std::vector<LensBand> bands;
    for (int i = 0; i < count; ++i) {
      const double begin = static_cast<double>(i) / (range ? count : count - 1);
      bands.push_back({begin, range ? (i + 1.0) / count : begin, 0, 1.0 / count, Vector3d(1, 1, 1) / count});
    }
    return simulate(mode, bands, Progress());
  }
};

TensorField no_field() { return constant_field(Matrix3d::Zero()); }

std::size_t index_of(const LensPicture& picture, int x, int y) {
  return static_cast<std::size_t>(y * picture.color.width + x);
}

const LensPoint& point_at(const LensPicture& picture, int x, int y) { return picture.points[index_of(picture, x, y)]; }

double radiance_at(const LensPicture& picture, int x, int y) {
  return picture.radiance.values[index_of(picture, x, y)];
}

TEST(Lens, ASmallerImageLeavesPixelsThatSeeNothing) {
  const Image picture = noise(24, 16);
  const Bench bench(no_field(), lens_plate(1.5, {1.5, 1}, {48, 32}), {0.75, 0.5}, picture);
  for (const LensMode mode : modes) {
    const LensPicture seen = bench.simulate(mode);
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 48; ++x) {
        const bool inside = x >= 12 && x < 36 && y >= 8 && y < 24;
        const LensEnd nothing = mode == LensMode::gather ? LensEnd::outside : LensEnd::missed;
        ASSERT_EQ(point_at(seen, x, y).end, inside ? LensEnd::image : nothing) << x << " " << y;
        EXPECT_NEAR(seen.alpha[index_of(seen, x, y)], inside ? 1 : 0, 1e-6);
        EXPECT_NEAR(radiance_at(seen, x, y), inside ? picture.pixel(x - 12, y - 8)[0] : 0, 1e-5);
        if (!inside && mode == LensMode::gather) {  // Landings are single precision.
          EXPECT_LT((point_at(seen, x, y).st - Vector2d((x - 11.5) / 24, 1 - (y - 7.5) / 16)).norm(), 1e-6);
        }
      }
  }
}

TEST(Lens, AnObstacleHidesTheImage) {
  Bench bench(no_field(), lens_plate(1.5, {1.5, 1}, {48, 32}), {1.5, 1}, uniform(0.5), Wrap::clamp);
  const double pixel = 1.5 / 48;  // Its edges lie between pixels.
  bench.surfaces.obstacles.push_back(box_between({-8 * pixel, -4 * pixel, 1.1}, {12 * pixel, 6 * pixel, 1.2}));
  for (const LensMode mode : modes) {
    const LensPicture seen = bench.simulate(mode);
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 48; ++x) {
        const bool hidden = x >= 16 && x < 36 && y >= 10 && y < 20;
        const LensEnd end = mode == LensMode::gather ? LensEnd::obstacle : LensEnd::missed;
        ASSERT_EQ(point_at(seen, x, y).end, hidden ? end : LensEnd::image) << x << " " << y;
        EXPECT_NEAR(seen.alpha[index_of(seen, x, y)], hidden ? 0 : 1, 1e-6);
        EXPECT_NEAR(radiance_at(seen, x, y), hidden ? 0 : 0.5, 1e-6);
      }
    EXPECT_GT(seen.ends[0][static_cast<int>(RayEnd::obstacle)], 0u);
  }
}

TEST(Lens, SamplesOfAUniformImageHaveItsRadiance) {
  Bench bench(cube_field(9, linear_tensor), lens_plate(1.5, {0.6, 0.4}, {24, 16}), {3, 3}, uniform(0.75), Wrap::repeat);
  for (const LensMode mode : modes)
    for (const int samples : {1, 2, 3}) {
      bench.settings.samples = samples;
      const LensPicture seen = bench.simulate(mode);
      EXPECT_THAT(seen.radiance.values, testing::Each(testing::DoubleNear(0.75, 1e-5))) << samples;
      EXPECT_THAT(seen.alpha, testing::Each(testing::DoubleNear(1, 1e-6))) << samples;
    }
}

/// A few bands of a range show what many single wavelengths show together, without steps between them.
TEST(Lens, ARangeIsAContinuumOfWavelengths) {
  const Image edge = grey(256, [](int x, int) { return x < 128 ? 1 : 0; });
  // The field moves all light along x, by about s.
  Bench bench(constant_field(bends_along_z({1, 0, 0})), lens_plate(1.5, {1, 1}, {64, 16}), {4, 4}, edge);
  bench.settings.samples = 2;
  for (const LensMode mode : modes) {
    constexpr int many = 128;
    std::vector<double> each;
    for (int i = 0; i < many; ++i) each.push_back(-0.1 + 0.2 * (i + 0.5) / many);
    const LensPicture continuum = bench.simulate(mode, {-0.1, 0.1}, true, 8),
                      single = bench.simulate(mode, each, false, many);
    EXPECT_EQ(continuum.color.plane(0)[5], continuum.radiance.plane(0)[5]);
    int between = 0;
    for (int x = 0; x < 64; ++x) {
      const double value = radiance_at(continuum, x, 8), step = x == 0 ? 0 : value - radiance_at(continuum, x - 1, 8);
      EXPECT_NEAR(value, radiance_at(single, x, 8), 0.03) << x;
      EXPECT_LT(std::abs(step), 0.1) << x;
      between += value > 0.05 && value < 0.95;
    }
    EXPECT_GT(between, 10);
  }
}

/// The edge of white light that turns aside lies elsewhere in each wavelength: a pixel has the part of the spectrum
/// whose edge it is beyond, whatever the bands are.
TEST(Lens, AtATearPixelsHaveTheirPartOfEachBand) {
  constexpr double least = 0.1, most = 0.3, pixel = 3.0 / 96;
  Matrix3d T;  // Light along +z turns towards +y; beside the volume it is straight.
  T << 0, 0, 0, 0, 0, 1, 0, -1, 0;
  const auto aside = [](double s) {
    const double angle = std::asin(2 * s);
    return (1 - std::cos(angle)) / s + 0.5 * std::tan(angle);
  };
  Bench bench(constant_field(T), lens_plate(1.5, {3, 3}, {96, 96}), {3, 3}, uniform(1), Wrap::clamp);
  constexpr int count = 3;
  const LensPicture seen = bench.simulate(LensMode::scatter, {least, most}, true, count);
  int partly = 0;
  for (int row = 0; row < 96; ++row) {
    const double y = 1.5 - (row + 0.5) * pixel;
    if (y < -1 + pixel || y > 0.9) continue;  // Beside the volume.
    double low = least, high = most;          // The most flexible light that arrives, by bisection.
    for (int i = 0; i < 40; ++i) (aside((low + high) / 2) < y + 1 ? low : high) = (low + high) / 2;
    const double expected = (low - least) / (most - least);
    // Half of an eighth of a band, and the quarter of a pixel that is lost at the edge.
    const double slope = (aside(most) - aside(least)) / pixel;
    EXPECT_NEAR(radiance_at(seen, 48, row), expected, 1.0 / (16 * count) + 0.5 / slope) << row;
    partly += expected > 0.05 && expected < 0.95;
  }
  EXPECT_GT(partly, 10);
}

/// Where the map bends within a pixel, its samples are the mean of what smaller pixels see, in dispersed light, too.
TEST(Lens, PixelsAreTheMeanOfTheirPartsWhereTheMapBends) {
  const Image stripes = grey(512, [](int, int y) { return y / 32 % 2; });
  // Dispersion along x, bends along y.
  const auto tensor = [](const Vector3d& at) { return bends_along_z({4, 6 * std::sin(9 * at.y()), 0}); };
  constexpr int n = 4, size = 16;
  Bench coarse(cube_field(17, tensor), lens_plate(1.5, {1, 1}, {size, size}), {4, 4}, stripes);
  Bench fine(cube_field(17, tensor), lens_plate(1.5, {1, 1}, {n * size, n * size}), {4, 4}, stripes);
  coarse.settings.samples = n;
  coarse.bending = fine.bending = settings_of(BendingMethod::splitting, 0.5);
  // (Not of scatter, whose gaps at tears are a quarter of a pixel wide: they differ with the pixels.)
  const LensPicture seen = coarse.simulate(LensMode::gather, {0.05, 0.15}, true, 4),
                    parts = fine.simulate(LensMode::gather, {0.05, 0.15}, true, 4);
  double sum = 0;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      double mean = 0;
      for (int i = 0; i < n * n; ++i) mean += radiance_at(parts, n * x + i % n, n * y + i / n);
      sum += std::abs(radiance_at(seen, x, y) - mean / (n * n));
    }
  EXPECT_LT(sum / (size * size), 0.01);
}

/// Display values of smooth pictures are those of rays that are traced for each pixel, to within a step of 8 bits.
TEST(Lens, PixelsHaveTheDisplayValueOfTheirRays) {
  const Image waves = grey(256, [](int x, int y) { return 0.5 + 0.2 * std::sin(0.2 * x) + 0.2 * std::cos(0.15 * y); });
  const auto smooth = [](const Vector3d& at) {
    return bends_along_z({std::sin(2 * at.x() + at.y()), std::cos(1.5 * at.y() - at.z()), 0.3 * at.x()});
  };
  const Vector2i size(96, 96);
  Bench bench(cube_field(33, smooth), lens_plate(1.5, {1, 1}, size), {3, 3}, waves);
  constexpr double s = 0.2;
  const auto display = [](double radiance) { return std::pow(radiance, 1 / 2.4); };
  for (const LensMode mode : modes) {
    const LensPicture seen = bench.simulate(mode, s);
    const bool back = mode == LensMode::gather;
    const Plate &from = back ? bench.receiver : bench.image.plane, &to = back ? bench.image.plane : bench.receiver;
    const LensMap map(bench.field, bench.surfaces, bench.bending, from, to, (back ? -1 : 1) * Vector3d::UnitZ());
    double most = 0;
    for (int y = 1; y < size.y(); y += 3)
      for (int x = 1; x < size.x(); x += 3) {
        const LensPoint& point = point_at(seen, x, y);
        ASSERT_EQ(point.end, LensEnd::image);
        const Vector2d at = plane_coordinates(bench.receiver, bench.receiver.to_world(Vector2d(x + 0.5, y + 0.5)));
        Vector2d start = back ? at : Vector2d((point.st.array() - 0.5) * bench.image.plane.size.array());
        LensLanding landing;
        for (int i = 0; i < (back ? 1 : 4); ++i) {  // Newton's method finds the light that lands in the middle.
          map.trace({start}, {back ? -s : s}, &landing);
          ASSERT_EQ(landing.end, RayEnd::plate);
          if (!back) start += landing.jacobian.inverse() * (at - landing.at);
        }
        const Vector2d st = ((back ? landing.at : start).array() / bench.image.plane.size.array() + 0.5).matrix();
        const double expected = bench.texture.lookup(st, point.per_pixel)[0];
        most = std::max(most, std::abs(display(radiance_at(seen, x, y)) - display(expected)));
      }
    EXPECT_LT(most, 1.0 / 255);
  }
}

TEST(Lens, CanBeCancelled) {
  const Bench bench(no_field(), lens_plate(1.5, {1, 1}, {32, 32}), {1, 1}, uniform(1));
  for (const LensMode mode : modes) {
    Progress before;
    before.cancelled = true;
    EXPECT_THROW(bench.simulate(mode, before), Cancelled);
    Progress during;
    during.report = [&](const std::string&, std::uint64_t, std::uint64_t) { during.cancelled = true; };
    EXPECT_THROW(bench.simulate(mode, during), Cancelled);
  }
}

TEST(Lens, PixelsThatAreNotSquareTakeRaysByTheirNumber) {
  constexpr int width = 3, height = 3000;  // 81 million squares of a pixel's shorter side.
  const Bench bench(no_field(), lens_plate(1.5, {1, 1}, {width, height}), {1, 1}, uniform(1));
  // One thread does all tasks; of several, the caller's report, whose number differs from run to run.
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  for (const LensMode mode : modes) {
    std::map<std::string, std::vector<double>> parts;
    Progress progress;
    progress.report = [&](const std::string& phase, std::uint64_t done, std::uint64_t total) {
      parts[phase].push_back(static_cast<double>(done) / static_cast<double>(total));
    };
    const LensPicture picture = bench.simulate(mode, progress);
    EXPECT_EQ(parts.size(), 2u);
    for (const auto& [phase, each] : parts) {
      EXPECT_GE(each.size(), 10u) << phase;
      EXPECT_TRUE(std::is_sorted(each.begin(), each.end())) << phase;
    }
    const EndCounts& ends = picture.ends[0];
    EXPECT_LE(std::accumulate(ends.begin(), ends.end(), std::uint64_t{0}), std::uint64_t{width * height});
    for (int y = 0; y < height; y += 100)
      EXPECT_LT((point_at(picture, 1, y).st - Vector2d(0.5, 1 - (y + 0.5) / height)).norm(), 1e-6) << y;
  }
}

TEST(Lens, SettingsOutOfRangeAreRefused) {
  const auto refused = [](const std::function<void(Bench&)>& change) {
    Bench bench(no_field(), lens_plate(1.5, {1, 1}, {4, 4}), {1, 1}, uniform(1));
    change(bench);
    for (const LensMode mode : modes) EXPECT_THROW(bench.simulate(mode), std::invalid_argument);
  };
  refused([](Bench& bench) { bench.settings.flexibilities.clear(); });
  refused([](Bench& bench) { bench.settings.samples = 0; });
  refused([](Bench& bench) { bench.settings.reference = 1.5; });
  refused([](Bench& bench) { bench.image.texture = nullptr; });
  refused([](Bench& bench) { bench.bending.step = -1; });
  refused([](Bench& bench) { bench.bending.max_steps = 0; });
}

// What the pixels of a lens's picture see: the map to the image, its folds, and its two modes.

TEST(Lens, PointsDescribeTheMapFromPixelsToTheImage) {
  const Vector2i size(64, 48);
  // Zero in the middle, so that light stays off the volume's sides, where the map has kinks.
  const auto tensor = [](const Vector3d& p) -> Matrix3d { return linear_tensor(p) - general_tensor(); };
  Bench bench(cube_field(9, tensor), lens_plate(1.5, {0.8, 0.6}, size), {4, 5}, noise(16, 16));
  for (const LensMode mode : modes) {
    const LensPicture seen = bench.simulate(mode, mode == LensMode::gather ? 0.3 : -0.3);  // About the same picture.
    double least = 1e9, greatest = -1e9;
    for (int y = 1; y + 1 < size.y(); ++y)
      for (int x = 1; x + 1 < size.x(); ++x) {
        const LensPoint& point = point_at(seen, x, y);
        ASSERT_EQ(point.end, LensEnd::image);
        Matrix2d difference;
        difference << (point_at(seen, x + 1, y).st - point_at(seen, x - 1, y).st) / 2,
            (point_at(seen, x, y + 1).st - point_at(seen, x, y - 1).st) / 2;
        // In `scatter`, (s, t) is linear within a triangle: the error of its slope is half of the Jacobian's change
        // across it.
        const double tolerance = mode == LensMode::gather ? 0.01 : 0.03;
        ASSERT_LT((difference - point.per_pixel).norm(), tolerance * point.per_pixel.norm()) << x << " " << y;

        const Vector2d pixel = bench.receiver.pixel_size();
        const Matrix2d image_by_receiver = bench.image.plane.size.asDiagonal() * point.per_pixel *
                                           Vector2d(1 / pixel.x(), -1 / pixel.y()).asDiagonal();
        EXPECT_NEAR(point.log_magnification, -std::log(std::abs(image_by_receiver.determinant())), 1e-9);
        EXPECT_NEAR(point.log_stretch[0] + point.log_stretch[1], point.log_magnification, 1e-12);
        EXPECT_GE(point.log_stretch[0], point.log_stretch[1]);
        EXPECT_NEAR(std::exp(-2 * point.log_stretch[0]) + std::exp(-2 * point.log_stretch[1]),
                    image_by_receiver.squaredNorm(), 1e-9);
        const Vector2d moved = (point.st - seen.straight * Vector2d(x + 0.5, y + 0.5)).cwiseProduct(Vector2d(4, 5));
        EXPECT_LT((point.displacement - Vector3d(moved.x(), moved.y(), 0)).norm(), 1e-9);
        least = std::min(least, point.log_magnification);
        greatest = std::max(greatest, point.log_magnification);
      }
    EXPECT_GT(greatest - least, 0.2);  // There is distortion, and it varies.
  }
}

/// Converges light along +z within |x| < ½, less and less outside; it acts on x alone, and is linear between voxels.
TensorField converging_field(double k) {
  return cube_field(9, [k](const Vector3d& p) {
    const double x = std::abs(p.x());
    return bends_along_z({-k * std::copysign(x < 0.5 ? x : 1 - x, p.x()), 0, 0});
  });
}

/// The map x → x' of a field that acts on x alone, sampled at closely spaced starts.
struct Scan {
  std::vector<double> starts, landings;

  Scan(const Bench& bench, double s) {
    const LensMap map(bench.field, bench.surfaces, bench.bending, bench.image.plane, bench.receiver, {0, 0, 1});
    for (double x = -1.5; x < 1.5; x += 1e-3) {
      LensLanding landing;
      map.trace({{x, 0}}, {s}, &landing);
      starts.push_back(x);
      landings.push_back(landing.at.x());
    }
  }

  /// All starts that land at `at`.
  std::vector<double> find(double at) const {
    std::vector<double> found;
    for (std::size_t i = 0; i + 1 < starts.size(); ++i) {
      const double a = landings[i] - at, b = landings[i + 1] - at;
      if ((a < 0) != (b < 0)) found.push_back(starts[i] + (starts[i + 1] - starts[i]) * a / (a - b));
    }
    return found;
  }

  /// The number of starts that land at `at`; 0 if that number changes within `margin`.
  int count(double at, double margin) const {
    const std::size_t low = find(at - margin).size(), high = find(at + margin).size();
    return low == high ? static_cast<int>(low) : 0;
  }
};

TEST(Lens, ThreeSheetsBeyondTheFocus) {
  const double s = 0.4, k = 2.5, pixel = 0.04;
  Bench bench(converging_field(k), lens_plate(1.5, {2.4, 0.4}, {60, 10}), {2.8, 0.8}, noise(64, 16));
  const Scan scan(bench, s);
  const double magnified = std::cos(2.0) - 0.5 * std::sin(2.0);  // On the axis, x'' = −s k x.
  for (const LensMode mode : modes) {
    const LensPicture seen = bench.simulate(mode, s);
    int threefold = 0, single = 0;
    for (int x = 0; x < 60; ++x) {
      const LensPoint& point = point_at(seen, x, 5);
      const double at = (x + 0.5) * pixel - 1.2;
      const double target = mode == LensMode::scatter ? at : (point.st.x() - 0.5) * 2.8;
      ASSERT_EQ(point.end, LensEnd::image) << x;
      EXPECT_TRUE(std::isfinite(radiance_at(seen, x, 5)));
      const int count = scan.count(target, 0.5 * pixel);
      // In `gather` the target is the point of the picture. The map is the same one, because the planes are at equal
      // distances.
      if (count == 0) continue;
      EXPECT_EQ(point.folds, count) << x;
      ++(count == 3 ? threefold : single);
      if (mode == LensMode::gather) continue;
      const std::vector<double> found = scan.find(at);
      const double nearest = *std::min_element(found.begin(), found.end(),
                                               [&](double a, double b) { return std::abs(a - at) < std::abs(b - at); });
      EXPECT_NEAR((point.st.x() - 0.5) * 2.8, nearest, 0.3 * pixel) << x;
    }
    EXPECT_GT(threefold, 10);
    EXPECT_GT(single, 4);
    const double expected = mode == LensMode::scatter ? 1 / magnified : magnified;
    EXPECT_NEAR(point_at(seen, 30, 5).per_pixel(0, 0) * 2.8 / pixel, expected, 0.02 * std::abs(expected));
  }
}

}  // namespace
}  // namespace tensorray
