#include "tracing/flow_drawing/caustic.h"

#include <functional>

#include <Eigen/LU>

#include "tests/tracing/flow_support.h"
#include "tracing/flow_drawing/flow_view.h"

namespace tensorray {
namespace {

using Eigen::Affine2d;

constexpr int pixels = 64;

Plate unit_plate() {
  Plate plate;
  plate.resolution = {pixels, pixels};
  return plate;
}

/// The light of a map on the unit plate.
Caustic drawn(const FlowMap& map, const std::vector<CausticBand>& bands = {CausticBand{}},
              const CausticSettings& settings = {}) {
  return draw_caustic(map, unit_plate(), bands, settings, Progress());
}

/// Light of the start (u, v) lands at x(u, v) and in row 2 + 60 v.
struct FoldingLight {
  const char* name;
  double (*x)(double u, double v);
  std::vector<double> (*turns)(double v);  ///< Each u where x turns, in order, and then 1.

  Vector2d operator()(const Vector2d& at) const { return {x(at.x(), at.y()), 2 + 60 * at.y()}; }
};

/// The exact irradiance. For each v, the light between two places is the length of the set of u that lands
/// there, of which x is inverted by bisection between its turns.
std::vector<double> exact_irradiance(const FoldingLight& light) {
  std::vector<double> exact(pixels * pixels);
  constexpr int lines = 60 * 64;  // Of v; 64 for each row of pixels.
  for (int line = 0; line < lines; ++line) {
    const double v = (line + 0.5) / lines;
    double* const row = &exact[static_cast<std::size_t>(2 + line / 64) * pixels];
    double begin = 0;
    for (const double end : light.turns(v)) {
      const bool rises = light.x(end, v) > light.x(begin, v);
      const auto at = [&](double x) {
        double a = begin, b = end;
        for (int i = 0; i < 40; ++i) ((light.x((a + b) / 2, v) < x) == rises ? a : b) = (a + b) / 2;
        return a;
      };
      for (int x = 0; x < pixels; ++x) row[x] += std::abs(at(x + 1) - at(x)) / lines / unit_plate().pixel_area();
      begin = end;
    }
  }
  return exact;
}

TEST(Caustic, FoldsAndCuspsHaveTheirClosedForms) {
  const FoldingLight fold{"fold", [](double u, double) { return 10.3 + 160 * std::pow(u - 0.5, 2); },
                          [](double) -> std::vector<double> {
                            return {0.5, 1};
                          }};
  const FoldingLight cusp{"cusp",
                          [](double u, double v) {
                            const double t = 2 * u - 1;
                            return 32 + 20 * (t * t * t + t * (v - 0.5));
                          },
                          [](double v) -> std::vector<double> {
                            if (v >= 0.5) return {1};
                            const double turn = std::sqrt((0.5 - v) / 3);  // Of t.
                            return {(1 - turn) / 2, (1 + turn) / 2, 1};
                          }};
  for (const FoldingLight& light : {fold, cusp}) {
    SCOPED_TRACE(light.name);
    const std::vector<double> exact = exact_irradiance(light);
    const auto error = [&](int count) {
      const Caustic caustic = drawn(lattice_map(count, 0, 1, light));
      EXPECT_NEAR(power_of(caustic, RayEnd::plate), 1, 1e-6);
      return relative_distance(caustic.irradiance.values, exact);
    };
    const double middle = error(128);  // 16,384 rays.
    EXPECT_LT(middle, 0.01);
    EXPECT_LT(error(64), 0.03);
    EXPECT_LT(error(256), middle / 2);
  }
}

/// The light of one band between two samples, of which each vertex moves by `moves`, and that of many narrow bands.
std::pair<Film, Film> swept_and_narrow(const std::function<Vector2d(const Vector2d&)>& moves, std::size_t bands) {
  FlowMap map = lattice_map(8, 0, 1, [](const Vector2d& at) { return Vector2d(5 + 20 * at.x(), 5 + 40 * at.y()); });
  spread(map, 2, [&](const Vector2d& start, std::size_t sample) -> Vector2d {
    return static_cast<double>(sample) * moves(start);
  });
  std::vector<CausticBand> narrow = equal_bands(bands, 0, 1);
  for (CausticBand& band : narrow) band.width = 0;
  const auto draw = [&](const std::vector<CausticBand>& each) {
    const Caustic caustic = drawn(map, each, {1, true, 1});
    EXPECT_NEAR(all_power(caustic), 1, 1e-9);
    return caustic.irradiance;
  };
  return {draw(equal_bands(1, 0, 1)), draw(narrow)};
}

TEST(Caustic, ABandIsSweptInStepsOfAPixel) {
  const auto [swept, narrow] = swept_and_narrow([](const Vector2d&) { return Vector2d(12.5, 3); }, 13);
  for (std::size_t i = 0; i < swept.values.size(); ++i) ASSERT_NEAR(swept.values[i], narrow.values[i], 1e-9) << i;
  // Triangles that move by a different number of pixels still meet.
  const auto [bent, exact] = swept_and_narrow([](const Vector2d& at) { return Vector2d(14 * at.y(), 0); }, 400);
  EXPECT_LT(relative_distance(bent.values, exact.values), 0.02);
}

/// A prism: a strip of light that each wavelength moves further. The light of a column is that of a box, the strip,
/// averaged over the way that it moves. Beyond the bands that are drawn it lands on something else, or does not.
TEST(Caustic, ASpectrumHasItsClosedFormWhateverItsEndsMeet) {
  constexpr double left = 5, width = 5, way = 41;
  const auto integral = [](double x) { return x <= 0 ? 0 : x < width ? x * x / 2 / width : x - width / 2; };
  const auto before = [&](double x) { return (integral(x - left) - integral(x - left - way)) / way; };
  for (const RayEnd end : {RayEnd::plate, RayEnd::missed, RayEnd::obstacle}) {
    FlowMap map = lattice_map(8, 0, 1, [](const Vector2d& at) { return Vector2d(left + width * at.x(), 40 * at.y()); });
    spread(map, 3, [&](const Vector2d&, std::size_t sample) { return Vector2d(static_cast<double>(sample) * way, 0); });
    for (std::size_t i = 2; i < map.ends.size(); i += 3) map.ends[i] = end;
    const Caustic caustic = drawn(map, equal_bands(20, 0, 1));
    EXPECT_NEAR(power_of(caustic, RayEnd::plate), 1, 1e-9);
    for (int x = 0; x < pixels; ++x) {
      double power = 0;
      for (int y = 0; y < pixels; ++y) power += caustic.irradiance.values[static_cast<std::size_t>(y * pixels + x)];
      EXPECT_NEAR(power * unit_plate().pixel_area(), before(x + 1) - before(x), 0.01 / way) << x;
    }
  }
}

/// Light that is spread far beside a shadow. What lands of the triangles between both is in no pixels of its own.
TEST(Caustic, LightBesideAShadowMakesNoDots) {
  FlowMap map = lattice_map(8, 0, 1, [](const Vector2d& at) { return Vector2d(2 + 60 * at.x(), 2 + 60 * at.y()); });
  for (std::size_t i = 0; i < map.starts.size(); ++i)
    if (map.starts[i].x() > 0.9) map.ends[i] = RayEnd::obstacle;
  const Caustic caustic = drawn(map);
  EXPECT_NEAR(power_of(caustic, RayEnd::obstacle), 1.0 / 16, 1e-12);  // Half of a column of quads.
  EXPECT_NEAR(power_of(caustic, RayEnd::plate), 15.0 / 16, 1e-12);
  EXPECT_NEAR(sum(caustic.irradiance.values) * unit_plate().pixel_area(), 15.0 / 16, 1e-9);
  const double brightest = *std::max_element(caustic.irradiance.values.begin(), caustic.irradiance.values.end());
  EXPECT_LT(brightest * unit_plate().pixel_area(), 2.1 / (60 * 60));
}

/// A shadow whose edge is a straight line that moves with the wavelength, and light that moves with it, too. At any
/// place among the samples, light is exactly that beside the edge, within quads of eight pixels.
TEST(Caustic, TheEdgeOfAShadowIsExactBetweenVertices) {
  constexpr std::size_t samples = 33;
  const auto edge = [](double sample, double y) { return (sample + 0.5) / (samples - 1) + y / 4; };
  for (const auto& [is_mirrored, dark] :
       {std::pair(false, RayEnd::obstacle), std::pair(true, RayEnd::obstacle), std::pair(false, RayEnd::side)}) {
    FlowMap map = lattice_map(8, 0, 1, [](const Vector2d& at) { return Vector2d(2 + 50 * at.x(), 2 + 60 * at.y()); });
    const auto place = [&, is_mirrored = is_mirrored](std::size_t sample) {
      return static_cast<double>(is_mirrored ? samples - 1 - sample : sample);
    };
    spread(map, samples, [&](const Vector2d&, std::size_t sample) { return Vector2d(0.2 * place(sample), 0); });
    for (std::size_t i = 0; i < map.ends.size(); ++i) {
      const Vector2d& start = map.starts[i / samples];
      if (start.x() <= edge(place(i % samples), start.y())) map.ends[i] = dark;
    }
    map.check_step = 8;
    // The edge is between vertices that are neither lit nor dark at all.
    for (const double sample : {10.2, 14.3, 15.5}) {
      const CausticBand band{is_mirrored ? samples - 1 - sample : sample};
      const Caustic caustic = drawn(map, {band});
      EXPECT_NEAR(power_of(caustic, RayEnd::plate), 1 - edge(sample, 0.5), 1e-6) << sample;
      EXPECT_NEAR(power_of(caustic, dark), edge(sample, 0.5), 1e-6) << sample;
      for (int row = 2; row < 62; ++row) {
        const double at = edge(sample, (row + 0.5 - 2) / 60), first = 2 + 50 * at + 0.2 * sample;
        const double* const light = &caustic.irradiance.values[static_cast<std::size_t>(row * pixels)];
        for (int x = 0; x + 2 < first; ++x) EXPECT_LT(light[x], 1e-6) << sample << " row " << row;
        const double lit = std::accumulate(light, light + pixels, 0.0) * unit_plate().pixel_area();
        EXPECT_NEAR(lit, (1 - at) / 60, 1e-7) << sample << " row " << row;
      }
    }
  }
}

/// What other wavelengths meet says nothing of one, unless all are of a range.
TEST(Caustic, SeparateWavelengthsHaveSeparateShadows) {
  FlowMap alone = lattice_map(8, 0, 1, [](const Vector2d& at) { return Vector2d(2 + 60 * at.x(), 2 + 60 * at.y()); });
  FlowMap both = alone;
  spread(both, 2, [](const Vector2d&, std::size_t) { return Vector2d(0, 0); });
  for (std::size_t i = 0; i < alone.starts.size(); ++i) {
    const double x = alone.starts[i].x();
    if (x > 0.5) alone.ends[i] = both.ends[2 * i] = RayEnd::obstacle;
    if (x > 0.2) both.ends[2 * i + 1] = RayEnd::obstacle;
  }
  EXPECT_EQ(drawn(alone).irradiance.values, drawn(both).irradiance.values);
}

/// The picture does not depend on whether the channels' irradiance is wanted, and is what the channels add up to.
TEST(Caustic, ChannelsAddUpToTheColours) {
  const LightBench bench = make_bench(lens, plate_at(2.2, 3, 96));
  const FlowMap map = map_of(bench, range(0.1, 0.4));
  constexpr std::size_t channels = 6, parts = 5;
  std::vector<CausticBand> bands = equal_bands(channels * parts, 0, static_cast<double>(map.wavelengths - 1));
  for (std::size_t i = 0; i < bands.size(); ++i) {
    bands[i].channel = i / parts;
    bands[i].weight = 1.0 / parts;
    bands[i].color = Vector3d(1, 0.5, -0.1) * static_cast<double>(1 + i / parts) / parts;
  }
  const Caustic colors = draw_caustic(map, bench.plate(), bands, {channels, false}, Progress());
  const Caustic both = draw_caustic(map, bench.plate(), bands, {channels, true}, Progress());
  EXPECT_EQ(colors.color.values, both.color.values);
  EXPECT_EQ(colors.power, both.power);
  for (std::size_t channel = 0; channel < channels; ++channel) EXPECT_NEAR(sum(both.power[channel]), 1, 1e-9);
  for (std::size_t pixel = 0; pixel < both.color.plane_size(); ++pixel) {
    double red = 0;
    for (std::size_t channel = 0; channel < channels; ++channel)
      red += static_cast<double>(channel + 1) * both.irradiance.plane(static_cast<int>(channel))[pixel];
    ASSERT_NEAR(both.color.plane(0)[pixel], red, 1e-6 * (1 + red));
    ASSERT_NEAR(both.color.plane(1)[pixel], 0.5 * red, 1e-6 * (1 + red));
  }
  for (CausticBand& band : bands) band.color.setZero();  // Light that nobody sees has power, too.
  const Caustic unseen = draw_caustic(map, bench.plate(), bands, {channels, false}, Progress());
  EXPECT_EQ(sum(unseen.color.values), 0);
  EXPECT_EQ(unseen.power, both.power);
}

/// Predicted wavelengths miss what traced ones hit by a little. That must not decide how a triangle is drawn: then the
/// picture would change by much more.
TEST(Caustic, ChangesByLittleIfLandingsDo) {
  constexpr float change = 0.0025f;  // Pixels.
  const LightBench bench = make_bench(lens, plate_at(2.2, 3, 96));
  FlowMap map = map_of(bench, range(0.1, 0.4));
  const std::vector<CausticBand> bands = equal_bands(128, 0, static_cast<double>(map.wavelengths - 1));
  const Film before = caustic_of(bench, map, bands).irradiance;
  const std::size_t half = (map.wavelengths - 1) / 2;
  for (std::size_t i = 0; i < map.landings.size(); ++i) {
    const std::size_t vertex = i / map.wavelengths, sample = i % map.wavelengths;
    const double angle = 2.4 * static_cast<double>(vertex);
    if (sample % half != 0) map.landings[i] += change * Vector2d(std::cos(angle), std::sin(angle)).cast<float>();
  }
  const Film after = caustic_of(bench, map, bands).irradiance;
  // The sides of the smallest triangles, half a pixel long, change by up to a hundredth.
  const double mean = sum(before.values) / static_cast<double>(before.values.size());
  for (std::size_t i = 0; i < before.values.size(); ++i)
    ASSERT_NEAR(after.values[i], before.values[i], 0.02 * (before.values[i] + mean)) << i;
}

TEST(Caustic, LightThatMovesFarHasManyBands) {
  FlowMap map = lattice_map(2, 0, 1, [](const Vector2d& at) { return at; });
  spread(map, 2, [](const Vector2d&, std::size_t sample) { return Vector2d(sample == 0 ? 0 : 21, 0); });
  for (const auto& [channels, bands] : {std::pair(1, 21), {4, 24}, {32, 32}, {1000, 1000}})
    EXPECT_EQ(band_count(map, channels), bands);
  for (std::size_t i = 1; i < map.landings.size(); i += 2) map.landings[i].x() += 1000;
  EXPECT_EQ(band_count(map, 4), 128);
}

// Reading a flow map of starts in [-1, 1]² at the points of a picture.

/// All points of a picture, by row. `n` samples along each side of a pixel.
std::vector<FlowPoint> draw(const FlowMap& map, const FlowPicture& picture, int n = 1, const FlowRange& range = {},
                            double place = 0) {
  const FlowView view(map, picture, {range}, n);
  const Vector2i size = n * picture.resolution;
  std::vector<FlowPoint> all(static_cast<std::size_t>(size.prod())), points;
  for (int tile = 0; tile < view.tiles(); ++tile) {
    view.draw(tile, n, 0, place, {}, points);
    const Eigen::AlignedBox2i box = view.pixels(tile);
    const int columns = n * (box.sizes().x() + 1);
    for (int i = 0; i < static_cast<int>(points.size()); ++i)
      all[static_cast<std::size_t>((n * box.min().y() + i / columns) * size.x() + n * box.min().x() + i % columns)] =
          points[static_cast<std::size_t>(i)];
  }
  return all;
}

FlowPicture landings_of(int size) {
  FlowPicture picture;
  picture.resolution = {size, size};
  return picture;
}

/// From starts in [-1, 1]² to the pixels of a picture.
FlowPicture starts_of(int size) {
  FlowPicture picture = landings_of(size);
  picture.side = FlowSide::starts;
  picture.to_pixel.linear() *= size / 2.0;
  picture.to_pixel.translation() = Vector2d(size, size) / 2;
  return picture;
}

Vector2d middle(std::size_t i, int size) {
  const auto at = static_cast<int>(i);
  return {at % size + 0.5, at / size + 0.5};
}

/// A turn and a stretch: both triangles of a side cover its samples only once, also where corners lie on samples.
TEST(FlowView, LinearMapsAreExactAndCoverPointsOnce) {
  Affine2d turn = Affine2d::Identity();
  turn.linear() << 20, -12, 8, 24;
  turn.translation() = Vector2d(20, 20.5);
  const auto turned = [&](const Vector2d& start) -> Vector2d { return turn * start; };
  for (const int n : {1, 4, 7})
    for (const int samples : {1, 2, 3}) {
      const std::vector<FlowPoint> seen = draw(lattice_map(n, -1, 1, turned), landings_of(40), samples);
      int covered = 0;
      for (std::size_t i = 0; i < seen.size(); ++i) {
        const Vector2d start = turn.inverse() * (middle(i, 40 * samples) / samples);
        if (seen[i].end != RayEnd::plate) {
          EXPECT_GT(start.cwiseAbs().maxCoeff(), 1 - 1e-6);
          continue;
        }
        ++covered;
        ASSERT_EQ(seen[i].sheets, 1) << i;
        EXPECT_LT((seen[i].other.cast<double>() - start).norm(), 1e-6);
        EXPECT_LT((seen[i].jacobian.cast<double>() - turn.linear()).norm(), 1e-4);
        EXPECT_NEAR(seen[i].length, start.x(), 1e-6);
      }
      EXPECT_GT(covered, 600 * samples * samples);
    }
}

/// Between corners the map is quadratic, so that halving quads divides the error within by eight.
TEST(FlowView, SmoothMapsAreOfThirdOrder) {
  const auto landing = [](const Vector2d& at) -> Vector2d {
    return {32 + 24 * at.x() + 4 * std::sin(2 * at.x() + at.y()), 32 + 24 * at.y() + 4 * std::cos(at.x() - at.y())};
  };
  for (const FlowSide side : {FlowSide::starts, FlowSide::landings}) {
    double errors[2];
    for (const int level : {0, 1}) {
      const FlowPicture picture = side == FlowSide::starts ? starts_of(64) : landings_of(64);
      const std::vector<FlowPoint> seen = draw(lattice_map(16 << level, -1, 1, landing), picture);
      double& error = errors[level] = 0;
      for (std::size_t i = 0; i < seen.size(); ++i) {
        const Vector2d at = middle(i, 64);
        if (seen[i].end != RayEnd::plate || (at.array() - 32).abs().maxCoeff() > 12) continue;  // Away from the rim.
        const Vector2d other = seen[i].other.cast<double>();
        error = std::max(error, side == FlowSide::starts ? (landing(picture.to_pixel.inverse() * at) - other).norm()
                                                         : (landing(other) - at).norm());
      }
      EXPECT_GT(error, 0);
    }
    EXPECT_LT(errors[0], 0.02);
    EXPECT_GT(errors[0] / errors[1], 6);
  }
}

/// A strip folded at x = 0: two sheets to the right of it, none to the left. The one nearer to straight light is seen.
TEST(FlowView, ShowsTheNearestOfItsSheets) {
  const auto fold = [](const Vector2d& at) -> Vector2d { return {8 + 24 * std::abs(at.x()), 20 + 18 * at.y()}; };
  FlowPicture picture = landings_of(40);
  picture.straight.linear().setZero();
  picture.straight.translation() = Vector2d(0.5, 0);
  const std::vector<FlowPoint> seen = draw(lattice_map(10, -1, 1, fold), picture);
  int twofold = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Vector2d at = middle(i, 40);
    const bool covered = at.x() > 8 && at.x() < 32 && std::abs(at.y() - 20) < 18;
    ASSERT_EQ(seen[i].sheets, covered ? 2 : 0) << at.transpose();
    if (!covered) continue;
    ++twofold;
    const double start = (at.x() - 8) / 24;  // Quads of 0.2; those at the fold have the mean of two slopes there.
    EXPECT_NEAR(seen[i].other.x(), start, start < 0.2 ? 0.05 : 1e-5);
  }
  EXPECT_EQ(twofold, 24 * 36);
}

/// A view of a range draws each of its wavelengths as a view of this wavelength alone does.
TEST(FlowView, DrawsAnyWavelengthOfARange) {
  FlowMap range = lattice_map(8, -1, 1, [](const Vector2d& at) -> Vector2d { return Vector2d(30, 40) + 20 * at; });
  constexpr std::size_t samples = 5;
  spread(range, samples, [](const Vector2d&, std::size_t sample) {
    const auto way = static_cast<double>(sample * sample);  // Light turns back in y.
    return Vector2d(4 * way, 8 * std::abs(way - 6));
  });
  range.check_step = samples - 1;
  range.lengths.assign(range.starts.size() * 2, 3.0f);
  for (std::size_t i = 0; i < range.ends.size(); ++i)
    if ((i / samples + i % samples) % 13 == 0) range.ends[i] = RayEnd::missed;
  for (std::size_t t = 0; t < range.triangles.size(); t += 7) range.triangles[t].is_torn = true;
  for (const double place : {0.75, 1.0, 1.4, 1.5, 2.0, 2.2, 3.5}) {
    const std::vector<FlowPoint> one = draw(range, landings_of(96), 2, {place, place}, place),
                                 seen = draw(range, landings_of(96), 2, {0.75, 3.5}, place);
    ASSERT_EQ(one.size(), seen.size());
    std::size_t covered = 0;
    for (std::size_t i = 0; i < one.size(); ++i) {
      ASSERT_EQ(one[i].sheets, seen[i].sheets) << place;
      ASSERT_EQ(one[i].other, seen[i].other) << place;
      covered += one[i].sheets > 0;
    }
    EXPECT_GT(covered, 1000u) << place;
  }
}

TEST(FlowView, TearsAndShadowsAreHolesOrUnknown) {
  FlowMap map = lattice_map(4, -1, 1, [](const Vector2d& at) -> Vector2d { return Vector2d(20, 20) + 20 * at; });
  map.triangles[0].is_torn = true;
  map.ends[24] = RayEnd::obstacle;  // A corner: its triangles are partly in shadow.
  for (const std::size_t i : {3, 4, 8, 9}) map.ends[i] = RayEnd::missed;  // A whole quad.
  const std::vector<FlowPoint> landed = draw(map, landings_of(40)), started = draw(map, starts_of(40));
  const std::size_t torn = 2 * 40 + 6, in_part = 37 * 40 + 38, dark = 3 * 40 + 36, lit = 12 * 40 + 12;
  EXPECT_EQ(landed[torn].sheets, 0);
  EXPECT_TRUE(started[torn].is_unknown);
  EXPECT_EQ(landed[in_part].sheets, 0);  // Partly in shadow.
  EXPECT_TRUE(started[in_part].is_unknown);
  EXPECT_EQ(landed[dark].sheets, 0);
  EXPECT_EQ(started[dark].end, RayEnd::missed);
  EXPECT_FALSE(started[dark].is_unknown);
  EXPECT_EQ(landed[lit].sheets, 1);
  EXPECT_FALSE(started[lit].is_unknown);
}

}  // namespace
}  // namespace tensorray
