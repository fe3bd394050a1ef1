#include <random>
#include <utility>

#include "tests/renderer/shapes.h"
#include "tests/tracing/support.h"
#include "tracing/steps/scalar_tracer.h"

// Rays through closed meshes of all kinds, as the cut of a volume. Light is straight but for rounding (σ T ~ 1e-9), so
// that its way within a body of convex parts is known: that of their union.

namespace tensorray::test {
namespace {

/// Closed, convex and outwards.
using Parts = std::vector<TriangleMesh>;

/// The same box with the other diagonal on each face, which mirroring makes.
TriangleMesh mirrored_part(const Vector3d& low, const Vector3d& high) {
  const Affine3d mirror(Eigen::Scaling(-1.0, 1.0, 1.0));
  return box_between({-high.x(), low.y(), low.z()}, {-low.x(), high.y(), high.z()}, mirror);
}

/// Rings of latitude about a centre; a pole is a corner of many triangles.
TriangleMesh ball_part(const Vector3d& center, double radius) {
  auto ball = std::get<TriangleMesh>(sphere(8).shape);
  for (Vector3d& vertex : ball.vertices) vertex = center + radius * vertex;
  return ball;
}

/// The cells of a box, each with its own faces, whose diagonals differ from cell to cell.
Parts cells(const Vector3d& low, const Vector3d& high, int count) {
  Parts parts;
  const Vector3d edge = (high - low) / count;
  for (int i = 0; i < count * count * count; ++i) {
    const Vector3i cell(i / count / count, i / count % count, i % count);
    const Vector3d from = low + cell.cast<double>().cwiseProduct(edge);
    parts.push_back(cell.sum() % 2 ? mirrored_part(from, from + edge) : box_between(from, from + edge));
  }
  return parts;
}

/// Length of a line within a union of convex parts and within the volume, each part grown by `more` on all sides.
double length_within(const Parts& parts, const Vector3d& from, const Vector3d& along, double more) {
  const auto within = [&](const TriangleMesh& part, double grown) {
    std::pair<double, double> range(-1e300, 1e300);
    for (const auto& t : part.triangles) {
      const Vector3d& a = part.vertices[t[0]];
      const Vector3d normal = (part.vertices[t[1]] - a).cross(part.vertices[t[2]] - a).normalized();
      const double gap = grown + normal.dot(a - from), slope = normal.dot(along);
      if (slope < 0) range.first = std::max(range.first, gap / slope);
      if (slope > 0) range.second = std::min(range.second, gap / slope);
      if (slope == 0 && gap < 0) range.second = -1e300;
    }
    return range;
  };
  const auto volume = within(box_between(Vector3d::Constant(-1), Vector3d::Ones()), more);
  std::vector<std::pair<double, double>> ranges;
  for (const TriangleMesh& part : parts) {
    const auto range = within(part, more);
    ranges.emplace_back(std::max(range.first, volume.first), std::min(range.second, volume.second));
  }
  std::sort(ranges.begin(), ranges.end());
  double sum = 0, end = -1e300;
  for (const auto& [first, last] : ranges) {
    sum += std::max(0.0, last - std::max(first, end));
    end = std::max(end, last);
  }
  return sum;
}

/// Length of a path where it bends.
double bent_length(const PathPoints& points) {
  double sum = 0;
  for (std::size_t i = 1; i < points.size(); ++i)
    if (points[i - 1].in_field && points[i].in_field) sum += points[i].length - points[i - 1].length;
  return sum;
}

struct CutCase {
  std::string name;
  Parts parts;
};

std::vector<CutCase> cut_cases() {
  const Vector3d half = Vector3d::Constant(0.5), one = Vector3d::Ones();
  const auto column = [](double x, double width, bool mirrored = false) {
    const Vector3d low(x, -0.5, -0.5), high(x + width, 0.5, 0.5);
    return mirrored ? mirrored_part(low, high) : box_between(low, high);
  };
  Parts with_ball = cells(-half, half, 2);
  with_ball.push_back(ball_part({0.25, 0, 0.5}, 0.4));
  return {
      {"ABox", {box_between(-half, half)}},
      {"ABoxThatFillsTheVolume", {box_between(-one, one)}},
      {"ABoxBeyondTheVolume", {box_between(-2 * one, 1.1 * one)}},
      {"ALayerOfTheVolume", {box_between({-1, -1, -0.125}, {1, 1, 0.125})}},
      {"ABall", {ball_part({0, 0, 0}, 0.75)}},
      {"ABoxTwice", {box_between(-half, half), box_between(-half, half)}},
      {"ABoxTwiceOtherDiagonals", {box_between(-half, half), mirrored_part(-half, half)}},
      {"TouchingBoxes", {column(-0.5, 0.5), column(0, 0.5)}},
      {"TouchingBoxesOtherDiagonals", {column(-0.5, 0.5), column(0, 0.5, true)}},
      {"OverlappingBoxes", {column(-0.5, 0.6), column(-0.1, 0.6, true)}},
      {"BoxesWithAnEdgeInCommon", {box_between(-half, {0, 0, 0.5}), box_between({0, 0, -0.5}, half)}},
      {"BoxesWithAVertexInCommon", {box_between(-half, {0, 0, 0}), box_between({0, 0, 0}, half)}},
      {"ABoxInABox", {box_between(-half, half), box_between(-half / 2, half / 2)}},
      {"BallsThatTouch", {ball_part({-0.4, 0, 0}, 0.4), ball_part({0.4, 0, 0}, 0.4)}},
      {"CellsThatFillTheVolume", cells(-one, one, 4)},
      {"CellsAndABall", with_ball},
  };
}

enum class LineKind { random, through_vertices, in_faces, grazing };
constexpr LineKind line_kinds[] = {LineKind::random, LineKind::through_vertices, LineKind::in_faces, LineKind::grazing};

/// A line through the volume, from outside.
std::pair<Vector3d, Vector3d> a_line(LineKind kind, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<int> grid(-8, 8), axis_of(0, 2), step(-1, 1);
  const auto on_grid = [&] { return Vector3d(grid(random) / 8.0, grid(random) / 8.0, grid(random) / 8.0); };
  const auto anywhere = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  Vector3d through = on_grid(), along = anywhere();
  const int axis = axis_of(random);
  switch (kind) {
    case LineKind::random:
      through = 0.5 * anywhere();
      break;
    case LineKind::through_vertices:
      do along = Vector3d(step(random), step(random), step(random));
      while (along.isZero());
      break;
    case LineKind::in_faces:
      along[axis] = 0;
      break;
    case LineKind::grazing:
      along[axis] = std::pow(10, -2 - 2 * std::abs(normal(random))) * step(random);
      through[axis] += std::pow(10, -6 - 2 * std::abs(normal(random))) * step(random);
      break;
  }
  along.normalize();
  return {through - 4 * along, along};
}

class CutTest : public testing::TestWithParam<CutCase> {
 protected:
  static const TensorField& field() {
    static const TensorField result(cube_grid(Vector3i::Constant(17), [](const Vector3d&) { return general_tensor(); }),
                                    {Interpolation::cubic, Border::extend});
    return result;
  }

  Geometry geometry() const {
    Surfaces surfaces = surfaces_of(field());
    surfaces.cut = joined(GetParam().parts);
    return Geometry(std::move(surfaces));
  }

  /// A ray may graze twenty times, in four steps each.
  static BendingSettings few_steps() {
    BendingSettings settings;
    settings.max_steps = 100;
    return settings;
  }

  static RayBatch lines(LineKind kind, double flexibility) {
    RayBatch batch;
    std::mt19937 random(7);
    for (int i = 0; i < 1000; ++i) {
      const auto [from, along] = a_line(kind, random);
      batch.add(from, along, flexibility);
    }
    return batch;
  }

  /// By how much the turns of rays differ that pass the body up to 0.04 voxels beside a ray, by the reference.
  static double spread(const Geometry& geometry, const RayBatch& start, std::size_t ray) {
    RayBatch around;
    for (int axis = 0; axis < 3; ++axis)
      for (const double beside : {-0.04, -1e-4, 0.0, 1e-4, 0.04}) {
        const Vector3d tilt = beside * 0.125 / 4 * Vector3d::Unit(axis);  // Rays start at 4 from the body.
        around.add(start.position[ray], (start.direction[ray] + tilt).normalized(), start.flexibility[ray]);
      }
    RayBatch ends = around;
    trace_reference(field(), geometry, {}, ends);
    AlignedBox3d turns;
    for (std::size_t i = 0; i < ends.size(); ++i) turns.extend(ends.direction[i] - around.direction[i]);
    return turns.diagonal().norm();
  }
};

/// No ray stays at a surface, and straight light is in the body as far as the union of its parts reaches. What is
/// within the margin of surfaces may count as either.
TEST_P(CutTest, LightIsInTheBodyAsFarAsItReaches) {
  const Geometry geometry = this->geometry();
  const double near = 4 * geometry.margin();
  for (const LineKind kind : line_kinds) {
    const RayBatch start = lines(kind, 1e-9);
    RayBatch batch = start;
    std::vector<RayRecord> records;
    trace(field(), geometry, few_steps(), batch, &records);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      SCOPED_TRACE("kind " + std::to_string(int(kind)) + ", ray " + std::to_string(i));
      ASSERT_EQ(batch.end[i], RayEnd::missed);
      const auto expected = [&](double more) {
        return length_within(GetParam().parts, start.position[i], start.direction[i], more);
      };
      const double length = bent_length(points_of(field(), records[i]));
      EXPECT_GE(length, expected(-near) - 10 * near);
      EXPECT_LE(length, expected(near) + 10 * near);
    }
  }
}

/// The same rays bend in packets as one by one, alone or with differentials, within the part of a step that lands
/// straight. Both find surfaces within 0.02 voxels of the path: rays to which this matters, as they graze or pass an
/// edge, differ no more than those beside them.
TEST_P(CutTest, PacketsAgreeWithTheReference) {
  const Geometry geometry = this->geometry();
  const double flexibility = 0.3, longest_step = 0.125 * step_lengths::longest_composed;
  const double near = composed_landing * flexibility * deviator_norm(general_tensor()) * longest_step;
  for (const LineKind kind : line_kinds) {
    const RayBatch start = lines(kind, flexibility);
    RayBatch packets = start, reference = start, with_differentials = start;
    with_differentials.differentials.resize(start.size());
    trace(field(), geometry, few_steps(), packets);
    trace_reference(field(), geometry, few_steps(), reference);
    trace(field(), geometry, few_steps(), with_differentials);
    for (std::size_t i = 0; i < start.size(); ++i)
      for (const RayBatch* const batch : {&packets, &reference, &with_differentials}) {
        EXPECT_EQ(batch->end[i], RayEnd::missed) << "kind " << int(kind) << ", ray " << i;
        const double differs = (batch->direction[i] - reference.direction[i]).norm();
        if (differs <= near) continue;
        EXPECT_LE(differs, spread(geometry, start, i)) << "kind " << int(kind) << ", ray " << i;
      }
  }
}

/// Inner faces, and surfaces that are there twice, change nothing.
TEST(CutWithInnerFaces, BendsLightAsItsSkinDoes) {
  const TensorField field(cube_grid(Vector3i::Constant(17), linear_tensor), {Interpolation::cubic, Border::extend});
  const Vector3d half = Vector3d::Constant(0.5);
  RayBatch skin, inner;
  std::mt19937 random(9);
  for (int i = 0; i < 5000; ++i) {
    const auto [from, along] = a_line(LineKind::random, random);
    skin.add(from, along, 0.2);
  }
  inner = skin;
  for (RayBatch* const batch : {&skin, &inner}) {
    Surfaces surfaces = surfaces_of(field);
    surfaces.cut = batch == &skin ? box_between(-half, half) : joined(cells(-half, half, 3));
    trace(field, Geometry(std::move(surfaces)), {}, *batch);
  }
  for (std::size_t i = 0; i < skin.size(); ++i) {
    ASSERT_EQ(inner.end[i], RayEnd::missed);
    EXPECT_LT((skin.direction[i] - inner.direction[i]).norm(), 1e-5) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Bodies, CutTest, testing::ValuesIn(cut_cases()),
                         [](const auto& each) { return each.param.name; });

}  // namespace
}  // namespace tensorray::test
