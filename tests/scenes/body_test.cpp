// Scenes of fields that have the surface of their body.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "renderer/meshes/mesh.h"
#include "scenes/scene/scene.h"
#include "tests/scenes/read_scene_fixture.h"
#include "tests/scenes/small_scene.h"
#include "volumes/files/tensor_files.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// A field of 9³ voxels, and a surface that reaches `beyond` voxels further.
TensorGrid grid_of_body(double beyond) {
  TensorGrid grid =
      dense_grid({Vector3i(0, 0, 0), Vector3i(8, 8, 8)}, Eigen::Affine3d::Identity(), [](const Vector3i& i) {
        const Vector3d p = i.cast<double>() / 8;
        return Eigen::Matrix3d(Vector3d(1 + p.x(), 2 - p.y(), p.z()).asDiagonal());
      });
  grid.surface = box_mesh({Vector3d::Constant(-beyond), Vector3d::Constant(8 + beyond)}, Eigen::Affine3d::Identity());
  return grid;
}

class BodyScene : public test::ReadScene {
 protected:
  void write(const TensorGrid& grid) const { write_tensor_vdb(folder_ / "field.vdb", grid); }

  SceneDescription describe(const test::Overrides& changes) const {
    return read(changes, test::small_scene(R"({"file": "field.vdb"})"));
  }
  Scene load(const test::Overrides& changes = {}) const { return load_scene(describe(changes), Progress()); }
};

std::size_t triangles_of_cut(const Scene& scene) {
  const auto& cut = scene.geometry.surfaces().cut;
  return cut ? cut->triangles.size() : 0;
}

TEST_F(BodyScene, EndsAtItsSurface) {
  write(grid_of_body(0.4));
  const Scene scene = load();
  EXPECT_EQ(triangles_of_cut(scene), 12u);
  EXPECT_EQ(scene.field.interpolant(), (Interpolant{Interpolation::cubic, Border::extend}));
  EXPECT_EQ(scene.field.index_bounds().max(), Vector3d(9, 9, 9));
  EXPECT_THAT(scene.notes, Contains("body: surface of 12 triangles"));
  EXPECT_EQ(load({"field.border=fade"}).field.interpolant().border, Border::fade);
  EXPECT_EQ(load({"field.smooth=0.5"}).field.index_bounds().max(), Vector3d(9, 9, 9)) << "preprocessing keeps it";
  EXPECT_EQ(load({"field.bounds=auto"}).field_key, load({"field.bounds=auto", "field.scale=2"}).field_key);
  write(grid_of_body(2.5));
  EXPECT_THAT(load().notes, Contains(HasSubstr("0.5 voxels beyond")));
}

/// As a field without a surface, in all its bits.
TEST_F(BodyScene, NoneIsTheBoxAlone) {
  const test::Overrides none{"field.bounds=none"};
  write(grid_of_body(0.4));
  const Scene scene = load(none);
  TensorGrid plain = grid_of_body(0);
  plain.surface = {};
  write(plain);
  const Scene other = load();
  EXPECT_EQ(triangles_of_cut(scene), 0u);
  EXPECT_EQ(scene.field.index_bounds().max(), Vector3d(8, 8, 8));
  EXPECT_EQ(scene.field.interpolant(), other.field.interpolant());
  EXPECT_EQ(scene.scale.scale, other.scale.scale);
  EXPECT_EQ(scene.field.bricks(), other.field.bricks());
  EXPECT_NE(scene.field_key, field_key(describe({}))) << "no field of another border is taken for it";
}

TEST_F(BodyScene, AnotherMeshReplacesIt) {
  write(grid_of_body(0.4));
  const auto tetrahedron = "v 1 1 1\nv 7 1 1\nv 1 7 1\nv 1 1 7\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  std::ofstream(folder_ / "other.obj") << tetrahedron;
  const std::optional<Scene> scene(load({"field.bounds=other.obj"}));
  EXPECT_EQ(triangles_of_cut(*scene), 4u);
  EXPECT_THAT(scene->notes, Not(Contains(HasSubstr("body:"))));
  // The field is the same: the live view does not load it again.
  EXPECT_TRUE(field_of(scene, describe({"field.bounds=other.obj", "field.scale=3"})));
  EXPECT_THAT(error({"field.bounds=nothing"}), AllOf(HasSubstr("/field/bounds"), HasSubstr("none")));
}

TEST_F(BodyScene, ASurfaceThatIsOpenIsAnError) {
  TensorGrid grid = grid_of_body(0);
  grid.surface.triangles.pop_back();
  write(grid);
  const auto reason = [&]() -> std::string {
    try {
      load();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(reason(),
              AllOf(HasSubstr("field.vdb"), HasSubstr("3 open edges"), HasSubstr("`field.bounds: \"none\"`")));
  EXPECT_EQ(triangles_of_cut(load({"field.bounds=none"})), 0u);
}

}  // namespace
}  // namespace tensorray
