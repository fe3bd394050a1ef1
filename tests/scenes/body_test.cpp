#include "scenes/outputs/body_outline.h"
#include "tests/renderer/shapes.h"
#include "tests/scenes/pictures/pictures.h"
#include "tests/scenes/small_scene.h"
#include "tests/tracing/support.h"
#include "volumes/files/tensor_files.h"

namespace tensorray {
namespace {

/// A field of 9³ voxels, and a surface that reaches `beyond` voxels further.
TensorGrid grid_of_body(double beyond) {
  TensorGrid grid = dense_grid({Vector3i(0, 0, 0), Vector3i(8, 8, 8)}, Affine3d::Identity(), [](const Vector3i& i) {
    const Vector3d p = i.cast<double>() / 8;
    return Matrix3d(Vector3d(1 + p.x(), 2 - p.y(), p.z()).asDiagonal());
  });
  grid.surface = box_between(Vector3d::Constant(-beyond), Vector3d::Constant(8 + beyond));
  return grid;
}

class BodyScene : public Pictures {
 protected:
  BodyScene() { write("scene.json", small_scene(R"({"file": "field.vdb"})")); }

  void write_field(const TensorGrid& grid) const { write_tensor_vdb(in_folder("field.vdb"), grid); }
  SceneDescription describe(const Settings& changes) const {
    return read_scene(in_folder("scene.json"), {changes, {}});
  }
  Scene load(const Settings& changes = {}) const { return load_scene(describe(changes), Progress()); }
};

std::size_t triangles_of_cut(const Scene& scene) {
  const auto& cut = scene.geometry.surfaces().cut;
  return cut ? cut->triangles.size() : 0;
}

TEST_F(BodyScene, EndsAtItsSurface) {
  write_field(grid_of_body(0.4));
  const Scene scene = load();
  EXPECT_EQ(triangles_of_cut(scene), 12u);
  EXPECT_EQ(scene.field.interpolant(), (Interpolant{Interpolation::cubic, Border::extend}));
  EXPECT_EQ(scene.field.index_bounds().max(), Vector3d(9, 9, 9));
  EXPECT_THAT(scene.notes, Contains("body: surface of 12 triangles"));
  EXPECT_EQ(load({"field.border=fade"}).field.interpolant().border, Border::fade);
  EXPECT_EQ(load({"field.smooth=0.5"}).field.index_bounds().max(), Vector3d(9, 9, 9)) << "preprocessing keeps it";
  EXPECT_EQ(load({"field.bounds=auto"}).field_key, load({"field.bounds=auto", "field.scale=2"}).field_key);
  write_field(grid_of_body(2.5));
  EXPECT_THAT(load().notes, Contains(HasSubstr("0.5 voxels beyond")));
}

/// As a field without a surface, in all its bits.
TEST_F(BodyScene, NoneIsTheBoxAlone) {
  write_field(grid_of_body(0.4));
  const Scene scene = load({"field.bounds=none"});
  TensorGrid plain = grid_of_body(0);
  plain.surface = {};
  write_field(plain);
  const Scene other = load();
  EXPECT_EQ(triangles_of_cut(scene), 0u);
  EXPECT_EQ(scene.field.index_bounds().max(), Vector3d(8, 8, 8));
  EXPECT_EQ(scene.field.interpolant(), other.field.interpolant());
  EXPECT_EQ(scene.scale.scale, other.scale.scale);
  EXPECT_EQ(scene.field.bricks(), other.field.bricks());
  EXPECT_NE(scene.field_key, field_key(describe({}))) << "no field of another border is taken for it";
}

TEST_F(BodyScene, AnotherMeshReplacesIt) {
  write_field(grid_of_body(0.4));
  write("other.obj", "v 1 1 1\nv 7 1 1\nv 1 7 1\nv 1 1 7\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");  // A tetrahedron.
  const std::optional<Scene> scene(load({"field.bounds=other.obj"}));
  EXPECT_EQ(triangles_of_cut(*scene), 4u);
  EXPECT_THAT(scene->notes, Not(Contains(HasSubstr("body:"))));
  // The field is the same: the live view does not load it again.
  EXPECT_TRUE(field_of(scene, describe({"field.bounds=other.obj", "field.scale=3"})));
  expect_error(2, "/field/bounds.*none", {"field.bounds=nothing"});
}

TEST_F(BodyScene, ASurfaceThatIsOpenIsAnError) {
  TensorGrid grid = grid_of_body(0);
  grid.surface.triangles.pop_back();
  write_field(grid);
  expect_error(1, "field.vdb.*3 open edges.*`field.bounds: \"none\"`", {});
  EXPECT_EQ(triangles_of_cut(load({"field.bounds=none"})), 0u);
}

/// 100 × 100 pixels of one unit, below everything; seen from above.
Plate outline_plate() {
  Plate plate = plate_across({0, 0, -1}, 10);
  plate.size = {100, 100};
  plate.resolution = {100, 100};
  return plate;
}

/// The length of the strokes between two points that are visible, and of those that are hidden.
Vector2d stroke_lengths(const std::vector<OutlineStroke>& strokes, const Vector2d& a, const Vector2d& b) {
  Vector2d sum(0, 0);
  const Vector2d along = (b - a).normalized();
  const auto is_on = [&](const Vector2d& p) {
    const double place = std::clamp((p - a).dot(along), 0.0, (b - a).norm());
    return (a + place * along - p).norm() < 1e-9;
  };
  for (const OutlineStroke& stroke : strokes)
    if (is_on(stroke.from) && is_on(stroke.to)) sum[stroke.is_hidden ? 1 : 0] += (stroke.to - stroke.from).norm();
  return sum;
}

double outline_length(const std::vector<OutlineStroke>& strokes) {
  double sum = 0;
  for (const OutlineStroke& stroke : strokes) sum += (stroke.to - stroke.from).norm();
  return sum;
}

/// A box of 20 × 10 × 8 in light that falls by one unit along x and two along y for each unit of height. Its corner
/// (x, y, z) is at the pixel (50 + x + z + 10, 50 − y − 2 (z + 10)).
TEST(BodyOutlineTest, ABoxHasItsTwelveEdgesAtKnownPixels) {
  const auto strokes = body_outline({box_between({-10, -5, 0}, {10, 5, 8})}, outline_plate(), {1, 2, -1});
  const auto at = [](double x, double y, double z) { return Vector2d(50 + x + z + 10, 50 - y - 2 * (z + 10)); };
  // The viewer is above, and on the side of −x and −y.
  for (const double z : {0.0, 8.0})
    for (const double y : {-5.0, 5.0}) {
      const bool is_hidden = z == 0 && y == 5;
      const Vector2d found = stroke_lengths(strokes, at(-10, y, z), at(10, y, z));
      EXPECT_NEAR(found[is_hidden ? 1 : 0], 20, 1e-9) << y << " " << z;
      EXPECT_NEAR(found[is_hidden ? 0 : 1], 0, 1e-9) << y << " " << z;
    }
  for (const double x : {-10.0, 10.0})
    for (const double y : {-5.0, 5.0}) {
      const Vector2d found = stroke_lengths(strokes, at(x, y, 0), at(x, y, 8));
      EXPECT_NEAR(found[x > 0 && y > 0 ? 1 : 0], 8 * std::sqrt(5), 1e-9) << x << " " << y;
    }
  EXPECT_NEAR(outline_length(strokes), 4 * (20 + 10 + 8 * std::sqrt(5)), 1e-6);  // And no diagonals.
}

/// A box above another one hides a part of its edges. Seen straight from above, edges of the top and of the bottom lie
/// on each other.
TEST(BodyOutlineTest, ABodyHidesTheLinesBehindIt) {
  const auto strokes =
      body_outline({box_between({-30, -30, -10}, {30, 30, -5}), box_between({-40, -10, 0}, {0, 10, 5})},
                   outline_plate(), {0, 0, -1});
  const Vector2d left = stroke_lengths(strokes, {20, 20}, {20, 80});  // Edges of the lower box.
  EXPECT_NEAR(left[0], 2 * 40, 2);
  EXPECT_NEAR(left[1], 2 * 20, 2);
  EXPECT_NEAR(stroke_lengths(strokes, {10, 40}, {50, 40})[0], 2 * 40, 1e-9);
}

/// Two boxes that touch, whose inner faces lie on each other: as one. Each has vertices of its own.
TEST(BodyOutlineTest, ShellsThatTouchHaveNoLineBetweenThem) {
  const TriangleMesh both = joined({box_between({-20, -5, 0}, {0, 5, 8}), box_between({0, -5, 0}, {20, 5, 8})});
  const auto strokes = body_outline({both}, outline_plate(), {0, 0, -1});
  EXPECT_NEAR(stroke_lengths(strokes, {50, 45}, {50, 55})[0], 0, 1e-9);
  EXPECT_NEAR(stroke_lengths(strokes, {30, 45}, {30, 55})[0], 2 * 10, 1e-9);
  EXPECT_NEAR(stroke_lengths(strokes, {30, 45}, {70, 45})[0], 2 * 40, 1e-9);
}

TEST(BodyOutlineTest, ABallIsACircle) {
  TriangleMesh ball = std::get<TriangleMesh>(sphere(60).shape);
  for (Vector3d& vertex : ball.vertices) vertex = 9 * vertex + Vector3d(5, 0, 0);
  const auto strokes = body_outline({ball}, outline_plate(), {0, 0, -1});
  EXPECT_NEAR(outline_length(strokes), 2 * pi * 9, 0.1);
  for (const OutlineStroke& stroke : strokes) EXPECT_NEAR((stroke.from - Vector2d(55, 50)).norm(), 9, 0.1);
}

}  // namespace
}  // namespace tensorray
