#include "integrators/seeds/seeds.h"

#include <limits>

#include "tests/renderer/support.h"
#include "tests/tracing/support.h"

namespace tensorray {
namespace {

/// A slanted view of a cube: its aperture is a hexagon.
Beam hexagonal_beam() {
  std::vector<Vector3d> corners;
  for (int i = 0; i < 8; ++i) corners.emplace_back(i & 1, (i >> 1) & 1, (i >> 2) & 1);
  return silhouette_beam(corners, Vector3d(0.4, 0.7, -1), Vector3d::UnitY());
}

void expect_in_aperture(const Beam& beam, const std::vector<Vector3d>& seeds) {
  for (const Vector3d& seed : seeds) {
    const Vector3d p = seed - beam.center;
    EXPECT_NEAR(p.dot(beam.direction), 0, 1e-12);
    const Vector2d at(p.dot(beam.right), p.dot(beam.up));
    for (std::size_t i = 0; i < beam.aperture.size(); ++i) {
      const Vector2d edge = beam.aperture[(i + 1) % beam.aperture.size()] - beam.aperture[i],
                     to = at - beam.aperture[i];
      EXPECT_GE(edge.x() * to.y() - edge.y() * to.x(), -1e-9);
    }
  }
}

double min_distance(const std::vector<Vector3d>& seeds) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < seeds.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) least = std::min(least, (seeds[i] - seeds[j]).norm());
  return least;
}

TEST(Seeds, AGridFillsTheAperture) {
  const Beam beam = hexagonal_beam();
  const std::vector<Vector3d> seeds = grid_seeds(beam, 400);
  EXPECT_NEAR(double(seeds.size()), 400, 40);  // There may be one row of 20 more or less at each of two edges.
  expect_in_aperture(beam, seeds);
  // Cells are nearly squares of area / 400, and their edges differ by at most half a cell in 20.
  EXPECT_NEAR(min_distance(seeds), std::sqrt(area(beam.aperture) / 400), 0.1 * std::sqrt(area(beam.aperture) / 400));
}

TEST(Seeds, PoissonDisksAreApartAndFillTheAperture) {
  const Beam beam = hexagonal_beam();
  for (const std::uint64_t count : {1u, 2u, 3u, 7u, 600u}) {
    const std::vector<Vector3d> seeds = poisson_disk_seeds(beam, count, 5);
    ASSERT_EQ(seeds.size(), count);
    expect_in_aperture(beam, seeds);
    EXPECT_GE(min_distance(seeds), 0.75 * std::sqrt(area(beam.aperture) / double(count)));
  }
  const std::vector<Vector3d> seeds = poisson_disk_seeds(beam, 600, 5);
  EXPECT_EQ(seeds, poisson_disk_seeds(beam, 600, 5));
  EXPECT_NE(seeds, poisson_disk_seeds(beam, 600, 6));
  // Each half of the aperture has half of the seeds. Even a random choice would differ by only 12, which is √(600 / 4).
  const auto right = std::count_if(seeds.begin(), seeds.end(),
                                   [&](const Vector3d& seed) { return (seed - beam.center).dot(beam.right) > 0; });
  EXPECT_NEAR(double(right), 300, 36);
}

TEST(Seeds, PoissonDisksFillANarrowApertureToo) {
  Beam beam;
  beam.aperture = {{-1, -1e-4}, {1, -1e-4}, {1, 1e-4}, {-1, 1e-4}};
  EXPECT_EQ(poisson_disk_seeds(beam, 50, 1).size(), 50u);
  EXPECT_EQ(poisson_disk_seeds(beam, 20000, 1).size(), 20000u);
}

TEST(Seeds, ALineHasItsEnds) {
  const Vector3d from(1, 2, 3), to(3, 2, 1);
  const std::vector<Vector3d> seeds = line_seeds(from, to, 5);
  ASSERT_EQ(seeds.size(), 5u);
  EXPECT_EQ(seeds.front(), from);
  EXPECT_EQ(seeds.back(), to);
  for (int i = 0; i < 5; ++i) EXPECT_LT((seeds[i] - Vector3d(1 + 0.5 * i, 2, 3 - 0.5 * i)).norm(), 1e-12);
  EXPECT_EQ(line_seeds(from, to, 1), std::vector<Vector3d>{Vector3d(2, 2, 2)});
}

TEST(Seeds, ASphereIsFilledEvenly) {
  const Vector3d center(1, -2, 3);
  const std::vector<Vector3d> seeds = sphere_seeds(center, 2, 4096, 3);
  Vector3d mean = Vector3d::Zero();
  int inner = 0;
  for (const Vector3d& seed : seeds) {
    EXPECT_LE((seed - center).norm(), 2 * (1 + 1e-12));
    mean += (seed - center) / 4096;
    inner += (seed - center).norm() < 1;
  }
  // An eighth of the volume is within half the radius, and an elementary interval of the sequence.
  EXPECT_EQ(inner, 512);
  EXPECT_LT(mean.norm(), 0.01);  // Independent points: 2 √(3/5) / √4096 = 0.024.
}

SeedList read_text(const std::string& text) {
  const Temporary file("seeds.txt", text);
  return read_seeds(file.path());
}

std::string complaint(const std::string& text) {
  return message([&] { read_text(text); });
}

TEST(SeedFiles, HoldPointsInText) {
  const SeedList seeds = read_text("# a comment\n\n1 2.5 -3e-1\n\t+4,5;6 # and another\r\n7, 8, 9");
  EXPECT_EQ(seeds.positions, (std::vector<Vector3d>{{1, 2.5, -0.3}, {4, 5, 6}, {7, 8, 9}}));
  EXPECT_TRUE(seeds.directions.empty());
}

TEST(SeedFiles, MayHaveDirectionsAndAHeader) {
  const SeedList seeds = read_text("\xef\xbb\xbfx,y,z,dx,dy,dz\n1,2,3,0,0,-2\n4,5,6,3e200,4e200,0\n");
  EXPECT_EQ(seeds.positions, (std::vector<Vector3d>{{1, 2, 3}, {4, 5, 6}}));
  ASSERT_EQ(seeds.directions.size(), 2u);
  EXPECT_EQ(seeds.directions[0], Vector3d(0, 0, -1));
  EXPECT_LT((seeds.directions[1] - Vector3d(0.6, 0.8, 0)).norm(), 1e-15);
}

TEST(SeedFiles, LinesEndAsOnAnySystem) {
  for (const std::string end : {"\n", "\r", "\r\n"}) {
    const SeedList seeds = read_text("# text" + end + "1 2 3" + end + end + "4 5 6" + end);
    EXPECT_EQ(seeds.positions, (std::vector<Vector3d>{{1, 2, 3}, {4, 5, 6}})) << seeds.positions.size();
    EXPECT_THAT(complaint("1 2 3" + end + end + "4 five 6" + end), HasSubstr("line 3: "));
  }
}

TEST(SeedFiles, ErrorsAreShortLines) {
  for (const std::string& word : {std::string(5000000, 'x'), std::string("a\0b\x1b[31m", 8)}) {
    const std::string said = complaint("1 2 3\n1 2 " + word + "\n");
    EXPECT_LT(said.size(), 300u);
    EXPECT_EQ(said.find('\0'), std::string::npos);
    EXPECT_EQ(said.find('\x1b'), std::string::npos);
  }
}

TEST(SeedFiles, SayWhichLineIsWrong) {
  const std::pair<std::string, std::string> wrong[]{
      {"1 2 3\n4 5\n", "line 2: a seed is three numbers (x y z), or six (x y z and a direction), not 2"},
      {"1 2 3\n1 2 3 0 0 1\n", "line 2: all lines must have the same number of values: the lines above have 3"},
      {"1 2 3\n4 five 6\n", "line 2: \"five\" is not a finite number"},
      {"1 2 nan\n", "line 1: \"nan\" is not a finite number"},
      {"1 2 3 0 0 0\n", "line 1: the direction has length zero"},
      {"x y z\na b c\n", "line 2: \"a\" is not a finite number"},
      {"x,y,z\n", "contains no seeds"},
      {"# nothing\n", "contains no seeds"}};
  for (const auto& [text, words] : wrong)
    EXPECT_THAT(complaint(text), AllOf(HasSubstr("seeds.txt: "), HasSubstr(words))) << text;
  EXPECT_THAT(message([] { read_seeds("/nowhere/seeds.csv"); }), HasSubstr("/nowhere/seeds.csv"));
}

/// A tensor with the trace x + 2 z.
Matrix3d traced(const Vector3d& p) { return Vector3d(p.x(), p.z(), p.z()).asDiagonal(); }

Threshold trace_from(double min, double max = 1e300) { return {Invariant::trace, min, max}; }

TEST(ThresholdSeeds, AreWhereTheTensorIsWanted) {
  const Affine3d turned(Eigen::Translation3d(3, -1, 2) * Eigen::AngleAxisd(0.6, Vector3d(1, 2, 3).normalized()));
  for (const auto& [placement, wanted] :
       {std::pair(Affine3d::Identity(), trace_from(1.5, 2)), {turned, trace_from(-1e300)}}) {
    const TensorField field = cube_field(9, traced, placement);
    for (const Vector3d& p : threshold_seeds(field, wanted, 500, 1)) {
      EXPECT_TRUE(field.contains(p));
      EXPECT_GE(p.x() + 2 * p.z(), wanted.min - 1e-6);
      EXPECT_LE(p.x() + 2 * p.z(), wanted.max + 1e-6);
    }
  }
}

TEST(ThresholdSeeds, AreEvenlySpread) {
  // The seeds fill the half of a cube with x + 2 z > 0. The parts on either side of y = 0 and of x + 2 z = 1 / 2 have
  // seeds in proportion to their volumes. The tolerance is one standard deviation of independent points: 32 at a half
  // of 4096.
  const TensorField field = cube_field(9, traced);
  const std::vector<Vector3d> seeds = threshold_seeds(field, trace_from(0), 4096, 7);
  int right = 0, inner = 0;
  for (const Vector3d& p : seeds) {
    right += p.y() > 0;
    inner += p.x() + 2 * p.z() < 0.5;
  }
  EXPECT_NEAR(right, 2048, 32);
  EXPECT_NEAR(inner, 4096 / 4, 32);  // In the cube, the probability density of x + 2 z is 1/4 up to 1.
}

TEST(ThresholdSeeds, AreTheSameAgainAndDependOnTheSeed) {
  const TensorField field = cube_field(9, traced);
  const auto seeds = threshold_seeds(field, trace_from(1), 200, 3);
  ASSERT_EQ(seeds.size(), 200u);
  EXPECT_EQ(seeds, threshold_seeds(field, trace_from(1), 200, 3));
  EXPECT_NE(seeds, threshold_seeds(field, trace_from(1), 200, 4));
  const auto fewer = threshold_seeds(field, trace_from(1), 20, 3);
  EXPECT_EQ(fewer, std::vector<Vector3d>(seeds.begin(), seeds.begin() + 20));
}

TEST(ThresholdSeeds, SaysWhatValuesThereAreWhenNoneIsWanted) {
  const TensorField field = constant_field(2 * Matrix3d::Identity());
  EXPECT_EQ(message([&] { threshold_seeds(field, trace_from(7, 8), 10, 1); }),
            "only 0 of 10 seeds found where the threshold wants values from 7 to 8: in the box they are from 6 to 6; "
            "widen the threshold, or ask for fewer seeds");
  EXPECT_THROW(threshold_seeds(field, trace_from(0), 0, 1), std::invalid_argument);
  EXPECT_THROW(threshold_seeds(field, trace_from(2, 1), 1, 1), std::invalid_argument);
}

}  // namespace
}  // namespace tensorray
