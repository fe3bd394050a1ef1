// Compares polarised light in stressed bodies with closed forms.

#include "integrators/polariscope/polariscope.h"

#include <random>

#include "base/constants.h"
#include "integrators/polariscope/differences.h"
#include "integrators/polariscope/turning.h"
#include "tests/tracing/support.h"
#include "tests/volumes/level_support.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

using Eigen::Quaterniond;

Quaterniond retarder(double delta, double axis) {
  const double half = delta / 2;
  return {std::cos(half), std::sin(half) * std::cos(2 * axis), std::sin(half) * std::sin(2 * axis), 0};
}

Quaterniond rotation(double angle) { return {std::cos(angle), 0, 0, std::sin(angle)}; }

/// Differences of matrices but for their sign.
double distance(const Quaterniond& a, const Quaterniond& b) {
  return std::min((a.coeffs() - b.coeffs()).norm(), (a.coeffs() + b.coeffs()).norm());
}

/// Light in frames as a receiver's; a band of no width for each wavelength.
PolarizedLight polarized_light(double strength, const std::vector<double>& wavelengths = {550},
                               const Vector3d& direction = -Vector3d::UnitZ()) {
  PolarizedLight light;
  light.strength = strength;
  light.direction = direction.normalized();
  light.up = upright(light.direction, Vector3d::UnitY());
  light.right = light.direction.cross(light.up);
  light.start = -10 * light.direction;
  for (const double wavelength : wavelengths) light.bands.push_back({wavelength, 0, 1, Vector3d::Ones()});
  light.relative = [first = wavelengths.front()](double wavelength) { return first / wavelength; };
  light.samples = 1;
  return light;
}

Plate plate_of(const PolarizedLight& light, const Vector2i& resolution, double size = 1) {
  Plate plate;
  plate.center = 5 * light.direction;
  plate.right = light.right;
  plate.up = light.up;
  plate.size = size * resolution.cast<double>() / resolution.maxCoeff();
  plate.resolution = resolution;
  return plate;
}

LightRow row_of(const TensorField& field, const PolarizedLight& light, const Plate& plate, int y = 0,
                Surfaces surfaces = {}) {
  surfaces.bounds = surfaces_of(field).bounds;
  const Geometry geometry(std::move(surfaces));
  return PolarTracer(field, geometry, light, plate).row(y);
}

/// The mean rotation of a pixel in a band.
Matrix3d rotation_of(const LightRow& row, std::size_t x = 0, std::size_t band = 0) {
  Matrix3d R;
  for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = bands_of(row, x)(static_cast<int>(band), i);
  return R;
}

TensorField smooth_field(int voxels, const TensorFunction& tensor) {
  return TensorField(cube_grid(Vector3i::Constant(voxels), tensor), {Interpolation::cubic});
}

/// What a field does to the light through the middle of the volume.
Quaterniond unitary_of(const TensorField& field, const PolarizedLight& light) {
  return Quaterniond(rotation_of(row_of(field, light, plate_of(light, {1, 1}))));
}

/// Principal values ±½ across z, the greater one at an angle from x towards y.
Matrix3d plane_stress(double difference, double angle) {
  const double along = difference / 2 * std::cos(2 * angle), across = difference / 2 * std::sin(2 * angle);
  Matrix3d T;
  T << along, across, 0, across, -along, 0, 0, 0, 0;
  return T;
}

Arrangement named(const std::string& name) {
  for (const NamedArrangement& each : named_arrangements())
    if (each.name == name) return each.elements;
  throw std::invalid_argument(name);
}

double power(const Arrangement& arrangement, const Quaterniond& specimen) {
  return analyses_of(arrangement, 550)[0].dot(light_of(specimen));
}

Eigen::Vector4d stokes(const Arrangement& arrangement, const Quaterniond& specimen) {
  const std::array<MeanLight, 5> analyses = analyses_of(arrangement, 550);
  const MeanLight light = light_of(specimen);
  return {analyses[1].dot(light), analyses[2].dot(light), analyses[3].dot(light), analyses[4].dot(light)};
}

/// The table of arrangements: what a plate with a phase δ and axes at θ shows.
TEST(Polariscope, ArrangementsShowAPlateAsTheirFormulasSay) {
  for (const double delta : {0.0, 0.7, 2.0, pi, 5.5})
    for (const double axis : {0.0, 0.3, pi / 4, 1.2, 2.5}) {
      const double fringe = std::pow(std::sin(delta / 2), 2), brush = std::pow(std::sin(2 * axis), 2) * fringe;
      // The full-wave plate, whose fast axis is at 45°, subtracts the part of the plate along it.
      const Quaterniond tint = retarder(delta, axis) * retarder(-2 * pi, pi / 4);
      const double through = std::pow(tint.y(), 2) + std::pow(tint.z(), 2);
      const std::vector<std::pair<const char*, double>> cases{{"circular", fringe},
                                                              {"circular_light", 1 - fringe},
                                                              {"plane", brush},
                                                              {"plane_light", 1 - brush},
                                                              {"tint", through}};
      for (const auto& [word, expected] : cases) {
        const Quaterniond plate = retarder(delta, axis);
        EXPECT_NEAR(power(named(word), plate), expected, 1e-12) << word << " " << delta << " " << axis;
        const Eigen::Vector4d S = stokes(named(word), plate);
        EXPECT_NEAR(S[0] * S[0], S.tail<3>().squaredNorm(), 1e-12);
        EXPECT_NEAR(S[0], 1, 1e-12);
        // All elements turned with the specimen.
        const Arrangement all = turned(named(word), 0.4 * 180 / pi, 0);
        EXPECT_NEAR(power(all, retarder(delta, axis + 0.4)), expected, 1e-12);
      }
    }
}

/// Tardy's method: where axes are those of the polariser, the analyser is dark at half the phase.
TEST(Polariscope, TheAnalyserMeasuresFractionsOfAnOrder) {
  for (const double delta : {0.4, 1.7, 2.9}) {
    const auto seen = [&](double analyzer) {
      const Arrangement before{{{ElementKind::polarizer, 45}},
                               {{ElementKind::quarter_wave, 45}, {ElementKind::polarizer, 135}}};
      return power(turned(before, 0, analyzer), retarder(delta, 0));
    };
    const double angle = delta / 2 * 180 / pi;
    EXPECT_NEAR(std::min(seen(angle), seen(-angle)), 0, 1e-12) << delta;
  }
}

/// Circular light: of a plate of a quarter wave at 45° behind a polariser.
TEST(Polariscope, StokesParametersKnowTheSenseOfCircularLight) {
  // The slow axis, at 45°, is behind: its wave comes later, so that the picture shows light that turns clockwise, and
  // who faces the light sees it turn the other way.
  const Eigen::Vector4d S =
      stokes({{{ElementKind::polarizer, 0}}, {{ElementKind::polarizer, 90}}}, retarder(pi / 2, pi / 4));
  // Of E exp(iωt) the plate moves (1, −1), along its fast axis at −45°, by exp(iπ/4), and (1, 1) by exp(−iπ/4): of
  // (1, 0) it makes (1, −i)/√2. w comes a quarter of a period after u.
  EXPECT_NEAR(S[3], 1, 1e-12);
  EXPECT_NEAR(S.segment<2>(1).norm(), 0, 1e-12);
}

TEST(Polariscope, EveryUnitaryMatrixIsARotationThenARetarder) {
  for (const double delta : {0.2, 1.5, 3.0})
    for (const double axis : {-1.2, 0.1, 1.4})
      for (const double turn : {-1.5, -0.3, 0.8}) {
        const EquivalentRetarder found = equivalent_retarder(retarder(delta, axis) * rotation(turn));
        EXPECT_NEAR(found.phase, delta, 1e-12);
        EXPECT_NEAR(found.azimuth, axis, 1e-12);
        EXPECT_NEAR(found.rotation, turn, 1e-12);
      }
}

/// Bands of a uniform plate. Single precision resolves 1e-6 of the phase.
TEST(Polariscope, AUniformPlateIsExactInEveryBand) {
  const std::vector<double> wavelengths{550, 380, 430, 610, 730};
  for (const double orders : {0.1, 1.0, 3.7, 11.86, 12.0})
    for (const double axis : {0.0, 0.4, 2.0}) {
      const TensorField field = constant_field(plane_stress(1, axis));
      const PolarizedLight light = polarized_light(pi * orders / 2, wavelengths);  // The cube is 2 thick.
      const LightRow row = row_of(field, light, plate_of(light, {1, 1}));
      for (std::size_t k = 0; k < wavelengths.size(); ++k) {
        const double delta = 2 * pi * orders * 550 / wavelengths[k];
        EXPECT_LT((rotation_of(row, 0, k) - retarder(delta, axis).toRotationMatrix()).cwiseAbs().maxCoeff(), 1e-5)
            << orders << " " << axis << " " << wavelengths[k];
      }
      EXPECT_NEAR(row.points[0].integral, 2 * pi * orders, 1e-5 * orders);
      EXPECT_NEAR(row.points[0].length, 2, 1e-6);
    }
}

/// A coefficient that passes zero near the reference: other wavelengths are turned a million times as much.
TEST(Polariscope, StrongDispersionLosesNoDigits) {
  const TensorField field = constant_field(plane_stress(1, 0.4));
  PolarizedLight light = polarized_light(1e-6, {550, 450});
  light.relative = [](double wavelength) { return wavelength == 550 ? 1 : 1e6; };
  const LightRow row = row_of(field, light, plate_of(light, {1, 1}));
  EXPECT_LT((rotation_of(row, 0, 1) - retarder(4, 0.4).toRotationMatrix()).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_NEAR(row.points[0].retarder.phase, 4e-6, 1e-11);
}

/// A band in which the phase changes by many periods has the mean of all its wavelengths: the closed form is that of a
/// phase that is spread evenly, but for the curve of 1/λ.
TEST(Polariscope, AWideBandIsTheMeanOfItsWavelengths) {
  const TensorField field = constant_field(plane_stress(1, 0));
  for (const double orders : {0.5, 3.0, 20.0, 60.0}) {
    PolarizedLight light = polarized_light(pi * orders / 2);
    light.bands[0].width = 60;
    double mean = 0;
    constexpr int many = 20000;
    for (int i = 0; i < many; ++i) mean += std::cos(2 * pi * orders * 550 / (520 + 60 * (i + 0.5) / many)) / many;
    const double change = 2 * pi * orders * 60 / 550;
    // Midpoints no more than 1 apart in phase leave 1/24 of what cancels.
    EXPECT_NEAR(rotation_of(row_of(field, light, plate_of(light, {1, 1})))(1, 1), mean,
                change <= 1 ? change * change / 20 : 0.05)
        << orders;
  }
}

/// Axes that turn at a constant rate: total phase d, total turn ϕ.
Quaterniond twisted(double d, double turn) {
  const double g = std::hypot(d / 2, turn);
  return rotation(turn) * Quaterniond(std::cos(g), std::sin(g) / g * d / 2, 0, -std::sin(g) / g * turn);
}

/// Steps of the fourth ray as the tracer takes them, joined where they may be.
std::vector<Turn> turns_of_all(const std::vector<RaySteps>& steps, bool may_join = true) {
  std::vector<Turn> result;
  RayTurns last{};
  for (const RaySteps& step : steps) {
    if (!may_join) last = {};
    add_turns(step, last);
    if (!may_join || !last.joined[3] || result.empty()) result.emplace_back();
    result.back() = {last.alpha[3], last.beta[3], last.gamma[3], last.squares[3]};
  }
  return result;
}

Quaterniond product_of(const std::vector<Turn>& turns, float strength = 1) {
  const std::vector<float> strengths(turning_room(1), strength);
  std::vector<float> q(4 * strengths.size()), light(10 * strengths.size());
  turn(turns, strengths.data(), strengths.size(), 0, q.data(), light.data());
  return {q[0], q[strengths.size()], q[2 * strengths.size()], q[3 * strengths.size()]};
}

/// A step of each ray. @param light  Half a phase per length, and twice the angle of the axes, of a ray at a point.
template <class Light>
RaySteps step_of(double length, const Light& light) {
  RaySteps steps;
  for (const int point : {0, 1})
    for (int ray = 0; ray < ray_lanes; ++ray) {
      const auto [half, angle] = light(ray, point);
      steps.length[ray] = static_cast<float>(length);
      steps.a[point][ray] = static_cast<float>(half * std::cos(angle));
      steps.b[point][ray] = static_cast<float>(half * std::sin(angle));
    }
  return steps;
}

std::vector<RaySteps> twisted_steps(int count, double d, double turn) {
  std::vector<RaySteps> result;
  for (int i = 0; i < count; ++i)
    result.push_back(step_of(1.0 / count, [&](int, int point) {
      const double z = (i + 0.5 + (point == 0 ? -gauss_point : gauss_point)) / count;
      return std::pair(d / 2, 2 * turn * z);
    }));
  return result;
}

TEST(Polariscope, StepsOfTurningAxesHaveFourthOrder) {
  constexpr double d = 9, turn_of_axes = 2.5;
  std::vector<double> errors;
  for (const int count : {4, 8, 16}) {
    const Quaterniond found = product_of(turns_of_all(twisted_steps(count, d, turn_of_axes)));
    EXPECT_NEAR(found.norm(), 1, 1e-6);
    errors.push_back(distance(found, twisted(d, turn_of_axes)));
  }
  EXPECT_GT(errors[0] / errors[1], 12) << errors[0] << " " << errors[1];
  EXPECT_GT(errors[1] / errors[2], 12) << errors[1] << " " << errors[2];
  EXPECT_LT(errors[2], 1e-3);
}

/// A millionth of each, and as much by rounding. Where axes do not turn, steps are joined up to the angle of the
/// series.
TEST(Polariscope, SmallStepsAreJoined) {
  for (const auto& [d, turn_of_axes, most] :
       {std::array{3.0, 0.0, 6.0}, {3.0, 0.02, 40.0}, {0.1, 0.5, 20.0}, {0.0, 0.0, 1.0}}) {
    const std::vector<RaySteps> steps = twisted_steps(64, d, turn_of_axes);
    const std::vector<Turn> joined = turns_of_all(steps), each = turns_of_all(steps, false);
    EXPECT_EQ(each.size(), 64);
    EXPECT_LE(static_cast<double>(joined.size()), most) << d << " " << turn_of_axes;
    for (const float strength : {1.0f, 0.5f, -1.0f})
      EXPECT_LT(distance(product_of(joined, strength), product_of(each, strength)), 2e-6 * 64) << d << " " << strength;
  }
  EXPECT_EQ(turns_of_all(twisted_steps(16, 9, 2.5)).size(), 16);  // They are large.
}

/// To the bit, weak and strong, beside rays of any strength.
TEST(Polariscope, ARayDoesNotDependOnItsNeighbours) {
  for (const double own : {0.01, 0.1, 0.4, 8.0}) {
    std::vector<Eigen::Vector4d> found;
    for (const double others : {0.0, 0.3, 40.0}) {
      std::vector<RaySteps> steps;
      for (int i = 0; i < 24; ++i)
        steps.push_back(
            step_of(1, [&](int ray, int point) { return std::pair(ray == 3 ? own : others, 0.3 * i + 0.1 * point); }));
      found.push_back(product_of(turns_of_all(steps)).coeffs());
    }
    EXPECT_EQ(found[0], found[1]) << own;
    EXPECT_EQ(found[0], found[2]) << own;
  }
}

/// A slab is one step, whatever its orders. Halved angles are doubled again, also where they pass a half turn.
TEST(Polariscope, OneStepOfManyOrdersIsExact) {
  for (double half = 0.05; half < 50 * pi; half *= 1.13) {
    const RaySteps steps = step_of(1, [&](int, int) { return std::pair(half, 0.0); });
    const double given = steps.a[0][3];
    // Each square doubles the error of an angle of 0.375 to 0.75: a few roundings of 6e-8.
    EXPECT_NEAR(product_of(turns_of_all({steps})).w(), std::cos(given), 2e-6 + 4e-7 * half) << half;
  }
}

TEST(Polariscope, RaysSideBySideAreSampledAsAlone) {
  const Eigen::AlignedBox3i box(Eigen::Vector3i(-11, -3, 5), Eigen::Vector3i(6, 12, 20));
  const Vector3d along = Vector3d(0.3, -0.2, -0.9).normalized(), u = along.unitOrthogonal(), w = along.cross(u);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (const int levels : {1, 2, 3}) {
    const TensorGrid grid = grid_of_levels(
        box, levels, [](const Eigen::Vector3i& brick) { return brick.x() >= 0; },
        [](const Vector3d& p) { return linear_tensor(p / 8) * (1 + p.x() * p.y() / 400); });
    const TensorField field(grid, {Interpolation::cubic});
    DifferenceSampler sampler(field, along, u, w, 1);
    TensorSampler exact(field);
    for (int packet = 0; packet < 200; ++packet) {
      RaySteps steps;
      const Vector3d center = (box.min().cast<double>() + packet / 199.0 * box.sizes().cast<double>());
      for (int ray = 0; ray < ray_lanes; ++ray) {
        for (int axis = 0; axis < 3; ++axis) steps.origin[axis][ray] = center[axis] + uniform(random);
        steps.place[0][ray] = -0.3;
        steps.place[1][ray] = 0.3;
        steps.length[ray] = ray % 5 == 3 ? 0 : 1;
      }
      sampler.sample(steps);
      for (int ray = 0; ray < ray_lanes; ++ray)
        for (const int point : {0, 1}) {
          const Vector3d origin(steps.origin[0][ray], steps.origin[1][ray], steps.origin[2][ray]);
          const Vector3d p = origin + steps.place[point][ray] * along;
          if (steps.length[ray] == 0 || !box.cast<double>().contains(p)) continue;
          const Matrix3d T = exact.at(p);
          EXPECT_NEAR(steps.a[point][ray], u.dot(T * u) - w.dot(T * w), 3e-5) << levels;
          EXPECT_NEAR(steps.b[point][ray], u.dot((T + T.transpose()) * w), 3e-5) << levels;
        }
    }
  }
}

/// A step a voxel, and a cubic interpolant of order 4: together they have order 4 in the voxel.
TEST(Polariscope, ATwistedRetarderConvergesWithTheVoxels) {
  constexpr double d = 6, turn_of_axes = 1.5;
  std::vector<double> errors;
  for (const int voxels : {9, 17, 33}) {
    // Light along −z comes in at z = 1. Along −z, x is to the right and y up.
    const TensorField field =
        smooth_field(voxels, [&](const Vector3d& p) { return plane_stress(1, turn_of_axes * (1 - p.z()) / 2); });
    const double strength = d / 4;  // φ = d/2 over a length of 2.
    errors.push_back(distance(unitary_of(field, polarized_light(strength)), twisted(d, turn_of_axes)));
  }
  EXPECT_GT(errors[0] / errors[1], 8) << errors[0] << " " << errors[1];
  EXPECT_LT(errors[2], 1e-4);
}

/// A closed cylinder about y, as a prism within it.
TriangleMesh cylinder(double radius, int sides) {
  TriangleMesh mesh;
  mesh.vertices = {{0, -0.9, 0}, {0, 0.9, 0}};
  for (int i = 0; i < sides; ++i)
    for (const double y : {-0.9, 0.9})
      mesh.vertices.emplace_back(radius * std::cos(2 * pi * i / sides), y, radius * std::sin(2 * pi * i / sides));
  for (int i = 0; i < sides; ++i) {
    const auto a = static_cast<std::uint32_t>(2 + 2 * i), b = static_cast<std::uint32_t>(2 + 2 * ((i + 1) % sides));
    mesh.triangles.insert(mesh.triangles.end(), {{a, a + 1, b + 1}, {a, b + 1, b}, {0, a, b}, {1, b + 1, a + 1}});
  }
  return mesh;
}

/// Glass with axial stress 1 − 2r²/R²: C · 2 [L − 2 (L³/3 + x² L)/R²], L = √(R² − x²).
TEST(Polariscope, ACylinderEndsAtItsSurface) {
  constexpr double R = 0.8;
  const TensorField field = smooth_field(17, [&](const Vector3d& p) -> Matrix3d {
    return Vector3d(0, 1 - 2 * (p.x() * p.x() + p.z() * p.z()) / (R * R), 0).asDiagonal();
  });
  const PolarizedLight light = polarized_light(0.5);
  const Plate plate = plate_of(light, {64, 1}, 2);
  Surfaces surfaces;
  surfaces.cut = cylinder(R, 400);
  const LightRow row = row_of(field, light, plate, 0, std::move(surfaces));
  for (int i = 0; i < 64; ++i) {
    const double x = plate.to_world({i + 0.5, 0.5}).x(), L = std::sqrt(std::max(0.0, R * R - x * x));
    const double expected = 2 * light.strength * 2 * (L - 2 * (L * L * L / 3 + x * x * L) / (R * R));
    const PolarPoint& point = row.points[static_cast<std::size_t>(i)];
    // The prism is thinner by π²/(2 · 400²) of R, where it is seen obliquely by more.
    EXPECT_NEAR(point.length, 2 * L, 2e-3) << x;
    EXPECT_NEAR(point.retarder.phase, std::abs(expected), 2e-3) << x;
    if (std::abs(expected) > 0.05) {
      EXPECT_NEAR(std::abs(point.retarder.azimuth), expected > 0 ? pi / 2 : 0, 1e-3) << x;
    }
  }
}

/// Stress in a disc of radius 1 that forces of 1 press along y (thickness 1).
Matrix3d disc_stress(const Vector3d& p) {
  const double x = p.x(), below = 1 - p.y(), above = 1 + p.y();
  const double r1 = std::pow(x * x + below * below, 2), r2 = std::pow(x * x + above * above, 2);
  Matrix3d T = Matrix3d::Zero();
  T(0, 0) = -2 / pi * (below * x * x / r1 + above * x * x / r2 - 0.5);
  T(1, 1) = -2 / pi * (below * below * below / r1 + above * above * above / r2 - 0.5);
  T(0, 1) = T(1, 0) = 2 / pi * (below * below * x / r1 - above * above * x / r2);
  return T;
}

/// The greatest error of the picture where |y| < 0.7, as a part of white.
double disc_error(int voxels) {
  // Voxels are about the loads, not at them.
  Eigen::Affine3d placement = Eigen::Affine3d::Identity();
  placement.linear().diagonal() << 0.985, 0.985, 0.5;
  const TensorField field = TensorField(cube_grid({voxels, voxels, 2}, disc_stress, placement), {Interpolation::cubic});
  const double orders = 3;  // At the middle, where σ₁ − σ₂ = 4/π. The slab is 1 thick.
  const PolarizedLight light = polarized_light(pi * orders / (4 / pi));
  const Plate plate = plate_of(light, {150, 150}, 1.9);
  const PolarView view(named("circular"), light.bands, Vector3d::Ones(), false);
  double error = 0;
  for (int y = 0; y < 150; y += 7) {
    const LightRow row = row_of(field, light, plate, y);
    for (std::size_t x = 0; x < 150; ++x) {
      const Vector3d p = plate.to_world({static_cast<double>(x) + 0.5, y + 0.5});
      const double r2 = p.head<2>().squaredNorm();
      if (r2 > 0.9 || std::abs(p.y()) > 0.7) continue;
      const double difference = 4 / pi * (1 - r2) / (std::pow(r2 + 1, 2) - 4 * p.y() * p.y());
      const double power = view.spectrum(row, x)(0);
      error = std::max(error, std::abs(power - std::pow(std::sin(light.strength * difference), 2)));
    }
  }
  return error;
}

TEST(Polariscope, ADiscUnderTwoLoadsIsTheFormulaAndConverges) {
  const double coarse = disc_error(65), fine = disc_error(129), finest = disc_error(256);
  EXPECT_LT(finest, 1e-3);
  EXPECT_GT(coarse / fine, 8) << coarse << " " << fine << " " << finest;
}

TEST(Polariscope, WhatCannotMatterDoesNot) {
  const PolarizedLight light = polarized_light(0.5, {550}, {0.3, -0.2, -0.9});
  const TensorField field = cube_field(17, linear_tensor);
  const Quaterniond expected = unitary_of(field, light);

  Matrix3d more;  // A multiple of the identity, and an antisymmetric part.
  more << 0.7, 0.5, 0, -0.5, 0.7, -0.8, 0, 0.8, 0.7;
  const TensorField other = cube_field(17, [&](const Vector3d& p) -> Matrix3d { return linear_tensor(p) + more; });
  EXPECT_LT(distance(unitary_of(other, light), expected), 1e-5);

  // Field, light and plate turned together.
  const Eigen::Affine3d turn(Eigen::AngleAxisd(0.8, Vector3d(1, 2, -1).normalized()));
  const auto turned_tensor = [&](const Vector3d& p) -> Matrix3d {
    return turn.linear() * linear_tensor(turn.inverse() * p) * turn.linear().transpose();
  };
  const TensorField turned_field = cube_field(17, turned_tensor, turn);
  PolarizedLight turned_light = light;
  for (Vector3d* each : {&turned_light.direction, &turned_light.right, &turned_light.up, &turned_light.start})
    *each = turn.linear() * *each;
  EXPECT_LT(distance(unitary_of(turned_field, turned_light), expected), 1e-5);

  // Light back: the transpose, in axes of which u is turned about.
  PolarizedLight back = light;
  back.direction = -light.direction;
  back.right = -light.right;
  back.start = -light.start;
  EXPECT_LT(distance(unitary_of(field, back), {expected.w(), expected.x(), -expected.y(), expected.z()}), 1e-5);
}

/// Samples of a pixel: its fringes' mean. Half a pixel in an obstacle is half as bright, its azimuth that of the rest.
TEST(Polariscope, PixelsAreMeansOfTheirSamples) {
  const TensorField field = smooth_field(9, [](const Vector3d& p) { return plane_stress(2 + p.x(), 0); });
  PolarizedLight light = polarized_light(1.3);
  light.samples = 4;
  const Plate plate = plate_of(light, {1, 1}, 0.5);
  double mean = 0;
  for (int i = 0; i < 4; ++i) mean += std::cos(2 * light.strength * 2 * (2 + 0.5 * ((i + 0.5) / 4 - 0.5))) / 4;
  EXPECT_NEAR(rotation_of(row_of(field, light, plate))(1, 1), mean, 1e-5);

  const LightRow half = row_of(field, light, plate, 0, obstacle_between({0, -9, 3}, {9, 9, 4}));
  EXPECT_NEAR(bands_of(half, 0)(0, 9), 0.5, 1e-6);
  EXPECT_NEAR(half.points[0].length, 2, 1e-5);
}

}  // namespace
}  // namespace tensorray
