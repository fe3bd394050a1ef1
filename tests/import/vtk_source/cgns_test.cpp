// CGNS files, written with the CGNS library that VTK has.

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtk_cgns.h>
// clang-format off
#include VTK_CGNS(cgnslib.h)
// clang-format on

#include "tests/import/mesh_files.h"
#include "tests/import/vtk_files.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

constexpr std::array<cgsize_t, 3> points{3, 4, 5};

/// A number that tells positions, components and steps of time apart.
double velocity(const double* p, int component, int step) {
  return (component + 1) * p[0] + 10 * p[1] - (component + 2) * p[2] + 100 * step;
}

void check(int error) { ASSERT_EQ(error, CG_OK) << cg_get_error(); }

void write_zone(int file, int base, const std::string& name, double first_x, int steps) {
  const std::array<cgsize_t, 9> size{points[0], points[1], points[2], points[0] - 1, points[1] - 1, points[2] - 1};
  int zone = 0, id = 0, solution = 0;
  check(cg_zone_write(file, base, name.c_str(), size.data(), CGNS_ENUMV(Structured), &zone));
  /// The values at all points.
  const auto values_of = [&](const auto& value) {
    std::vector<double> values;
    for (cgsize_t i = 0; i < points[0] * points[1] * points[2]; ++i) {
      const double p[3] = {first_x + static_cast<double>(i % points[0]),
                           0.5 * static_cast<double>(i / points[0] % points[1]),
                           0.25 * static_cast<double>(i / points[0] / points[1])};
      values.push_back(value(p));
    }
    return values;
  };
  for (int axis = 0; axis < 3; ++axis)
    check(cg_coord_write(file, base, zone, CGNS_ENUMV(RealDouble), (std::string("Coordinate") + "XYZ"[axis]).c_str(),
                         values_of([axis](const double* p) { return p[axis]; }).data(), &id));
  std::string solutions;
  for (int step = 0; step < steps; ++step) {
    const std::string of_step = "Solution" + std::to_string(step);
    solutions += of_step + std::string(32 - of_step.size(), ' ');
    check(cg_sol_write(file, base, zone, of_step.c_str(), CGNS_ENUMV(Vertex), &solution));
    for (int c = 0; c < 3; ++c)
      check(cg_field_write(file, base, zone, solution, CGNS_ENUMV(RealDouble),
                           (std::string("Velocity") + "XYZ"[c]).c_str(),
                           values_of([=](const double* p) { return velocity(p, c, step); }).data(), &id));
  }
  if (steps == 1) return;
  const std::array<cgsize_t, 2> shape{32, steps};
  check(cg_ziter_write(file, base, zone, "ZoneIterativeData"));
  check(cg_goto(file, base, "Zone_t", zone, "ZoneIterativeData_t", 1, "end"));
  check(cg_array_write("FlowSolutionPointers", CGNS_ENUMV(Character), 2, shape.data(), solutions.data()));
}

/// Two zones that meet at x = 2.
void write_cgns(const std::filesystem::path& path, int type, int steps) {
  int file = 0, base = 0;
  check(cg_set_file_type(type));
  check(cg_open(path.c_str(), CG_MODE_WRITE, &file));
  check(cg_base_write(file, "Base", 3, 3, &base));
  if (steps > 1) {
    const std::vector<double> times{0.5, 1, 1.5};
    const cgsize_t count = steps;
    check(cg_biter_write(file, base, "BaseIterativeData", steps));
    check(cg_goto(file, base, "BaseIterativeData_t", 1, "end"));
    check(cg_array_write("TimeValues", CGNS_ENUMV(RealDouble), 1, &count, times.data()));
  }
  write_zone(file, base, "left", 0, steps);
  write_zone(file, base, "right", 2, steps);
  check(cg_close(file));
}

void expect_velocity(vtkDataSet& data, int step) {
  EXPECT_EQ(data.GetNumberOfPoints(), 5 * 4 * 5);  // The points where zones meet are merged.
  EXPECT_EQ(data.GetNumberOfCells(), 4 * 3 * 4);
  vtkDataArray* const read = data.GetPointData()->GetArray("Velocity");
  ASSERT_NE(read, nullptr);
  ASSERT_EQ(read->GetNumberOfComponents(), 3);
  for (vtkIdType i = 0; i < data.GetNumberOfPoints(); ++i)
    for (int component = 0; component < 3; ++component)
      EXPECT_EQ(read->GetComponent(i, component), velocity(data.GetPoint(i), component, step));
}

TEST(Cgns, ZonesAreOneMeshInBothFormats) {
  const TemporaryFolder folder;
  for (const int type : {CG_FILE_ADF, CG_FILE_HDF5}) {
    write_cgns(folder / "a.cgns", type, 1);
    EXPECT_EQ(time_steps(folder / "a.cgns"), 1);
    expect_velocity(*read_vtk_source(folder / "a.cgns"), 0);
    std::filesystem::remove(folder / "a.cgns");
  }
}

TEST(Cgns, HasStepsOfTime) {
  const TemporaryFolder folder;
  write_cgns(folder / "a.cgns", CG_FILE_HDF5, 3);
  EXPECT_EQ(time_steps(folder / "a.cgns"), 3);
  expect_velocity(*read_vtk_source(folder / "a.cgns", 0), 0);
  expect_velocity(*read_vtk_source(folder / "a.cgns", 1), 1);
  expect_velocity(*read_vtk_source(folder / "a.cgns"), 2);
  EXPECT_THROW(read_vtk_source(folder / "a.cgns", 3), std::invalid_argument);
}

TEST(Cgns, DamageIsOneLine) {
  const TemporaryFolder folder;
  write_bytes(folder / "none.cgns", "no CGNS");
  EXPECT_NE(read_error(folder / "none.cgns").find("none.cgns"), std::string::npos);
  write_cgns(folder / "a.cgns", CG_FILE_HDF5, 1);
  std::filesystem::resize_file(folder / "a.cgns", std::filesystem::file_size(folder / "a.cgns") / 2);
  EXPECT_NE(read_error(folder / "a.cgns").find("a.cgns"), std::string::npos);
}

}  // namespace
}  // namespace tensorray
