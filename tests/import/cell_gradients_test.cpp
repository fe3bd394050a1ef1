// Gradients of vectors at cells: exact for linear ones in every format, at borders, at hanging nodes and between
// pieces, and of second order for a parabola at a wall.

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkExodusIIWriter.h>
#include <vtkUnsignedCharArray.h>
#include <vtk_cgns.h>
// clang-format off
#include VTK_CGNS(cgnslib.h)
// clang-format on

#include "base/process/progress.h"
#include "tests/import/mesh_files.h"
#include "tests/import/mesh_fixtures.h"
#include "tests/import/vtk_files.h"
#include "tools/import/import_file.h"
#include "tools/import/meshes/cell_gradients.h"
#include "tools/import/meshes/cell_graph.h"
#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;
using Velocity = std::function<Vector3d(const Vector3d&)>;

Matrix3d shear() { return (Matrix3d() << 1, 2, 3, -4, 5, 6, 7, -8, 10).finished(); }

Vector3d linear(const Vector3d& p) { return shear() * p + Vector3d(0.3, -0.1, 0.2); }

const Map straight = [](const Vector3d& p) { return p; };
const Map oblique = [](const Vector3d& p) {
  return Vector3d(2 * p.x() + 0.3 * p.y(), p.y() - 0.2 * p.z(), 0.5 * p.z());
};

/// The mean of the corners: the centroid of a parallelepiped, a simplex or a prism.
Vector3d mean_of(vtkCell& cell) {
  Vector3d sum = Vector3d::Zero();
  const auto count = static_cast<int>(cell.GetNumberOfPoints());
  for (int i = 0; i < count; ++i) sum += Vector3d(cell.GetPoints()->GetPoint(i)) / count;
  if (cell.GetCellType() != VTK_PYRAMID) return sum;
  return 1.25 * 0.75 * sum + (0.25 - 0.1875) * Vector3d(cell.GetPoints()->GetPoint(4));
}

void add_velocity(vtkDataSet& mesh, const Velocity& velocity,
                  const std::function<Vector3d(vtkCell&)>& centre = mean_of) {
  vtkNew<vtkDoubleArray> array;
  array->SetName("U");
  array->SetNumberOfComponents(3);
  for (vtkIdType i = 0; i < mesh.GetNumberOfCells(); ++i)
    array->InsertNextTuple(velocity(centre(*mesh.GetCell(i))).data());
  mesh.GetCellData()->AddArray(array);
}

TensorGrid gradients(const std::filesystem::path& file, double voxel, Take take = Take::gradient) {
  ImportSettings settings;
  settings.files = {file};
  settings.array = "U";
  settings.take = take;
  settings.sampling.resolution = voxel;
  ImportReport report;
  return import_tensors(settings, Progress(), report);
}

/// The greatest difference from `expected` at all voxels.
double error_in(const TensorGrid& grid, const std::function<Matrix3d(const Vector3d&)>& expected) {
  double worst = 0;
  std::size_t voxels = 0;
  for_each_voxel(grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    ++voxels;
    worst = std::max(worst, (tensor - expected(p)).cwiseAbs().maxCoeff());
  });
  EXPECT_GT(voxels, 20U);
  return worst;
}

const auto expect_linear = [](const TensorGrid& grid, const std::string& name) {
  EXPECT_LT(error_in(grid, [](const Vector3d&) { return shear(); }), 2e-5) << name;
};

/// A grid of boxes with these coordinates along each axis, whose faces may also be divided.
Grid boxes(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z) {
  auto grid = Grid::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const double c : z)
    for (const double b : y)
      for (const double a : x) points->InsertNextPoint(a, b, c);
  grid->SetPoints(points);
  const auto nx = static_cast<vtkIdType>(x.size()), ny = static_cast<vtkIdType>(y.size());
  for (vtkIdType k = 0; k + 1 < static_cast<vtkIdType>(z.size()); ++k)
    for (vtkIdType j = 0; j + 1 < ny; ++j)
      for (vtkIdType i = 0; i + 1 < nx; ++i) {
        const auto p = [&](vtkIdType a, vtkIdType b, vtkIdType c) { return i + a + nx * (j + b + ny * (k + c)); };
        const vtkIdType ids[] = {p(0, 0, 0), p(1, 0, 0), p(1, 1, 0), p(0, 1, 0),
                                 p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)};
        grid->InsertNextCell(VTK_HEXAHEDRON, 8, ids);
      }
  return grid;
}

std::vector<double> steps(double from, double to, int count) {
  std::vector<double> values;
  for (int i = 0; i <= count; ++i) values.push_back(from + (to - from) * i / count);
  return values;
}

/// Both grids, with points at equal positions once.
Grid joined(const Grid& a, const Grid& b) { return Grid(vtkUnstructuredGrid::SafeDownCast(one_data_set({a, b}))); }

/// A coarse cube beside eight small ones: its face at x = 1 is four faces of a polyhedron.
Grid polyhedra() {
  const Grid grid = joined(boxes({1, 1.5, 2}, {0, 0.5, 1}, {0, 0.5, 1}), boxes({0, 1}, {0, 1}, {0, 1}));
  auto result = Grid::New();
  result->SetPoints(grid->GetPoints());
  const auto p = [&](double x, double y, double z) { return grid->FindPoint(x, y, z); };
  std::vector<vtkIdType> faces;
  int count = 0;
  const auto face = [&](std::vector<vtkIdType> ids) {
    faces.push_back(static_cast<vtkIdType>(ids.size()));
    faces.insert(faces.end(), ids.begin(), ids.end());
    ++count;
  };
  for (const double y : {0.0, 0.5})
    for (const double z : {0.0, 0.5}) face({p(1, y, z), p(1, y + 0.5, z), p(1, y + 0.5, z + 0.5), p(1, y, z + 0.5)});
  face({p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0)});
  for (const double s : {0.0, 1.0}) {
    face({p(0, s, 0), p(1, s, 0), p(1, s, 0.5), p(1, s, 1), p(0, s, 1)});
    face({p(0, 0, s), p(1, 0, s), p(1, 0.5, s), p(1, 1, s), p(0, 1, s)});
  }
  result->InsertNextCell(VTK_POLYHEDRON, count, faces.data());
  for (vtkIdType i = 0; i < 8; ++i)
    result->InsertNextCell(VTK_HEXAHEDRON, 8, grid->GetCell(i)->GetPointIds()->GetPointer(0));
  return result;
}

Vector3d middle_of(vtkCell& cell) {
  const double* const b = cell.GetBounds();
  return 0.5 * Vector3d(b[0] + b[1], b[2] + b[3], b[4] + b[5]);
}

TEST(CellGradients, LinearVelocitiesAreExactOnEveryMesh) {
  const TemporaryFolder folder;
  std::vector<std::pair<std::string, vtkSmartPointer<vtkDataSet>>> meshes;
  auto rectilinear = vtkSmartPointer<vtkRectilinearGrid>::New();
  vtkNew<vtkDoubleArray> x, y, z;
  for (const double value : {0.0, 0.1, 0.3, 0.7, 1.5}) x->InsertNextValue(value);
  for (const double value : {0.0, 0.6, 0.9, 1.0}) y->InsertNextValue(value);
  for (const double value : {0.0, 0.5, 1.0}) z->InsertNextValue(value);
  rectilinear->SetDimensions(5, 4, 3);
  rectilinear->SetXCoordinates(x);
  rectilinear->SetYCoordinates(y);
  rectilinear->SetZCoordinates(z);
  meshes.push_back({"graded.vtr", rectilinear});
  meshes.push_back({"oblique.vts", curvilinear({5, 4, 3}, oblique)});
  for (const int type :
       {VTK_HEXAHEDRON, VTK_WEDGE, VTK_TETRA, VTK_PYRAMID, VTK_QUADRATIC_HEXAHEDRON, VTK_QUADRATIC_TETRA})
    meshes.push_back({"type" + std::to_string(type) + ".vtu", unit_cube(type, 3, oblique)});
  meshes.push_back({"refined.vtu", joined(boxes(steps(0, 1, 2), steps(0, 1, 2), steps(0, 1, 2)),
                                          boxes(steps(1, 2, 4), steps(0, 1, 4), steps(0, 1, 4)))});
  meshes.push_back({"mismatched.vtu", joined(boxes({0, 0.5, 1}, steps(0, 1, 3), steps(0, 1, 3)),
                                             boxes(steps(1, 2, 4), steps(0, 1, 5), steps(0, 1, 4)))});
  meshes.push_back(
      {"layers.vtu", joined(boxes({0, 1}, {0, 1}, {0, 1}), boxes({1, 2}, steps(0, 1, 3), steps(0, 1, 3)))});
  meshes.push_back({"polyhedra.vtu", polyhedra()});
  meshes.push_back({"bent.vtu", unit_cube(VTK_TETRA, 4, bent)});
  for (const auto& [name, mesh] : meshes) {
    add_velocity(*mesh, linear, name == "polyhedra.vtu" ? middle_of : mean_of);
    write_xml(*mesh, folder / name);
    expect_linear(gradients(folder / name, 0.13), name);
  }
}

/// The cells at x < 2, or those beyond, of 4 x 3 x 3 cells; with the next layer as copies if `with_ghosts`.
Grid half_of_channel(bool first, bool with_ghosts) {
  const double from = first ? 0 : with_ghosts ? 1.5 : 2, to = !first ? 4 : with_ghosts ? 2.5 : 2;
  const Grid grid = boxes(steps(from, to, static_cast<int>(2 * (to - from))), steps(0, 1, 3), steps(0, 1, 3));
  add_velocity(*grid, linear);
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
  std::map<std::array<double, 3>, Matrix3d> expected;
  for_each_voxel(gradients(folder / "whole.vtu", 0.2), [&](const Vector3d& p, const Matrix3d& t) {
    expected[{p.x(), p.y(), p.z()}] = t;
  });
  for (const bool with_ghosts : {false, true}) {
    for (const bool first : {true, false}) {
      const Grid half = half_of_channel(first, with_ghosts);
      add_velocity(*half, bend);
      write_xml(*half, folder / (first ? "a.vtu" : "b.vtu"));
    }
    write_bytes(folder / "all.pvtu",
                "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid><Piece Source=\"a.vtu\"/>"
                "<Piece Source=\"b.vtu\"/></PUnstructuredGrid></VTKFile>");
    write_bytes(folder / "all.vtm",
                "<VTKFile type=\"vtkMultiBlockDataSet\"><vtkMultiBlockDataSet><DataSet index=\"0\" "
                "file=\"a.vtu\"/><DataSet index=\"1\" file=\"b.vtu\"/>"
                "</vtkMultiBlockDataSet></VTKFile>");
    for (const char* const name : {"all.pvtu", "all.vtm"})
      EXPECT_LT(error_in(gradients(folder / name, 0.2),
                         [&](const Vector3d& p) {
                           return expected.at({p.x(), p.y(), p.z()});
                         }),
                1e-6)
          << name << with_ghosts;
  }
}

std::string numbers_of(vtkDataArray& array) {
  std::string text;
  for (vtkIdType i = 0; i < array.GetNumberOfTuples(); ++i)
    for (int c = 0; c < 3; ++c) text += fmt::format("{:.17g} ", array.GetComponent(i, c));
  return text;
}

void write_xdmf(vtkUnstructuredGrid& grid, const std::filesystem::path& path) {
  const auto count = grid.GetNumberOfCells();
  std::string cells;
  for (vtkIdType i = 0; i < count; ++i)
    for (int k = 0; k < 8; ++k) cells += std::to_string(grid.GetCell(i)->GetPointId(k)) + " ";
  write_bytes(path, fmt::format(R"(<?xml version="1.0"?><Xdmf Version="3.0"><Domain><Grid Name="a">
<Topology TopologyType="Hexahedron" NumberOfElements="{0}"><DataItem Dimensions="{0} 8" NumberType="Int" Format="XML">{1}
</DataItem></Topology><Geometry GeometryType="XYZ"><DataItem Dimensions="{2} 3" Format="XML">{3}</DataItem></Geometry>
<Attribute Name="U" AttributeType="Vector" Center="Cell"><DataItem Dimensions="{0} 3" Format="XML">{4}</DataItem>
</Attribute></Grid></Domain></Xdmf>)",
                                count, cells, grid.GetNumberOfPoints(), numbers_of(*grid.GetPoints()->GetData()),
                                numbers_of(*grid.GetCellData()->GetArray("U"))));
}

/// A grid of 4 x 4 x 4 boxes, whose points and cells have the order of CGNS.
void write_cgns(vtkUnstructuredGrid& grid, const std::filesystem::path& path) {
  int file = 0, base = 0, zone = 0, id = 0, solution = 0;
  const std::array<cgsize_t, 9> size{5, 5, 5, 4, 4, 4};
  cg_open(path.c_str(), CG_MODE_WRITE, &file);
  cg_base_write(file, "Base", 3, 3, &base);
  cg_zone_write(file, base, "Zone", size.data(), CGNS_ENUMV(Structured), &zone);
  cg_sol_write(file, base, zone, "Solution", CGNS_ENUMV(CellCenter), &solution);
  const auto column = [](vtkDataArray& array, int c) {
    std::vector<double> values;
    for (vtkIdType i = 0; i < array.GetNumberOfTuples(); ++i) values.push_back(array.GetComponent(i, c));
    return values;
  };
  for (int c = 0; c < 3; ++c) {
    cg_coord_write(file, base, zone, CGNS_ENUMV(RealDouble), (std::string("Coordinate") + "XYZ"[c]).c_str(),
                   column(*grid.GetPoints()->GetData(), c).data(), &id);
    cg_field_write(file, base, zone, solution, CGNS_ENUMV(RealDouble), (std::string("U") + "XYZ"[c]).c_str(),
                   column(*grid.GetCellData()->GetArray("U"), c).data(), &id);
  }
  ASSERT_EQ(cg_close(file), CG_OK);
}

/// Gold, in ASCII: numbers have six digits.
void write_ensight(vtkUnstructuredGrid& grid, const std::filesystem::path& folder) {
  const auto components = [](vtkDataArray& array) {
    std::string text;
    for (int c = 0; c < 3; ++c)
      for (vtkIdType i = 0; i < array.GetNumberOfTuples(); ++i)
        text += fmt::format("{:12.5e}\n", array.GetComponent(i, c));
    return text;
  };
  std::string geometry = fmt::format(
      "one\ntwo\nnode id assign\nelement id assign\npart\n{:10}\nbody\ncoordinates\n{:10}\n{}hexa8\n{:10}\n", 1,
      grid.GetNumberOfPoints(), components(*grid.GetPoints()->GetData()), grid.GetNumberOfCells());
  for (vtkIdType i = 0; i < grid.GetNumberOfCells(); ++i, geometry += "\n")
    for (int k = 0; k < 8; ++k) geometry += fmt::format("{:10}", grid.GetCell(i)->GetPointId(k) + 1);
  write_bytes(folder / "a.geo", geometry);
  write_bytes(folder / "a.U",
              fmt::format("a variable\npart\n{:10}\nhexa8\n{}", 1, components(*grid.GetCellData()->GetArray("U"))));
  write_bytes(folder / "a.case",
              "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: a.geo\nVARIABLE\n"
              "vector per element: U a.U\n");
}

TEST(CellGradients, FormatsWithCellsAreAlike) {
  const TemporaryFolder folder;
  const Grid grid = boxes(steps(0, 2, 4), steps(0, 1, 4), steps(0, 1, 4));
  add_velocity(*grid, linear);
  write_legacy(*grid, folder / "a.vtk", true);
  write_xdmf(*grid, folder / "a.xdmf");
  write_cgns(*grid, folder / "a.cgns");
  vtkNew<vtkExodusIIWriter> exodus;
  exodus->SetFileName((folder / "a.ex2").c_str());
  exodus->SetInputData(grid);
  exodus->Write();
  write_ensight(*grid, folder);
  for (const char* const name : {"a.vtk", "a.xdmf", "a.cgns", "a.ex2", "a.case"}) {
    expect_linear(gradients(folder / name, 0.15), name);
    EXPECT_LT(error_in(gradients(folder / name, 0.15, Take::strain),
                       [](const Vector3d&) { return Matrix3d(0.5 * (shear() + shear().transpose())); }),
              2e-5);
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
      Matrix3d expected = Matrix3d::Zero();
      expected(0, 1) = slope(p.y());
      return expected;
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

TEST(CellGradients, VelocitiesAtPointsAreExactAtHangingNodes) {
  const TemporaryFolder folder;
  const Grid grid = joined(boxes(steps(0, 1, 2), steps(0, 1, 2), steps(0, 1, 2)),
                           boxes(steps(1, 2, 4), steps(0, 1, 4), steps(0, 1, 4)));
  add_array<3>(*grid, "U", linear);
  write_xml(*grid, folder / "a.vtu");
  expect_linear(gradients(folder / "a.vtu", 0.13), "points");
}

std::string foam_file(const std::string& kind, const std::string& object, const std::vector<std::string>& rows) {
  std::string text = "FoamFile\n{ version 2.0; format ascii; class " + kind + "; object " + object + "; }\n";
  if (rows.empty()) return text;
  text += std::to_string(rows.size()) + "\n(\n";
  for (const std::string& row : rows) text += row + "\n";
  return text + ")\n";
}

std::string foam_row(const Vector3d& v) { return fmt::format("({:.17g} {:.17g} {:.17g})", v.x(), v.y(), v.z()); }

/// What a case says of U at its patches, by their names.
using Patches = std::map<std::string, std::string>;

/// A case of OpenFOAM with the cells and the array U of `grid`. @param patch_of  The patch of a face at a place.
void write_foam(const std::filesystem::path& folder, vtkUnstructuredGrid& grid, const Patches& patches,
                const std::function<std::string(const Vector3d&)>& patch_of) {
  struct Side {
    vtkIdType owner = 0, neighbour = -1;
    std::string row, patch;
  };
  std::map<std::vector<vtkIdType>, Side> sides;
  for (vtkIdType id = 0; id < grid.GetNumberOfCells(); ++id)
    for (int i = 0; i < grid.GetCell(id)->GetNumberOfFaces(); ++i) {
      vtkCell& face = *grid.GetCell(id)->GetFace(i);
      const auto count = static_cast<int>(face.GetNumberOfPoints());
      Eigen::Matrix3Xd corners(3, count);
      std::vector<vtkIdType> ids, key;
      for (int k = 0; k < count; ++k) {
        ids.push_back(face.GetPointId(k));
        corners.col(k) = Vector3d(face.GetPoints()->GetPoint(k));
      }
      const FaceMeasure measure = face_measure(corners);
      if (measure.area.dot(measure.centre - middle_of(*grid.GetCell(id))) < 0) std::reverse(ids.begin(), ids.end());
      key = ids;
      std::sort(key.begin(), key.end());
      const auto [side, is_new] =
          sides.try_emplace(key, Side{id, -1, std::to_string(count) + "(", patch_of(measure.centre)});
      if (!is_new) side->second.neighbour = id;
      for (const vtkIdType k : ids) side->second.row += is_new ? std::to_string(k) + " " : "";
      side->second.row += is_new ? ")" : "";
    }
  std::vector<std::pair<std::tuple<bool, std::string, vtkIdType, vtkIdType>, Side>> order;
  for (const auto& [key, side] : sides) {
    const bool outer = side.neighbour < 0;
    order.push_back({{outer, outer ? side.patch : "", side.owner, side.neighbour}, side});
  }
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> points, faces, owner, neighbour, boundary;
  for (vtkIdType i = 0; i < grid.GetNumberOfPoints(); ++i) points.push_back(foam_row(Vector3d(grid.GetPoint(i))));
  std::map<std::string, std::pair<std::size_t, std::size_t>> ranges;
  for (const auto& [key, side] : order) {
    auto& [start, count] = ranges.try_emplace(side.neighbour < 0 ? side.patch : "", faces.size(), 0).first->second;
    ++count;
    faces.push_back(side.row);
    owner.push_back(std::to_string(side.owner));
    if (side.neighbour >= 0) neighbour.push_back(std::to_string(side.neighbour));
  }
  std::string entries;
  for (const auto& [patch, range] : ranges) {
    if (patch.empty()) continue;
    const bool is_processor = patch.rfind("procBoundary", 0) == 0;
    boundary.push_back(fmt::format("{} {{ type {}; nFaces {}; startFace {}; }}", patch,
                                   is_processor ? "processor" : "patch", range.second, range.first));
    if (!patches.at(patch).empty()) entries += patch + "\n{\n" + patches.at(patch) + "\n}\n";
  }
  const std::filesystem::path mesh = folder / "constant" / "polyMesh";
  write_bytes(mesh / "points", foam_file("vectorField", "points", points));
  write_bytes(mesh / "faces", foam_file("faceList", "faces", faces));
  write_bytes(mesh / "owner", foam_file("labelList", "owner", owner));
  write_bytes(mesh / "neighbour", foam_file("labelList", "neighbour", neighbour));
  write_bytes(mesh / "boundary", foam_file("polyBoundaryMesh", "boundary", boundary));
  write_bytes(folder / "system" / "controlDict",
              foam_file("dictionary", "controlDict", {}) +
                  "application none; startFrom startTime; startTime 0; stopAt endTime;"
                  "endTime 1; deltaT 1; writeControl timeStep; writeInterval 1;\n");
  std::vector<std::string> values;
  for (vtkIdType i = 0; i < grid.GetNumberOfCells(); ++i)
    values.push_back(foam_row(Vector3d(grid.GetCellData()->GetArray("U")->GetTuple3(i))));
  const std::string list = foam_file("volVectorField", "U", values), head = foam_file("volVectorField", "U", {});
  write_bytes(folder / "1" / "U", head + "dimensions [0 1 -1 0 0 0 0];\ninternalField nonuniform List<vector>\n" +
                                      list.substr(head.size()) + ";\nboundaryField\n{\n" + entries + "}\n");
}

std::string side_of_channel(const Vector3d& p) {
  return p.y() < 1e-9 ? "bottom" : p.y() > 1 - 1e-9 ? "top" : p.z() < 1e-9 || p.z() > 1 - 1e-9 ? "sides" : "ends";
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

TEST(CellGradients, PatchesOfOpenFoamAreWalls) {
  struct Row {
    const char* name;
    std::string bottom, top, ends;
    Velocity velocity;
    std::function<Matrix3d(const Vector3d&)> expected;
    std::vector<double> y;
    double tolerance = 1e-5;  ///< Of parabolas, what the rounds of the fit leave on a graded mesh.
  };
  const std::string none = "type empty;", still = "type noSlip;", open = "type zeroGradient;";
  const std::string moving = "type movingWallVelocity;\nvalue uniform (1 0 0);", symmetric = "type symmetryPlane;";
  const std::string list = "type fixedValue;\nvalue nonuniform List<vector> 4((1 0 0) (1 0 0) (1 0 0) (1 0 0));";
  const auto only = [](int i, int j, const std::function<double(double)>& value) {
    return [=](const Vector3d& p) {
      Matrix3d result = Matrix3d::Zero();
      result(i, j) = value(p.y());
      return result;
    };
  };
  const auto one = only(0, 1, [](double) { return 1; });
  const auto couette = [](const Vector3d& p) { return Vector3d(p.y(), 0, 0); };
  const auto poiseuille = [](const Vector3d& p) { return Vector3d(p.y() * (1 - p.y()), 0, 0); };
  const auto stretch = [](const Vector3d& p) { return Vector3d(2 * p.x(), 0, 0); };
  const std::vector<double> graded{0, 0.1, 0.3, 0.6, 1};
  const std::vector<Row> rows{
      {"moving wall", still, moving, open, couette, one, graded},
      {"one cell between walls", still, list, open, couette, one, {0, 1}},
      {"one cell without walls", none, none, open, couette, only(0, 1, [](double) { return 0; }), {0, 1}},
      {"poiseuille", still, still, open, poiseuille, only(0, 1, [](double y) { return 1 - 2 * y; }), graded, 1e-3},
      {"half of it", still, open, open, [](const Vector3d& p) { return Vector3d(p.y() * (2 - p.y()), 0, 0); },
       only(0, 1, [](double y) { return 2 - 2 * y; }), graded, 1e-3},
      {"symmetry", symmetric, "type slip;", none, stretch, only(0, 0, [](double) { return 2; }), graded},
      {"no entry", "", "", open, couette, one, graded}};
  for (const Row& row : rows) {
    const TemporaryFolder folder;
    const Grid grid = boxes(steps(0, 2, 4), row.y, {0, 1});
    add_velocity(*grid, row.velocity);
    write_foam(folder, *grid, {{"bottom", row.bottom}, {"top", row.top}, {"sides", none}, {"ends", row.ends}},
               side_of_channel);
    const std::string text = bytes_of(folder / "1" / "U");
    EXPECT_LT(error_in(gradients(folder, 0.1), row.expected), row.tolerance) << row.name;
    if (row.bottom.empty()) continue;
    write_bytes(folder / "1" / "U", std::string(text).replace(text.find("bottom\n"), 6, "\"(bot|x)tom\""));
    EXPECT_LT(error_in(gradients(folder, 0.1), row.expected), row.tolerance) << row.name << ", as an expression";
  }
}

TEST(CellGradients, PolyhedraOfOpenFoamAreWhole) {
  const TemporaryFolder folder;
  const Grid grid = polyhedra();
  add_velocity(*grid, linear, middle_of);
  write_foam(folder, *grid, {{"all", "type calculated;"}}, [](const Vector3d&) { return "all"; });
  expect_linear(gradients(folder, 0.13), "polyhedra");
}

TEST(CellGradients, ProcessorsAreAsGoodAsOneCase) {
  const TemporaryFolder folder;
  const auto parabola = [](const Vector3d& p) { return Vector3d(p.y() * (1 - p.y()) + 0.1 * p.x() * p.x(), 0, 0); };
  const Patches patches{{"bottom", "type calculated;"},
                        {"top", "type calculated;"},
                        {"sides", "type slip;"},
                        {"ends", "type calculated;"},
                        {"procBoundary", "type processor;\nvalue uniform (9 9 9);"}};
  const auto write = [&](const std::filesystem::path& path, double from, double to) {
    const Grid grid = boxes(steps(from, to, static_cast<int>(2 * (to - from))), steps(0, 1, 4), steps(0, 1, 3));
    add_velocity(*grid, parabola);
    write_foam(path, *grid, patches,
               [&](const Vector3d& p) { return p.x() == 2 && to - from < 4 ? "procBoundary" : side_of_channel(p); });
  };
  write(folder / "whole", 0, 4);
  write(folder / "parts" / "processor0", 0, 2);
  write(folder / "parts" / "processor1", 2, 4);
  std::filesystem::rename(folder / "parts" / "processor0" / "system", folder / "parts" / "system");
  std::map<std::array<double, 3>, Matrix3d> expected;
  const TensorGrid whole = gradients(folder / "whole", 0.2);
  for_each_voxel(whole, [&](const Vector3d& p, const Matrix3d& t) { expected[{p.x(), p.y(), p.z()}] = t; });
  EXPECT_LT(error_in(gradients(folder / "parts", 0.2),
                     [&](const Vector3d& p) {
                       return expected.at({p.x(), p.y(), p.z()});
                     }),
            1e-6);
  EXPECT_LT(error_in(whole,
                     [&](const Vector3d& p) {
                       Matrix3d slope = Matrix3d::Zero();
                       slope.row(0) << 0.2 * p.x(), 1 - 2 * p.y(), 0;
                       return slope;
                     }),
            1e-3);
}

}  // namespace
}  // namespace tensorray
