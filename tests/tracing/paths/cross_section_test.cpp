#include "tracing/paths/cross_section.h"

#include "base/constants.h"
#include "tests/tracing/support.h"

namespace tensorray {
namespace {

CrossSectionSettings radii(double least, double greatest = 1e300) { return {1, least, greatest}; }

PathPoint point_of(const Vector3d& position, const Vector3d& direction, const Matrix3d& tensor) {
  PathPoint point;
  point.position = position;
  point.direction = direction.normalized();
  point.tensor = tensor;
  point.in_field = true;
  return point;
}

/// Along z from 0 to 1, with a tensor that depends on z.
PathPoints straight_way(int count, const std::function<Matrix3d(double)>& tensor) {
  PathPoints points;
  for (int i = 0; i < count; ++i) {
    const double z = double(i) / (count - 1);
    points.push_back(point_of({0, 0, z}, {0, 0, 1}, tensor(z)));
  }
  return points;
}

/// A helix of radius 1 about z, by its angle.
constexpr double rise = 0.4;  // Per radian.
PathPoint helix_point(double angle, const Matrix3d& tensor) {
  return point_of({std::cos(angle), std::sin(angle), rise * angle}, {-std::sin(angle), std::cos(angle), rise}, tensor);
}

TEST(CrossSection, IsTheImageOfTheCircleOfEquation8) {
  const Matrix3d T = general_tensor();
  const Vector3d V = Vector3d(0.3, -0.8, 0.5).normalized(), normal = (T.transpose() * V).normalized();
  const Eigen::Matrix<double, 3, 2> axes = ellipse(T, V);
  const double a = axes.col(0).norm(), b = axes.col(1).norm();
  EXPECT_NEAR(axes.col(0).dot(axes.col(1)), 0, 1e-13);
  double greatest = 0, least = 1e300;
  const Vector3d first = normal.cross(Vector3d::UnitX()).normalized(), second = normal.cross(first);
  for (int i = 0; i < 3600; ++i) {
    const double angle = 2 * pi * i / 3600;
    const Vector3d image = T * (std::cos(angle) * first + std::sin(angle) * second);
    EXPECT_NEAR(image.dot(V), 0, 1e-13);
    const double x = image.dot(axes.col(0)) / (a * a), y = image.dot(axes.col(1)) / (b * b);
    EXPECT_NEAR(x * x + y * y, 1, 1e-12);
    greatest = std::max(greatest, image.norm());
    least = std::min(least, image.norm());
  }
  EXPECT_NEAR(greatest, a, 1e-5 * a);
  EXPECT_NEAR(least, b, 1e-5 * a);
}

TEST(CrossSection, DegenerateTensorsKeepAVisibleRadius) {
  const Vector3d V = Vector3d::UnitZ();
  Matrix3d rank_one = Matrix3d::Zero(), annihilated = Matrix3d::Zero();
  rank_one(0, 1) = 2;     // T = 2 x yᵀ: TᵀV = 0, and the image is a line.
  annihilated(0, 0) = 3;  // The last row is zero: TᵀV = 0.
  annihilated(1, 2) = 4;
  EXPECT_TRUE(ellipse(Matrix3d::Zero(), V).isZero());
  EXPECT_NEAR(ellipse(rank_one, V).col(0).norm(), 2, 1e-12);
  EXPECT_NEAR(ellipse(rank_one, V).col(1).norm(), 0, 1e-12);
  EXPECT_NEAR(ellipse(annihilated, V).col(0).norm(), 4, 1e-12);
  EXPECT_NEAR(ellipse(annihilated, V).col(1).norm(), 3, 1e-12);
  const PathPoints points{point_of({0, 0, 0}, V, Matrix3d::Zero()), point_of({0, 0, 1}, V, rank_one),
                          point_of({0, 0, 2}, V, Matrix3d::Zero()), point_of({0, 0, 3}, V, 1e150 * annihilated)};
  const std::vector<CrossSection> sections = cross_sections(points, radii(0.1, 0.5));
  const double round = 0.5 / std::pow(1 + std::pow(0.75, 4), 0.25);  // Far too large: as near to 0.5 as it gets.
  const double major[] = {0.1, 0.3 + 0.2 * 8.5 / std::hypot(8.5, 1), 0.1, round},
               minor[] = {0.1, 0.1, 0.1, 0.75 * round};
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(sections[i].major.norm(), major[i], 1e-12);
    EXPECT_NEAR(sections[i].minor.norm(), minor[i], 1e-12);
  }
}

TEST(CrossSection, LimitsHaveNoCorners) {
  // From nothing to far beyond the greatest radius; the axes change places on the way. The slopes of both widths are
  // continuous: their jumps between steps get smaller with the steps.
  const auto greatest_jump = [](int count) {
    const PathPoints points =
        straight_way(count, [](double z) -> Matrix3d { return Vector3d(0.01 + 3 * z * z, z - 0.2, 1).asDiagonal(); });
    const std::vector<CrossSection> s = cross_sections(points, radii(0.1, 0.5));
    double jump = 0;
    for (std::size_t i = 1; i + 1 < s.size(); ++i) {
      const auto extent = [&](std::size_t k, int axis) { return std::hypot(s[k].x[axis], s[k].y[axis]); };
      for (const int axis : {0, 1})
        jump = std::max(jump, std::abs(extent(i + 1, axis) - 2 * extent(i, axis) + extent(i - 1, axis)) * count);
      EXPECT_LT(s[i].major.norm(), 0.5);
      EXPECT_GE(s[i].minor.norm(), 0.1);
    }
    return jump;
  };
  EXPECT_NEAR(greatest_jump(2001) / greatest_jump(1001), 0.5, 0.05);
  // Sizes between the limits are true.
  const PathPoints round = straight_way(2, [](double) -> Matrix3d { return 0.3 * Matrix3d::Identity(); });
  EXPECT_NEAR(cross_sections(round, radii(0.1, 1)).front().major.norm(), 0.3, 1e-12);
}

TEST(CrossSection, BothPairsOfVectorsSpanTheSameEllipse) {
  PathPoints points;
  for (int i = 0; i < 40; ++i) {
    const double angle = 0.1 * i;
    points.push_back(helix_point(angle, linear_tensor({std::sin(angle), std::cos(2 * angle), 0.1 * angle})));
  }
  const std::vector<CrossSection> sections = cross_sections(points, radii(0.01));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CrossSection& s = sections[i];
    const Vector3d& V = points[i].direction;
    EXPECT_GE(s.major.norm(), s.minor.norm());
    EXPECT_NEAR(s.major.dot(s.minor), 0, 1e-12);
    EXPECT_NEAR(s.x.cross(s.y).dot(V), s.major.norm() * s.minor.norm(), 1e-12);
    EXPECT_NEAR(s.major.cross(s.minor).dot(V), s.major.norm() * s.minor.norm(), 1e-12);
    for (const double angle : {0.0, 1.0, 2.5}) {
      const Vector3d p = std::cos(angle) * s.x + std::sin(angle) * s.y;
      const double a = p.dot(s.major) / s.major.squaredNorm(), b = p.dot(s.minor) / s.minor.squaredNorm();
      EXPECT_NEAR(a * a + b * b, 1, 1e-11);
      EXPECT_NEAR(p.dot(V), 0, 1e-12);
    }
  }
}

TEST(CrossSection, TransportAlongAHelixUnwindsItsTorsion) {
  // Against Frenet's frame a frame without twist turns by −torsion · length: torsion = rise / (1 + rise²).
  const double turns = 2 * pi, length = turns * std::sqrt(1 + rise * rise), torsion = rise / (1 + rise * rise);
  const auto error = [&](int steps) {
    Vector3d normal = -Vector3d::UnitX();  // The principal normal at angle 0, and at 2 π.
    for (int i = 0; i < steps; ++i) {
      const PathPoint from = helix_point(turns * i / steps, {}), to = helix_point(turns * (i + 1) / steps, {});
      normal = transported(normal, from.position, from.direction, to.position, to.direction);
    }
    const Vector3d tangent = helix_point(turns, {}).direction;
    const Vector3d exact = Eigen::AngleAxisd(-torsion * length, tangent) * Vector3d(-Vector3d::UnitX());
    return (normal - exact).norm();
  };
  EXPECT_LT(error(64), 1e-4);
  EXPECT_NEAR(std::log2(error(32) / error(64)), 4, 0.2);
}

TEST(CrossSection, VanishingOnTheWayNeitherFlipsNorTwists) {
  // T is zero at z = 1/2, where the ellipse is clamped to a circle, and changes its sign there; the way is a helix.
  const Matrix3d T = Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()) * Vector3d(2, 1, 0.3).asDiagonal();
  PathPoints points;
  const int count = 401;
  for (int i = 0; i < count; ++i) points.push_back(helix_point(0.01 * i, (double(i) / (count - 1) - 0.5) * T));
  const std::vector<CrossSection> sections = cross_sections(points, radii(0.05));
  for (std::size_t i = 1; i < points.size(); ++i) {
    // No faster than the tensor changes, and than a frame of this size turns; both with room for the turn of C.
    const double allowed = 3 * ((points[i].tensor - points[i - 1].tensor).norm() +
                                sections[i].major.norm() * (points[i].direction - points[i - 1].direction).norm());
    EXPECT_LT((sections[i].x - sections[i - 1].x).norm(), allowed) << i;
    EXPECT_LT((sections[i].y - sections[i - 1].y).norm(), allowed) << i;
    EXPECT_GT(sections[i].x.cross(sections[i].y).dot(points[i].direction), 0);
  }
  EXPECT_NEAR(sections[200].x.norm(), 0.05, 1e-9);
  EXPECT_NEAR(sections[200].y.norm(), 0.05, 1e-9);
}

TEST(CrossSection, ATurningEllipseIsFollowedWithoutAFlip) {
  // The ellipse makes three turns: its axis comes round with it, and the surface moves no faster than the tensor.
  const auto turned = [](double z) -> Matrix3d {
    const Matrix3d turn = Eigen::AngleAxisd(6 * pi * z, Vector3d::UnitZ()).toRotationMatrix();
    return turn * Vector3d(3, 1, 1).asDiagonal() * turn.transpose();
  };
  const int count = 301;
  const PathPoints points = straight_way(count, turned);
  const std::vector<CrossSection> sections = cross_sections(points, radii(0.01));
  const double angle = 6 * pi / (count - 1);
  for (std::size_t i = 1; i < points.size(); ++i) {
    EXPECT_NEAR(sections[i].major.normalized().dot(sections[i - 1].major.normalized()), std::cos(angle), 1e-9);
    const double change = (points[i].tensor - points[i - 1].tensor).norm();
    EXPECT_LT((sections[i].x - sections[i - 1].x).norm(), change);
    EXPECT_LT((sections[i].y - sections[i - 1].y).norm(), change);
  }
}

TEST(CrossSection, TheScaleSetsTheMedianRadius) {
  const PathPoints points = straight_way(11, [](double z) -> Matrix3d { return (1 + z) * Matrix3d::Identity(); });
  EXPECT_NEAR(scale_for_radius({&points}, 0.3), 0.3 / 1.5, 1e-12);
  EXPECT_EQ(scale_for_radius({}, 0.3), 1);
}

TEST(CrossSection, RefusesSettingsOutOfRange) {
  EXPECT_THROW(cross_sections({}, radii(0)), std::invalid_argument);
  EXPECT_THROW(cross_sections({}, radii(1, 0.5)), std::invalid_argument);
  EXPECT_THROW(cross_sections({}, CrossSectionSettings{0, 1, 2}), std::invalid_argument) << "a scale of 0";
}

}  // namespace
}  // namespace tensorray
