#include "tools/import/surfaces/mesh_boundary.h"

#include <cmath>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkUnsignedCharArray.h>

#include "renderer/meshes/mesh.h"
#include "tests/import/mesh_fixtures.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;

std::filesystem::path file_name(const std::string& name) {
  const auto path = std::filesystem::path(::testing::TempDir()) / ("mesh_boundary_" + name + ".ply");
  std::filesystem::remove(path);
  return path;
}

double signed_volume(const TriangleMesh& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles)
    volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
  return volume;
}

/// The cubes of edge 2 / n of the shell 1 <= max |x|, |y|, |z| <= 3, which has a cubical hole of edge 2.
Grid shell(int n) {
  const Grid cubes = unit_cube(VTK_HEXAHEDRON, 3 * n, [](const Vector3d& p) { return Vector3d(6 * p.array() - 3); });
  auto grid = Grid::New();
  grid->SetPoints(cubes->GetPoints());
  vtkNew<vtkIdList> ids;
  for (vtkIdType i = 0; i < cubes->GetNumberOfCells(); ++i) {
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> bounds(cubes->GetCell(i)->GetBounds());
    const Vector3d middle(bounds[0] + bounds[1], bounds[2] + bounds[3], bounds[4] + bounds[5]);
    if ((0.5 * middle).cwiseAbs().maxCoeff() < 1) continue;
    cubes->GetCellPoints(i, ids);
    grid->InsertNextCell(VTK_HEXAHEDRON, ids);
  }
  return grid;
}

TEST(MeshBoundary, AHoleIsAClosedSurfaceThatLooksOutOfTheBody) {
  const auto path = file_name("hole");
  EXPECT_EQ(write_boundary(*shell(2), path), 6u * 4u * 2u);
  TriangleMesh mesh = read_mesh(path);
  EXPECT_EQ(mesh.vertices.size(), 26u);  // shared, although each cell has its own points
  EXPECT_EQ(mesh.triangles.size(), 48u);
  EXPECT_NEAR(signed_volume(mesh), 8, 1e-12);
  EXPECT_TRUE(mesh.bounds().isApprox(Eigen::AlignedBox3d(Vector3d(-1, -1, -1), Vector3d(1, 1, 1))));
  EXPECT_NO_THROW(require_closed(mesh));
}

TEST(MeshBoundary, AConvexMeshHasNoneAndLeavesNoFile) {
  const auto path = file_name("convex");
  for (const int type : {VTK_HEXAHEDRON, VTK_WEDGE, VTK_PYRAMID, VTK_TETRA, VTK_QUADRATIC_TETRA})
    EXPECT_EQ(write_boundary(*unit_cube(type, 3, [](const Vector3d& p) { return p; }), path), 0u) << type;
  const Map ball = [](const Vector3d& p) {
    const Vector3d q = 2 * p.array() - 1;
    const double norm = q.norm();
    return Vector3d(norm > 0 ? Vector3d(q * (q.cwiseAbs().maxCoeff() / norm)) : q);
  };
  EXPECT_EQ(write_boundary(*unit_cube(VTK_HEXAHEDRON, 8, ball), path), 0u);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(MeshBoundary, CurvedFacesAreDividedFinely) {
  const auto path = file_name("curved");
  const Grid grid = unit_cube(VTK_QUADRATIC_HEXAHEDRON, 4, [](const Vector3d& p) {
    const double angle = 1.5707963267949 * p.x();
    return Vector3d((1 + p.y()) * std::cos(angle), (1 + p.y()) * std::sin(angle), p.z());
  });
  const std::size_t triangles = write_boundary(*grid, path);
  EXPECT_GT(triangles, 16u * 6u);  // The concave side of a quarter of a pipe.
  const TriangleMesh mesh = read_mesh(path);
  for (const auto& t : mesh.triangles) {  // The radius of parabolas is wrong by 5e-5, that of chords by 3e-4.
    const Vector3d centre = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
    EXPECT_NEAR(centre.head<2>().norm(), 1, 5e-4);
    for (const std::uint32_t vertex : t) EXPECT_NEAR(mesh.vertices[vertex].head<2>().norm(), 1, 1e-4);
  }
}

TEST(MeshBoundary, HiddenCellsBelongToTheBody) {
  const auto mesh = curvilinear({6, 6, 6}, [](const Vector3d& p) { return p; });
  const auto path = file_name("hidden");
  EXPECT_EQ(write_boundary(*mesh, path), 0u);
  mesh->BlankCell(62);  // the middle cell
  EXPECT_EQ(write_boundary(*mesh, path), 12u);
  EXPECT_NEAR(signed_volume(read_mesh(path)), 0.008, 1e-12);
}

TEST(MeshBoundary, RefusesFlatMeshesAndFoldersThatAreMissing) {
  const auto flat_mesh = curvilinear({3, 3, 1}, [](const Vector3d& p) { return Vector3d(p.x(), p.y(), 0); });
  EXPECT_THROW(write_boundary(*flat_mesh, file_name("flat")), std::invalid_argument);
  EXPECT_THAT([] { write_boundary(*shell(1), "/no/such/folder/body.ply"); },
              ::testing::ThrowsMessage<std::runtime_error>(::testing::HasSubstr("/no/such/folder/body.ply")));
}

}  // namespace
}  // namespace tensorray
