// What formats say of components: their names and their order.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkUnstructuredGrid.h>
#include <vtk_exodusII.h>
#include <zlib.h>

#include "base/process/progress.h"
#include "tests/import/mesh_files.h"
#include "tests/import/mesh_fixtures.h"
#include "tests/import/openfoam_case.h"
#include "tests/import/vtk_files.h"
#include "tools/import/import_file.h"
#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Imports a file whose tensor is the same everywhere. @return that tensor.
Matrix3d tensor_of_file(const std::filesystem::path& file, const std::string& array,
                        std::optional<TensorOrder> order = {}, Take take = Take::tensor) {
  ImportSettings settings;
  settings.files = {file};
  settings.array = array;
  settings.order = order;
  settings.take = take;
  ImportReport report;
  const TensorGrid grid = import_tensors(settings, Progress(), report);
  Matrix3d tensor = Matrix3d::Constant(-1);
  for_each_voxel(grid, [&](const Vector3d&, const Matrix3d& value) { tensor = value; });
  for_each_voxel(grid, [&](const Vector3d&, const Matrix3d& value) { EXPECT_LT((value - tensor).norm(), 1e-6); });
  return tensor;
}

void refuses(const std::filesystem::path& file, const std::string& array, std::optional<TensorOrder> order,
             const char* part, Take take = Take::tensor) {
  const auto import = [&] { tensor_of_file(file, array, order, take); };
  EXPECT_THAT(import, ThrowsMessage<std::invalid_argument>(HasSubstr(part))) << file;
}

Matrix3d expected() {
  Matrix3d tensor;
  tensor << 1, 0.2, 0.3, 0.2, 2, 0.4, 0.3, 0.4, 3;
  return tensor;
}

TEST(ComponentNames, UniformTensorsOfOpenFoamHaveItsOrder) {
  const TemporaryFolder folder;
  OpenFoamCase::write(folder);
  const std::string head =
      "FoamFile { version 2.0; format ascii; class CLASS; object NAME; } // xx xy xz yy yz zz\n"
      "dimensions [0 0 0 0 0 0 0];\n";
  const auto text = [&](const std::string& kind, const std::string& name, const std::string& rest) {
    std::string all = head + rest;
    all.replace(all.find("CLASS"), 5, kind);
    return all.replace(all.find("NAME"), 4, name);
  };
  const std::string patches = "boundaryField { walls { type calculated; value uniform (9 9 9 9 9 9); } }\n";
  write_bytes(folder / "0.5" / "plain", text("volSymmTensorField", "plain",
                                             "/* internalField uniform (7 7 7 7 7 7); */\n"
                                             "internalField   uniform (1 .2 .3 2 .4 3);\n" +
                                                 patches));
  std::string list = "internalField nonuniform List<symmTensor>\n8\n(\n";
  for (int i = 0; i < 8; ++i) list += "(1 .2 .3 2 .4 3)\n";
  write_bytes(folder / "0.5" / "list", text("volSymmTensorField", "list", list + ")\n;\n" + patches));
  const std::string packed =
      text("volSymmTensorField", "packed", "internalField uniform (1 .2 .3 2 .4 3);\n" + patches);
  const gzFile file = gzopen((folder / "0.5" / "packed.gz").c_str(), "wb");
  ASSERT_EQ(gzwrite(file, packed.data(), static_cast<unsigned>(packed.size())), static_cast<int>(packed.size()));
  gzclose(file);
  for (const char* name : {"plain", "list", "packed"})
    EXPECT_LT((tensor_of_file(folder, name) - expected()).norm(), 1e-6) << name;
}

/// The value of a uniform field may be a macro, or in another file.
TEST(ComponentNames, UniformTensorsOfOpenFoamMayBeElsewhere) {
  const TemporaryFolder folder;
  OpenFoamCase::write(folder);
  const auto write = [&](const std::string& name, const std::string& values) {
    write_bytes(folder / "0.5" / name,
                "FoamFile { version 2.0; format ascii; class volSymmTensorField; object " + name +
                    "; }\ndimensions [0 0 0 0 0 0 0];\n" + values +
                    "\nboundaryField { walls { type calculated; value uniform (9 9 9 9 9 9); } }\n");
  };
  std::string list = "nonuniform List<symmTensor> 8(";
  for (int i = 0; i < 8; ++i) list += "(" + std::to_string(i) + " .2 .3 2 .4 3) ";
  write("macro", "inner uniform (1 .2 .3 2 .4 3);\ninternalField $inner;");
  write("list", "inner " + list + ");\ninternalField $inner;");
  write("included", "#include \"values\"");
  write("included_list", "#include \"list_of_values\"");
  write_bytes(folder / "0.5" / "list_of_values", "internalField " + list + ");\n");
  write_bytes(folder / "0.5" / "values", "internalField uniform (1 .2 .3 2 .4 3);\n");
  for (const char* name : {"macro", "included"})
    EXPECT_LT((tensor_of_file(folder, name) - expected()).norm(), 1e-6) << name;
  const auto read = read_vtk_source(folder);
  for (const char* name : {"list", "included_list"}) {
    vtkDataArray* const varied = read->GetCellData()->GetArray(name);
    ASSERT_TRUE(varied);
    EXPECT_EQ(varied->GetComponent(5, 0), 5) << name;
    EXPECT_EQ(varied->GetComponent(5, 1), 2) << name;
    EXPECT_NEAR(varied->GetComponent(5, 3), 0.2, 1e-6) << name;
  }
}

/// A file as MOOSE writes it: names of element variables in alphabetical order, which VTK joins where it can.
void write_exodus(const std::filesystem::path& path, const std::vector<std::string>& names,
                  const std::vector<double>& values) {
  int word = 8, stored = 8;
  const int file = ex_create(path.c_str(), EX_CLOBBER, &word, &stored);
  ASSERT_GE(file, 0);
  ex_put_init(file, "stress", 3, 8, 1, 1, 0, 0);
  const double x[] = {0, 1, 1, 0, 0, 1, 1, 0}, y[] = {0, 0, 1, 1, 0, 0, 1, 1}, z[] = {0, 0, 0, 0, 1, 1, 1, 1};
  ex_put_coord(file, x, y, z);
  ex_put_block(file, EX_ELEM_BLOCK, 1, "HEX8", 1, 8, 0, 0, 0);
  const int corners[] = {1, 2, 3, 4, 5, 6, 7, 8};
  ex_put_conn(file, EX_ELEM_BLOCK, 1, corners, nullptr, nullptr);
  const int count = static_cast<int>(names.size());
  ex_put_variable_param(file, EX_ELEM_BLOCK, count);
  const double time = 0;
  ex_put_time(file, 1, &time);
  for (int i = 0; i < count; ++i) {
    ex_put_variable_name(file, EX_ELEM_BLOCK, i + 1, names[static_cast<std::size_t>(i)].c_str());
    ex_put_var(file, 1, EX_ELEM_BLOCK, i + 1, 1, 1, &values[static_cast<std::size_t>(i)]);
  }
  ex_close(file);
}

TEST(ComponentNames, VariablesOfExodusKeepTheirNames) {
  const TemporaryFolder folder;
  const std::filesystem::path six = folder / "six.e", nine = folder / "nine.e", order = folder / "order.e";
  write_exodus(six, {"stress_xx", "stress_xy", "stress_xz", "stress_yy", "stress_yz", "stress_zz"},
               {1, 0.2, 0.3, 2, 0.4, 3});
  EXPECT_LT((tensor_of_file(six, "stress_xx,stress_yy,stress_zz,stress_xy,stress_yz,stress_xz") - expected()).norm(),
            1e-6);
  EXPECT_LT((tensor_of_file(six, "stress_xx,stress_xy,stress_xz,stress_yy,stress_yz,stress_zz") - expected()).norm(),
            1e-6);
  write_exodus(nine,
               {"stress_xx", "stress_xy", "stress_xz", "stress_yx", "stress_yy", "stress_yz", "stress_zx", "stress_zy",
                "stress_zz"},
               {1, 2, 3, 4, 5, 6, 7, 8, 9});
  Matrix3d rows;
  rows << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  EXPECT_LT((tensor_of_file(nine, "stress_x, stress_y, stress_z") - rows).norm(), 1e-6);
  EXPECT_LT((tensor_of_file(
                 nine, "stress_xx,stress_xy,stress_xz,stress_yx,stress_yy,stress_yz,stress_zx,stress_zy,stress_zz") -
             rows)
                .norm(),
            1e-6);
  EXPECT_LT(
      (tensor_of_file(nine, "stress_x:0,stress_y:1,stress_z:2,stress_x:1,stress_y:2,stress_x:2", TensorOrder::vtk) -
       (Matrix3d() << 1, 2, 3, 2, 5, 6, 3, 6, 9).finished())
          .norm(),
      1e-6);
  EXPECT_LT((tensor_of_file(nine,
                            "stress_x:stress_xx,stress_y:stress_yy,stress_z:stress_zz,stress_x:stress_xy,stress_y:"
                            "stress_yz,stress_x:stress_xz") -
             (Matrix3d() << 1, 2, 3, 2, 5, 6, 3, 6, 9).finished())
                .norm(),
            1e-6);
  refuses(nine, "stress_x:3,stress_y,stress_z", {}, "no array \"stress_x:3\"");
}

/// The symmetric tensor `expected` in Voigt's order, at the points of a data set.
void add_voigt(vtkDataSet& set, bool named) {
  add_array<6>(set, "S",
               [](const Vector3d&) { return (Eigen::Matrix<double, 6, 1>() << 1, 2, 3, 0.4, 0.3, 0.2).finished(); });
  const char* const names[] = {"XX", "YY", "ZZ", "YZ", "XZ", "XY"};
  for (int i = 0; named && i < 6; ++i) set.GetPointData()->GetArray("S")->SetComponentName(i, names[i]);
}

TEST(ComponentNames, AllKindsOfFilesObeyThem) {
  const TemporaryFolder folder;
  for (const auto& [ending, set] : data_sets()) {
    const std::filesystem::path file = folder / ("a" + ending);
    add_voigt(*set, true);
    write_xml(*set, file);
    EXPECT_LT((tensor_of_file(file, "S") - expected()).norm(), 1e-6) << ending;
    EXPECT_LT((tensor_of_file(file, "S", TensorOrder::voigt) - expected()).norm(), 1e-6) << ending;
    refuses(file, "S", TensorOrder::vtk, "leave --order out");
    add_voigt(*set, false);
    write_xml(*set, file);
    refuses(file, "S", {}, "give it with --order");
    refuses(file, "tensor", TensorOrder::vtk, "leave --order out");
  }
}

TEST(ComponentNames, SymmetricTensorsOfVtkHaveItsOrder) {
  const TemporaryFolder folder;
  for (const auto& [ending, set] : data_sets()) {
    for (const char* name : {"first S", "second"})
      add_array<6>(*set, name, [](const Vector3d&) {
        return (Eigen::Matrix<double, 6, 1>() << 1, 2, 3, 0.2, 0.4, 0.3).finished();
      });
    set->GetPointData()->SetActiveTensors("second");
    write_xml(*set, folder / ("a" + ending));
    EXPECT_LT((tensor_of_file(folder / ("a" + ending), "second") - expected()).norm(), 1e-6) << ending;
    for (const bool binary : {false, true}) {
      write_legacy(*set, folder / "a.vtk", binary);
      EXPECT_NE(bytes_of(folder / "a.vtk").find("TENSORS6 second"), std::string::npos);
      EXPECT_LT((tensor_of_file(folder / "a.vtk", "second") - expected()).norm(), 1e-6) << ending;
      EXPECT_THROW(tensor_of_file(folder / "a.vtk", "second", TensorOrder::fsl), std::invalid_argument);
      EXPECT_THROW(tensor_of_file(folder / "a.vtk", "first S"), std::invalid_argument);  // It is a field's array.
    }
  }
}

TEST(ComponentNames, OfTwoTensors6BothTellTheirOrder) {
  const TemporaryFolder folder;
  std::string text =
      "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nORIGIN 0 0 0\n"
      "SPACING 1 1 1\nPOINT_DATA 8\n";
  for (const char* name : {"a", "b%20b"}) {
    text += std::string("TENSORS6 ") + name + " float\n";
    for (int i = 0; i < 8; ++i) text += "1 2 3 .2 .4 .3\n";
  }
  write_bytes(folder / "a.vtk", text);
  for (const char* name : {"a", "b b"})
    EXPECT_LT((tensor_of_file(folder / "a.vtk", name) - expected()).norm(), 1e-6) << name;
}

TEST(ComponentNames, ThreeScalarsAreAVector) {
  const TemporaryFolder folder;
  Matrix3d gradient;
  gradient << 1, 2, 3, -4, 5, 6, 7, -8, 10;
  for (const auto& [ending, set] : data_sets()) {
    const char* const names[] = {"X Velocity", "Y Velocity", "Z Velocity"};
    for (int i = 0; i < 3; ++i)
      add_array<1>(*set, names[i],
                   [&](const Vector3d& p) { return Eigen::Matrix<double, 1, 1>(gradient.row(i).dot(p)); });
    write_xml(*set, folder / ("a" + ending));
    const std::string list = "X Velocity,Y Velocity,Z Velocity";
    EXPECT_LT((tensor_of_file(folder / ("a" + ending), list, {}, Take::gradient) - gradient).norm(), 1e-4) << ending;
    EXPECT_LT(
        (tensor_of_file(folder / ("a" + ending), list, {}, Take::strain) - 0.5 * (gradient + gradient.transpose()))
            .norm(),
        1e-4)
        << ending;
    refuses(folder / ("a" + ending), "X Velocity,Y Velocity", {}, "--gradient-of lists 2 arrays, and a vector has 3",
            Take::gradient);
  }
}

/// The entries of a tensor that names tell, in orders that no program is known to use.
TEST(ComponentNames, TellAnyOrder) {
  const TemporaryFolder folder;
  Matrix3d rows;
  rows << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  const std::vector<std::string> six{"ZZ", "xy", "s_11", "YZ", "S22", "zx"};
  const std::vector<std::string> nine{"xx", "yy", "zz", "xy", "yz", "xz", "yx", "zy", "zx"};
  for (const auto& [ending, set] : data_sets()) {
    add_array<6>(*set, "six",
                 [](const Vector3d&) { return (Eigen::Matrix<double, 6, 1>() << 3, 0.2, 1, 0.4, 2, 0.3).finished(); });
    add_array<9>(*set, "nine", [](const Vector3d&) {
      return (Eigen::Matrix<double, 9, 1>() << 1, 5, 9, 2, 6, 3, 4, 8, 7).finished();
    });
    std::string list;
    for (int i = 0; i < 9; ++i) {
      const std::string& name = nine[static_cast<std::size_t>(i)];
      if (i < 6) set->GetPointData()->GetArray("six")->SetComponentName(i, six[static_cast<std::size_t>(i)].c_str());
      set->GetPointData()->GetArray("nine")->SetComponentName(i, name.c_str());
      add_array<1>(*set, "s" + name,
                   [&](const Vector3d&) { return Eigen::Matrix<double, 1, 1>(rows(name[0] - 'x', name[1] - 'x')); });
      list += (i == 0 ? "s" : ",s") + name;
    }
    const std::filesystem::path file = folder / ("a" + ending);
    write_xml(*set, file);
    EXPECT_LT((tensor_of_file(file, "six") - expected()).norm(), 1e-6) << ending;
    refuses(file, "six", TensorOrder::fsl, "leave --order out");
    EXPECT_LT((tensor_of_file(file, "nine") - rows).norm(), 1e-6) << ending;
    EXPECT_LT((tensor_of_file(file, list) - rows).norm(), 1e-6) << ending;
    EXPECT_LT(
        (tensor_of_file(file, "szz,syz,syy,sxz,sxy,sxx") - (Matrix3d() << 1, 2, 3, 2, 5, 6, 3, 6, 9).finished()).norm(),
        1e-6)
        << ending;
    refuses(file, "szz,syz,syy,sxz,sxy,sxx", TensorOrder::fsl, "leave --order out");
  }
}

TEST(ComponentNames, KeywordsOfLegacyFilesMayBeInSmallLetters) {
  const TemporaryFolder folder;
  std::string text =
      "# vtk DataFile Version 3.0\nTENSORS6 field\nASCII\ndataset STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nORIGIN 0 0 0\n"
      "SPACING 1 1 1\npoint_data 8\n";
  for (const char* name : {"a", "b"}) {
    text += std::string("tensors6 ") + name + " float\n";
    for (int i = 0; i < 8; ++i) text += "1 2 3 .2 .4 .3\n";
  }
  text += "FIELD FieldData 1\nfield 6 8 float\n";
  for (int i = 0; i < 8; ++i) text += "1 2 3 .2 .4 .3\n";
  text.replace(text.find("dataset"), 7, "DATASET");
  write_bytes(folder / "a.vtk", text);
  for (const char* name : {"a", "b"})
    EXPECT_LT((tensor_of_file(folder / "a.vtk", name) - expected()).norm(), 1e-6) << name;
  refuses(folder / "a.vtk", "field", {}, "give it with --order");  // The title is not a keyword.
}

}  // namespace
}  // namespace tensorray
