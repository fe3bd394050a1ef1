// The surface of the body that a mesh is, of all types of cells.

#include "tools/import/surfaces/body_surface.h"

#include <set>

#include "renderer/meshes/mesh.h"
#include "tests/import/cell_types.h"
#include "tests/import/mesh_files.h"
#include "tests/import/velocity_meshes.h"
#include "tests/import/vtk_files.h"
#include "tools/import/meshes/flat_mesh.h"
#include "tools/import/surfaces/triangle_shells.h"
#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {
namespace {

BodySurface surface_of(vtkDataSet& mesh, double tolerance) { return body_surface(mesh, body_faces(mesh), tolerance); }

using namespace mesh_fixtures;

/// The unit cube to the unit ball.
Vector3d to_ball(const Vector3d& p) {
  const Vector3d q = 2 * p.array() - 1;
  const double norm = q.norm();
  return norm > 0 ? Vector3d(q * (q.cwiseAbs().maxCoeff() / norm)) : q;
}

/// To a plate of thickness 1 and radius 2 with a hole of radius 1.
Vector3d to_plate(const Vector3d& p) {
  const double angle = p.x() == 1 ? 0 : 2 * pi * p.x();
  return {(1 + p.y()) * std::cos(angle), (1 + p.y()) * std::sin(angle), p.z()};
}

bool is_pyramid(int type) {
  return type == VTK_PYRAMID || type == VTK_QUADRATIC_PYRAMID || type == VTK_TRIQUADRATIC_PYRAMID;
}

/// The corners, in a cube, of the cells of a kind that fill it.
std::vector<std::vector<std::size_t>> cells_in_cube(int type) {
  if (is_pyramid(type)) return {{0, 1, 3, 8}, {7, 6, 4, 8}, {0, 4, 1, 8}, {1, 5, 2, 8}, {2, 6, 3, 8}, {3, 7, 0, 8}};
  if (parametric_volume({type}) == 1) return {{0, 1, 3, 4}};
  if (parametric_volume({type}) == 0.5) return {{0, 1, 3, 4}, {2, 3, 1, 6}};  // Wedges.
  return {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6}, {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
}

/// The unit cube, divided into n³ cubes of cells of a kind, moved by `map`.
Grid divided(const CellKind& kind, int n, const Map& map) {
  auto grid = Grid::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  grid->SetPoints(points);
  const std::vector<Vector3d> at = parametric_points(kind);
  std::vector<Vector3d> corners = cube_corners();
  corners.emplace_back(0.5, 0.5, 0.5);
  const auto frame = [](const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    return (Matrix3d() << b - a, c - a, d - a).finished();
  };
  const bool is_simplex = parametric_volume(kind) < 0.6 && !is_pyramid(kind.type);  // A wedge begins as one.
  const std::size_t third = is_simplex || kind.type == VTK_VOXEL ? 2 : 3, fourth = is_simplex ? 3 : 4;
  for (int cube = 0; cube < n * n * n; ++cube)
    for (const std::vector<std::size_t>& cell : cells_in_cube(kind.type)) {
      const Matrix3d to_cube = frame(corners[cell[0]], corners[cell[1]], corners[cell[2]], corners[cell[3]]) *
                               frame(at[0], at[1], at[third], at[fourth]).inverse();
      vtkNew<vtkIdList> ids;
      for (const Vector3d& p : at) {
        const Vector3d in_cube =
            corners[cell[0]] + to_cube * (p - at[0]) + Vector3d(cube % n, cube / n % n, cube / n / n);
        const Vector3d rounded = (in_cube / n * 5040e6).array().round() / 5040e6;  // Neighbours have the same points.
        ids->InsertNextId(points->InsertNextPoint(map(rounded).data()));
      }
      grid->InsertNextCell(kind.type, ids);
    }
  return grid;
}

/// V − E + F: 2 for each ball, 0 for each ring.
int euler_characteristic(const TriangleMesh& mesh) {
  std::set<std::uint32_t> vertices;
  for (const auto& triangle : mesh.triangles) vertices.insert(triangle.begin(), triangle.end());
  return static_cast<int>(vertices.size()) - static_cast<int>(mesh.triangles.size()) / 2;
}

int order_of(const CellKind& kind) {
  if (is_higher_order(kind.type)) return kind.order;
  return points_of(kind) > 8 && kind.type != VTK_QUADRATIC_LINEAR_WEDGE ? 2 : 1;
}

std::vector<CellKind> kinds_that_fill_cubes() {
  std::vector<CellKind> kinds;
  for (const CellKind& kind : solid_cell_kinds())
    if (kind.type != VTK_PENTAGONAL_PRISM && kind.type != VTK_HEXAGONAL_PRISM && kind.type != VTK_CONVEX_POINT_SET &&
        kind.type != VTK_POLYHEDRON)
      kinds.push_back(kind);
  return kinds;
}

class BodySurfaceOf : public ::testing::TestWithParam<CellKind> {};
class BodySurfaceOfMany : public BodySurfaceOf {};

TEST_P(BodySurfaceOf, OneCellIsItsOwn) {
  const Affine3d map =
      Eigen::Translation3d(3, -2, 5) * (Matrix3d() << 1.1, 0.2, -0.1, 0.1, 0.9, 0.25, -0.3, 0.15, 1.3).finished();
  const BodySurface surface = surface_of(*one_cell(GetParam(), map), 1e-3);
  EXPECT_EQ(surface.open_edges, 0u);
  EXPECT_EQ(euler_characteristic(surface.mesh), 2);
  EXPECT_NEAR(surface.mesh.volume(), parametric_volume(GetParam()) * map.linear().determinant(), 1e-9);
}

TEST_P(BodySurfaceOfMany, HasTheVolumeAndAreaOfTheBody) {
  const int type = GetParam().type;
  const bool is_off = type >= VTK_BEZIER_CURVE && type <= VTK_BEZIER_PYRAMID && GetParam().order > 1;
  const auto check = [&](const std::string& name, const Map& map, double volume, double area, int euler) {
    SCOPED_TRACE(name);
    // Flat faces, and points that are not on the surface, need few cells; curved faces as many as the tolerance asks.
    const bool is_box = name == "box";
    const int n = is_box || is_off ? 2 : GetParam().order > 3 ? 4 : 6;
    const BodySurface surface = surface_of(*divided(GetParam(), n, map), 1e-3);
    EXPECT_EQ(surface.open_edges, 0u);
    EXPECT_EQ(surface.inner_faces, 0u);
    EXPECT_EQ(euler_characteristic(surface.mesh), euler);
    if (is_off && !is_box) return;
    const double error = is_box ? 1e-9 : order_of(GetParam()) == 1 ? 0.2 : 6e-3;
    EXPECT_NEAR(surface.mesh.volume(), volume, error * volume);
    EXPECT_NEAR(surface.area, area, error * area);
  };
  check("box", unchanged, 1, 6, 2);
  if (type == VTK_VOXEL) return;
  check("ball", to_ball, 4 * pi / 3, 4 * pi, 2);
  if (is_off || type == VTK_PYRAMID || type == VTK_QUADRATIC_PYRAMID) return;  // They fold.
  check("plate", to_plate, 3 * pi, 12 * pi, 0);
}

std::string kind_name(const ::testing::TestParamInfo<CellKind>& test) { return name_of(test.param); }

INSTANTIATE_TEST_SUITE_P(Types, BodySurfaceOf, ::testing::ValuesIn(solid_cell_kinds()), kind_name);
INSTANTIATE_TEST_SUITE_P(Types, BodySurfaceOfMany, ::testing::ValuesIn(kinds_that_fill_cubes()), kind_name);

TEST(BodySurface, CurvedCellsAreDividedAsTheToleranceSays) {
  const Grid ball = divided({VTK_LAGRANGE_HEXAHEDRON, 4}, 4, to_ball);
  std::size_t triangles = 0;
  for (const double tolerance : {1e-2, 2e-3, 5e-4}) {
    const BodySurface surface = surface_of(*ball, tolerance);
    for (std::size_t i = 0; i < surface.mesh.triangles.size(); ++i) {
      Vector3d centre = Vector3d::Zero();
      for (const std::uint32_t vertex : surface.mesh.triangles[i]) centre += surface.mesh.vertices[vertex] / 3;
      EXPECT_NEAR(centre.norm(), 1, 2 * tolerance);  // More inside triangles than along edges.
    }
    EXPECT_GT(surface.mesh.triangles.size(), 2 * triangles);
    triangles = surface.mesh.triangles.size();
  }
}

/// Cells of a grid that `is_used` chooses by their number, with its points.
Grid some_cells(vtkPointSet& mesh, const std::function<bool(vtkIdType)>& is_used) {
  auto grid = Grid::New();
  grid->SetPoints(mesh.GetPoints());
  for (vtkIdType i = 0; i < mesh.GetNumberOfCells(); ++i)
    if (is_used(i)) grid->InsertNextCell(mesh.GetCellType(i), mesh.GetCell(i)->GetPointIds());
  return grid;
}

TEST(BodySurface, InnerFacesAreCountedAndThoseWithOtherDiagonalsAreGone) {
  const auto beside = [](const Vector3d& p) { return Vector3d(1 + p.x(), 1 - p.y(), p.z()); };
  const auto check = [&](int first, int second, int n, std::size_t inner, std::size_t triangles) {
    SCOPED_TRACE(testing::Message() << first << " beside " << second << " " << n);
    const BodySurface surface =
        surface_of(*one_data_set({divided({first}, 2, unchanged), divided({second}, n, beside)}), 0.01);
    EXPECT_EQ(surface.inner_faces, inner);
    EXPECT_EQ(surface.mesh.triangles.size(), triangles);
    EXPECT_EQ(surface.open_edges, 0u);
    EXPECT_NEAR(surface.mesh.volume(), 2, 1e-12);
    EXPECT_NEAR(surface.area, 10, 1e-12);
  };
  check(VTK_HEXAHEDRON, VTK_HEXAHEDRON, 2, 0, 80);
  check(VTK_TETRA, VTK_TETRA, 2, 16, 80);
  check(VTK_QUADRATIC_TETRA, VTK_QUADRATIC_TETRA, 2, 16, 80);
  check(VTK_HEXAHEDRON, VTK_TETRA, 2, 12, 80);
  check(VTK_QUADRATIC_TETRA, VTK_HEXAHEDRON, 2, 12, 80);
  check(VTK_HEXAHEDRON, VTK_HEXAHEDRON, 3, 4 + 9, 48 + 108);
}

TEST(BodySurface, CellsOfAnySenseLookOutwards) {
  const Grid box = divided({VTK_HEXAHEDRON}, 3, unchanged);
  for (vtkIdType cell = 0; cell < 27; cell += 2) {
    vtkIdList* const ids = box->GetCell(cell)->GetPointIds();
    std::rotate(ids->begin(), ids->begin() + 4, ids->end());  // Mirrors it.
    box->GetCells()->ReplaceCellAtId(cell, ids);
  }
  const BodySurface surface = surface_of(*box, 0.01);
  EXPECT_EQ(surface.open_edges, 0u);
  EXPECT_NEAR(surface.mesh.volume(), 1, 1e-12);
}

TEST(BodySurface, TheBodyEndsWhereTheDataEnd) {
  struct Case {
    const char* name;
    std::function<void(vtkStructuredGrid&, vtkDataArray&, vtkDataArray&)> spoil;  // Tensors at points, cells.
    int missing, euler;
  };
  for (const Case& c : {Case{"all", [](auto&, auto&, auto&) {}, 0, 2},
                        Case{"corner", [](auto&, auto&points, auto&) { points.SetComponent(0, 3, NAN); }, 1, 2},
                        Case{"node", [](auto&, auto&points, auto&) { points.SetComponent(43, 3, NAN); }, 8, 2},
                        Case{"cell", [](auto&, auto&, auto&cells) { cells.SetComponent(31, 8, NAN); }, 1, 4},
                        Case{"blanked", [](auto&mesh, auto&, auto&) { mesh.BlankCell(31); }, 1, 4},
                        Case{"hidden", [](auto&mesh, auto&, auto&) { mesh.BlankPoint(43); }, 8, 2}}) {
    SCOPED_TRACE(c.name);
    const auto mesh = curvilinear({6, 6, 6}, unchanged);
    add_array<9>(*mesh, tensor_array, [](const Vector3d& p) { return flat(linear_tensor(p)); });
    add_cell_array<9>(*mesh, tensor_array, [](vtkIdType) { return flat(Matrix3d::Ones()); });
    c.spoil(*mesh, *mesh->GetPointData()->GetArray(tensor_array), *mesh->GetCellData()->GetArray(tensor_array));
    const BodySurface surface = surface_of(*mesh, 0.01);
    EXPECT_NEAR(surface.mesh.volume(), 1 - c.missing / 125.0, 1e-12);
    EXPECT_EQ(euler_characteristic(surface.mesh), c.euler);
    EXPECT_EQ(surface.open_edges, 0u);
  }
}

TEST(BodySurface, SlabsHaveTopBottomAndWallsAlsoInHoles) {
  const auto plane = curvilinear({5, 5, 1}, [](const Vector3d& p) { return Vector3d(4 * p.x(), 4 * p.y(), 7); });
  const Grid ring = some_cells(*plane, [](vtkIdType i) { return i != 5 && i != 6 && i != 9 && i != 10; });
  const BodySurface surface = surface_of(*slab_of(*ring, *flat_mesh(*ring), 0.5), 0.01);
  EXPECT_EQ(surface.open_edges, 0u);
  EXPECT_EQ(euler_characteristic(surface.mesh), 0);
  EXPECT_NEAR(surface.mesh.volume(), 6, 1e-12);
  EXPECT_NEAR(surface.area, 24 + 0.5 * (16 + 8), 1e-12);
  EXPECT_TRUE(surface.mesh.bounds().isApprox(Eigen::AlignedBox3d(Vector3d(0, 0, 6.75), Vector3d(4, 4, 7.25))));
}

TEST(BodySurface, ABoxCutsIt) {
  const BodySurface ball = surface_of(*divided({VTK_QUADRATIC_HEXAHEDRON}, 6, to_ball), 1e-3);
  const auto check = [&](double from_x, double volume, double tolerance) {
    const TriangleMesh cap = cut_to(ball.mesh, {Vector3d(from_x, -2, -2), Vector3d(2, 2, 2)});
    EXPECT_EQ(open_edges(cap), 0u) << from_x;
    EXPECT_NEAR(cap.volume(), volume, tolerance) << from_x;
  };
  check(0, ball.mesh.volume() / 2, 1e-9);
  check(0.5, pi * 0.25 * 2.5 / 3, 3e-3);
}

TEST(BodySurface, ImportGivesItToGridsOfMeshes) {
  const TemporaryFolder folder;
  struct Row {
    vtkSmartPointer<vtkDataSet> mesh;
    const char* file;
    double volume;  ///< 0: there is no surface.
    std::function<void(ImportSettings&)> set = [](ImportSettings&) {};
  };
  const auto crop = [](ImportSettings& s) {
    s.sampling.bounds = AlignedBox3d(Vector3d(1.5, 0, 0), Vector3d(9, 9, 0.5));
  };
  for (const Row& row : {Row{bar(0, 3), "a.vtu", 3},
                         {bar(0, 3), "a.vtu", 0.75, crop},
                         {bar(0, 3), "a.vtu", 0, [](ImportSettings& s) { s.surface = false; }},
                         {rectilinear(), "a.vtr", 4 * 1.5 * 8},
                         {structured(), "a.vts", 6 * 0.98},
                         {image(), "a.vti", 0},
                         {image(), "a.vti", 0, [](ImportSettings& s) { s.sampling.resolution = 9; }}}) {
    write_xml(*row.mesh, folder / row.file);
    ImportSettings settings;
    row.set(settings);
    const TriangleMesh surface = imported(folder / row.file, settings).grid.surface;
    EXPECT_EQ(surface.triangles.empty(), row.volume == 0);
    EXPECT_NEAR(surface.volume(), row.volume, 1e-12) << row.file;
  }
}

/// The cubes of edge 2 / n of the shell 1 <= max |x|, |y|, |z| <= 3, which has a cubical hole of edge 2.
Grid shell(int n) {
  const Grid cubes = unit_cube(VTK_HEXAHEDRON, 3 * n, [](const Vector3d& p) { return Vector3d(6 * p.array() - 3); });
  return some_cells(*cubes, [&](vtkIdType i) { return middle_of(*cubes->GetCell(i)).cwiseAbs().maxCoeff() > 1; });
}

TEST(MeshBoundary, AHoleIsAClosedSurfaceThatLooksOutOfTheBody) {
  const TemporaryFolder folder;
  EXPECT_EQ(write_boundary(*shell(2), folder / "a.ply"), 6u * 4u * 2u);
  TriangleMesh mesh = read_mesh(folder / "a.ply");
  EXPECT_EQ(mesh.vertices.size(), 26u);  // shared, although each cell has its own points
  EXPECT_EQ(mesh.triangles.size(), 48u);
  EXPECT_NEAR(mesh.volume(), 8, 1e-12);
  EXPECT_TRUE(mesh.bounds().isApprox(AlignedBox3d(Vector3d(-1, -1, -1), Vector3d(1, 1, 1))));
  EXPECT_NO_THROW(require_closed(mesh));
}

TEST(MeshBoundary, AConvexMeshHasNoneAndLeavesNoFile) {
  const TemporaryFolder folder;
  for (const int type : {VTK_HEXAHEDRON, VTK_WEDGE, VTK_PYRAMID, VTK_TETRA, VTK_QUADRATIC_TETRA})
    EXPECT_EQ(write_boundary(*unit_cube(type, 3, unchanged), folder / "a.ply"), 0u) << type;
  EXPECT_EQ(write_boundary(*unit_cube(VTK_HEXAHEDRON, 8, to_ball), folder / "a.ply"), 0u);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.ply"));
}

TEST(MeshBoundary, HiddenCellsBelongToTheBody) {
  const TemporaryFolder folder;
  const auto mesh = curvilinear({6, 6, 6}, unchanged);
  EXPECT_EQ(write_boundary(*mesh, folder / "a.ply"), 0u);
  mesh->BlankCell(62);  // the middle cell
  EXPECT_EQ(write_boundary(*mesh, folder / "a.ply"), 12u);
  EXPECT_NEAR(read_mesh(folder / "a.ply").volume(), 0.008, 1e-12);
}

TEST(MeshBoundary, RefusesFlatMeshesAndFoldersThatAreMissing) {
  const auto flat_mesh = curvilinear({3, 3, 1}, [](const Vector3d& p) { return Vector3d(p.x(), p.y(), 0); });
  EXPECT_THROW(write_boundary(*flat_mesh, Temporary("flat.ply")), std::invalid_argument);
  EXPECT_THAT([] { write_boundary(*shell(1), "/no/such/folder/body.ply"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("/no/such/folder/body.ply")));
}

}  // namespace
}  // namespace tensorray
