// Gradients of vectors at cells: exact for linear ones, at borders, at hanging nodes and between
// pieces, and of second order for a parabola at a wall.

#include "tools/import/meshes/cell_gradients.h"

#include <functional>
#include <utility>

#include <vtkUnsignedCharArray.h>

#include "tests/import/velocity_meshes.h"
#include "tests/import/vtk_files.h"
#include "tools/import/meshes/cell_graph.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;

/// At cells, and at points where some are hanging nodes.
TEST(CellGradients, LinearVelocitiesAreExactOnEveryMesh) {
  const TemporaryFolder folder;
  std::vector<std::pair<std::string, vtkSmartPointer<vtkDataSet>>> meshes;
  meshes.push_back({"graded.vtr", rectilinear_grid({0, 0.1, 0.3, 0.7, 1.5}, {0, 0.6, 0.9, 1}, {0, 0.5, 1})});
  meshes.push_back({"oblique.vts", curvilinear({5, 4, 3}, oblique)});
  for (const int type :
       {VTK_HEXAHEDRON, VTK_WEDGE, VTK_TETRA, VTK_PYRAMID, VTK_QUADRATIC_HEXAHEDRON, VTK_QUADRATIC_TETRA})
    meshes.push_back({"type" + std::to_string(type) + ".vtu", unit_cube(type, 3, oblique)});
  for (const char* name : {"refined.vtu", "refined_points.vtu"})
    meshes.push_back({name, joined(boxes(steps(0, 1, 2), steps(0, 1, 2), steps(0, 1, 2)),
                                   boxes(steps(1, 2, 4), steps(0, 1, 4), steps(0, 1, 4)))});
  meshes.push_back({"mismatched.vtu", joined(boxes({0, 0.5, 1}, steps(0, 1, 3), steps(0, 1, 3)),
                                             boxes(steps(1, 2, 4), steps(0, 1, 5), steps(0, 1, 4)))});
  meshes.push_back(
      {"layers.vtu", joined(boxes({0, 1}, {0, 1}, {0, 1}), boxes({1, 2}, steps(0, 1, 3), steps(0, 1, 3)))});
  meshes.push_back({"polyhedra.vtu", polyhedra()});
  meshes.push_back({"bent.vtu", unit_cube(VTK_TETRA, 4, bent)});
  for (const auto& [name, mesh] : meshes) {
    if (name == "refined_points.vtu")
      add_array<3>(*mesh, "U", linear);
    else
      add_velocity(*mesh, linear, name == "polyhedra.vtu" ? middle_of : mean_of);
    write_xml(*mesh, folder / name);
    expect_linear(gradients(folder / name, 0.13), name);
  }
}

/// The cells at x < 2, or those beyond, of 4 x 3 x 3 cells; with the next layer as copies if `with_ghosts`.
Grid half_of_channel(bool first, bool with_ghosts, const Velocity& velocity) {
  const double from = first ? 0 : with_ghosts ? 1.5 : 2, to = !first ? 4 : with_ghosts ? 2.5 : 2;
  const Grid grid = boxes(steps(from, to, static_cast<int>(2 * (to - from))), steps(0, 1, 3), steps(0, 1, 3));
  add_velocity(*grid, velocity);
  vtkNew<vtkUnsignedCharArray> ghosts;
  ghosts->SetName(vtkDataSetAttributes::GhostArrayName());
  for (vtkIdType i = 0; i < grid->GetNumberOfCells(); ++i)
    ghosts->InsertNextValue((middle_of(*grid->GetCell(i)).x() < 2) == first ? 0 : vtkDataSetAttributes::DUPLICATECELL);
  if (with_ghosts) grid->GetCellData()->AddArray(ghosts);
  return grid;
}

TEST(CellGradients, PiecesAreAsGoodAsOneMesh) {
  const TemporaryFolder folder;
  const auto bend = [](const Vector3d& p) { return Vector3d(std::sin(p.x() + p.y()), p.x() * p.z(), std::cos(p.z())); };
  const Grid whole = boxes(steps(0, 4, 8), steps(0, 1, 3), steps(0, 1, 3));
  add_velocity(*whole, bend);
  write_xml(*whole, folder / "whole.vtu");
  const TensorGrid expected = gradients(folder / "whole.vtu", 0.2);
  for (const bool with_ghosts : {false, true}) {
    for (const bool first : {true, false})
      write_xml(*half_of_channel(first, with_ghosts, bend), folder / (first ? "a.vtu" : "b.vtu"));
    write_bytes(folder / "all.pvtu",
                "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid><Piece Source=\"a.vtu\"/>"
                "<Piece Source=\"b.vtu\"/></PUnstructuredGrid></VTKFile>");
    write_bytes(folder / "all.vtm", blocks_of({"a.vtu", "b.vtu"}));
    for (const char* const name : {"all.pvtu", "all.vtm"}) expect_alike(gradients(folder / name, 0.2), expected, name);
  }
}

/// Flow between plates at y = 0 and 1: errors of ∂u/∂y within half a coarse cell of the plates, at the same places.
TEST(CellGradients, AParabolaIsOfSecondOrderAtAWallThatTheFileDoesNotKnow) {
  const TemporaryFolder folder;
  const auto error_of = [&](int n, const Velocity& velocity, const std::function<double(double)>& slope) {
    const Grid grid = boxes(steps(0, 1, 3), steps(0, 1, n), steps(0, 1, 3));
    add_velocity(*grid, velocity);
    write_xml(*grid, folder / "a.vtu");
    return error_in(gradients(folder / "a.vtu", 1.0 / 33), [&](const Vector3d& p) {
      return Matrix3d(slope(p.y()) * Vector3d::UnitX() * Vector3d::UnitY().transpose());
    });
  };
  const auto poiseuille = [](const Vector3d& p) { return Vector3d(p.y() * (1 - p.y()), 0, 0); };
  const auto smooth = [&](const Vector3d& p) { return Vector3d(std::sin(pi * p.y()), 0, 0); };
  for (const int n : {4, 8, 16}) {
    const double parabola = error_of(n, poiseuille, [](double y) { return 1 - 2 * y; });
    const double sine = error_of(n, smooth, [&](double y) { return pi * std::cos(pi * y); });
    const double finer = error_of(2 * n, smooth, [&](double y) { return pi * std::cos(pi * y); });
    EXPECT_LT(parabola, 4e-3 / n);  // What the rounds of the fit leave: exact but for their number.
    EXPECT_GT(sine / finer, 2.8);   // 2.8, 3.7, 3.9: second order.
  }
}

TEST(CellGradients, OneLayerOfCellsHasNoDerivativeAcross) {
  const TemporaryFolder folder;
  const Grid grid = boxes(steps(0, 1, 4), steps(0, 1, 4), {0, 1});
  add_velocity(*grid, linear);
  write_xml(*grid, folder / "a.vtu");
  Matrix3d expected = shear();
  expected.col(2).setZero();
  EXPECT_LT(error_in(gradients(folder / "a.vtu", 0.15), [&](const Vector3d&) { return expected; }), 2e-5);
}

TEST(CellGradients, ABaffleHasAWallOnEachSide) {
  const Grid grid = boxes(steps(0, 1, 2), steps(0, 1, 4), steps(0, 1, 2));
  add_velocity(*grid, [](const Vector3d& p) { return Vector3d(p.y() < 0.5 ? 1 - 2 * p.y() : 0, p.z(), p.x()); });
  std::vector<Wall> walls;
  for (const double side : {-1, 1})
    for (const double x : {0.25, 0.75})
      for (const double z : {0.25, 0.75}) walls.push_back({{x, 0.5, z}, {0, side, 0}, Wall::Kind::value, {0, z, x}});
  add_walls(*grid, "U", walls);
  const CellGradients gradients = cell_gradients(*grid, *grid->GetCellData()->GetArray("U"));
  for (vtkIdType id = 0; id < grid->GetNumberOfCells(); ++id)
    EXPECT_NEAR(gradients.of_cells->GetComponent(id, 1), middle_of(*grid->GetCell(id)).y() < 0.5 ? -2 : 0, 1e-12);
}

/// Cells 300 times as long as thick, whose neighbours along the layer are below its tangent plane.
TEST(CellGradients, ThinLayersMayBeCurved) {
  constexpr double around = 32;
  const auto grid = curvilinear({9, 9, 4}, [](const Vector3d& p) {
    const double angle = 16 * pi / around * p.x(), r = 1 + 0.01 * p.y() * p.y();
    return Vector3d(r * std::cos(angle), r * std::sin(angle), p.z());
  });
  add_velocity(*grid, [&](const Vector3d& p) {
    const double r = p.head<2>().norm();
    return Vector3d(Vector3d(-p.y(), p.x(), 0) / r * 100 * (r - std::cos(pi / around)));
  });
  const CellGradients gradients = cell_gradients(*grid, *grid->GetCellData()->GetArray("U"));
  for (vtkIdType i = 0; i < grid->GetNumberOfPoints(); ++i) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> t(gradients.of_points->GetPointer(9 * i));
    const Vector3d p(grid->GetPoint(i)), normal = Vector3d(p.x(), p.y(), 0).normalized();
    EXPECT_NEAR(Vector3d(-normal.y(), normal.x(), 0).dot(t * normal), 100, 5);  // 1 with twice the cells around.
  }
}

}  // namespace
}  // namespace tensorray
