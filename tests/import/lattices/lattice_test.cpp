#include "tools/import/lattices/lattice.h"

#include <map>

#include "tests/import/imported.h"
#include "tests/import/openfoam_case.h"
#include "tests/import/voxel_support.h"
#include "tests/import/vtk_files.h"
#include "tools/import/lattices/tensor_order.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

using Components = std::function<std::vector<double>(const Vector3i&)>;
using namespace mesh_fixtures;

/// A lattice of `components(index)`. Expects that slices are read from the last to the first, once each.
Lattice made_lattice(const Vector3i& size, const Components& components) {
  Lattice lattice;
  lattice.size = size;
  lattice.components = static_cast<int>(components(Vector3i::Zero()).size());
  lattice.read_slice = [=, next = size.z() - 1](int z, double* values) mutable {
    EXPECT_EQ(z, next--);
    for (int i = 0; i < size.x() * size.y(); ++i)
      for (const double c : components({i % size.x(), i / size.x(), z})) *values++ = c;
  };
  return lattice;
}

std::vector<double> full(const Matrix3d& tensor) {
  const auto components = flat(tensor);
  return {components.data(), components.data() + 9};
}

Matrix3d tensor_at(const Vector3i& index) {
  return test::general_tensor() + Vector3d(1, 100, 10000).dot(index.cast<double>()) * Matrix3d::Ones();
}

/// Blocks are ordered, and only those with active voxels are there: those for which `is_there` holds.
void expect_tensors_of(const TensorGrid& grid, const std::function<bool(const Vector3i& block)>& is_there) {
  for (std::size_t i = 0; i < grid.blocks.size(); ++i) {
    const Vector3i origin = grid.blocks[i].origin;
    EXPECT_TRUE(is_there(origin / 8) && grid.blocks[i].active.any());
    if (i == 0) continue;
    const Vector3i before = grid.blocks[i - 1].origin;
    EXPECT_TRUE(std::lexicographical_compare(before.begin(), before.end(), origin.begin(), origin.end()));
  }
  for_each_active(
      grid, [](const Vector3i& index, const Matrix3f& tensor) { EXPECT_EQ(tensor, tensor_at(index).cast<float>()); });
}

TEST(Lattice, EveryVoxelKeepsItsTensorAndPlace) {
  Lattice lattice = made_lattice({11, 17, 9}, [](const Vector3i& index) { return full(tensor_at(index)); });
  lattice.to_world.translate(Vector3d(3, 4, 5)).scale(0.5);
  LatticeReport report;
  const TensorGrid grid = tensors_of(lattice, {}, report);
  EXPECT_EQ(report.voxels, 11u * 17 * 9);
  EXPECT_EQ(report.active, report.voxels);
  EXPECT_EQ(grid.active_voxels(), report.voxels);
  EXPECT_EQ(grid.to_world.matrix(), lattice.to_world.matrix());
  EXPECT_EQ(grid.blocks.size(), 2u * 3 * 2);
  expect_tensors_of(grid, [](const Vector3i&) { return true; });
  const auto some = [](const Vector3i& block) { return (block.x() * 7 + block.y() * 3 + block.z()) % 4 == 1; };
  lattice = made_lattice(
      {40, 33, 29}, [&](const Vector3i& index) { return full(some(index / 8) ? tensor_at(index) : Matrix3d::Zero()); });
  lattice.zero_is_background = true;
  const TensorGrid part = tensors_of(lattice, {}, report);
  EXPECT_EQ(report.active + report.background, report.voxels);
  EXPECT_EQ(part.active_voxels(), report.active);
  expect_tensors_of(part, some);
}

TEST(Lattice, SymmetricTensorsStaySymmetricWhenTurned) {
  Lattice lattice = made_lattice({16, 8, 8}, [](const Vector3i& i) -> std::vector<double> {
    return {std::sin(i.x() + 0.1), std::sin(i.y() + 0.2), 0.3 * i.z(), std::cos(i.x() * 1.0), 1.0 * i.y(), 0.7};
  });
  lattice.frame = test::rotation();
  for_each_active(test::tensors_of(lattice, TensorOrder::voigt),
                  [](const Vector3i&, const Matrix3f& tensor) { EXPECT_EQ(tensor, tensor.transpose()); });
}

TEST(Lattice, MaskedZeroAndNonFiniteVoxelsAreInactive) {
  const std::vector<std::vector<double>> voxels = {
      {1, 1, 2, 3, 4, 5, 6},          // 0: active
      {0, 1, 2, 3, 4, 5, 6},          // 1: masked
      {0.5, 0, 0, 0, 0, 0, 7},        // 2: active
      {1, 0, 0, 0, 0, 0, 0},          // 3: zero
      {1, 1, NAN, 3, 4, 5, 6},        // 4: not finite
      {1, 1, 2, 3, 4, -INFINITY, 6},  // 5: not finite
      {0.49, NAN, 2, 3, 4, 5, 6},     // 6: masked, whatever the other components are
      {NAN, 1, 2, 3, 4, 5, 6},        // 7: masked, because the mask is NaN
      {1, 1e300, 0, 0, 0, 0, 0},      // 8: beyond single precision
  };
  Lattice lattice = made_lattice({9, 1, 1}, [&](const Vector3i& index) { return voxels[index.x()]; });
  lattice.masked = lattice.zero_is_background = true;
  LatticeReport report;
  const TensorGrid grid = tensors_of(lattice, TensorOrder::fsl, report);
  EXPECT_EQ(report.voxels, 9u);
  EXPECT_EQ(report.active, 2u);
  EXPECT_EQ(report.background, 4u);
  EXPECT_EQ(report.non_finite, 3u);
  test::expect_near(test::symmetric({1, 2, 3, 4, 5, 6}), find(grid, {0, 0, 0}));
  EXPECT_NE(find(grid, {2, 0, 0}), nullptr);
  EXPECT_EQ(grid.blocks.front().values[TensorBlock::offset(1, 0, 0)], Matrix3f::Zero());
}

TEST(Lattice, OfMoreThanNineComponentsTheFirstSixAreTheTensor) {
  const Lattice lattice = made_lattice(
      {1, 1, 1}, [](const Vector3i&) { return std::vector<double>{11, 22, 33, 12, 23, 13, 99, NAN, 99, 99}; });
  const TensorGrid grid = test::tensors_of(lattice, TensorOrder::vtk);
  test::expect_near(test::symmetric({11, 12, 13, 22, 23, 33}), find(grid, {0, 0, 0}));
}

TEST(Lattice, WrongNumbersOfComponentsAndAMissingOrderAreErrors) {
  const auto components = [](std::size_t count) {
    Lattice lattice = made_lattice({1, 1, 1}, [=](const Vector3i&) { return std::vector<double>(count, 1); });
    lattice.array = "stress";
    return lattice;
  };
  LatticeReport report;
  const auto tensors = [&](std::size_t count) { return [=] { test::tensors_of(components(count)); }; };
  EXPECT_THAT(tensors(6),
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("\"stress\""), HasSubstr("--order vtk|fsl|mrtrix|voigt"), Not(HasSubstr("\n")))));
  test::expect_error(tensors(10), {"--order"});
  test::expect_error(tensors(3), {"--gradient-of", "vector"});
  test::expect_error(tensors(1), {"1 component and", "another array"});
  test::expect_error(tensors(8), {"8 components", "another array"});
  test::expect_error([&] { gradient_of(components(6), report); }, {"gradient", "\"stress\"", "has 6"});
  EXPECT_NO_THROW(tensors(9)());
}

TEST(Lattice, GradientOfALinearVectorFieldIsItsMatrixInWorldAxes) {
  const Affine3d to_world = Eigen::Translation3d(3, 4, 5) * test::rotation() * Eigen::Scaling(0.5, 2.0, 0.25);
  const Matrix3d gradient = test::general_tensor(), frame = test::rotation().transpose();
  Lattice lattice = made_lattice({13, 10, 9}, [&](const Vector3i& index) -> std::vector<double> {
    const Vector3d v = frame.transpose() * (gradient * (to_world * index.cast<double>()));
    return {v.x(), v.y(), v.z()};
  });
  lattice.to_world = to_world;
  lattice.frame = frame;
  LatticeReport report;
  const TensorGrid grid = gradient_of(lattice, report);
  EXPECT_EQ(report.active, 13u * 10 * 9);
  EXPECT_EQ(grid.active_voxels(), report.active);
  EXPECT_EQ(grid.to_world.matrix(), to_world.matrix());
  for_each_active(grid, [&](const Vector3i&, const Matrix3f& tensor) { test::expect_near(gradient, &tensor, 1e-5); });
}

TEST(Lattice, GradientLeavesOutInactiveVoxels) {
  const Lattice lattice = made_lattice({9, 9, 9}, [](const Vector3i& index) -> std::vector<double> {
    if (index == Vector3i(4, 4, 4)) return {NAN, 0, 0};
    return {2.0 * index.x(), 0, 0};
  });
  LatticeReport report;
  const TensorGrid grid = gradient_of(lattice, report);
  EXPECT_EQ(report.non_finite, 1u);
  EXPECT_EQ(find(grid, {4, 4, 4}), nullptr);
  test::expect_near(Vector3d(2, 0, 0).asDiagonal(), find(grid, {3, 4, 4}));
}

TEST(TensorOrder, EachOrderPutsComponentsInTheirPlaces) {
  const Matrix3d symmetric = test::symmetric({11, 12, 13, 22, 23, 33});
  struct Row {
    TensorOrder order;
    std::vector<double> components;
    Matrix3d tensor;
  };
  for (const Row& row :
       {Row{TensorOrder::vtk, {11, 22, 33, 12, 23, 13}, symmetric},
        {TensorOrder::fsl, {11, 12, 13, 22, 23, 33}, symmetric},
        {TensorOrder::mrtrix, {11, 22, 33, 12, 13, 23}, symmetric},
        {TensorOrder::voigt, {11, 22, 33, 23, 13, 12}, symmetric},
        {TensorOrder::lower_triangle, {11, 12, 22, 13, 23, 33}, symmetric},
        {TensorOrder::full,
         {11, 12, 13, 21, 22, 23, 31, 32, 33},
         (Matrix3d() << 11, 12, 13, 21, 22, 23, 31, 32, 33).finished()},
        {TensorOrder::plane, {11, 22, 33, 12}, test::symmetric({11, 12, 0, 22, 0, 33})},
        {TensorOrder::two_by_two, {11, 12, 21, 22}, (Matrix3d() << 11, 12, 0, 21, 22, 0, 0, 0, 0).finished()}})
    EXPECT_EQ(tensor_of(row.components.data(), row.order), row.tensor) << testing::PrintToString(row.components);
}

// What formats say of components: their names and their order.
/// Imports a file whose tensor is the same everywhere. @return that tensor.
Matrix3d tensor_of_file(const std::filesystem::path& file, const std::string& array,
                        std::optional<TensorOrder> order = {}, Take take = Take::tensor) {
  ImportSettings settings = array_settings(array, take);
  settings.order = order;
  return imported(file, settings).tensor(1e-6);
}

void refuses(const std::filesystem::path& file, const std::string& array, std::optional<TensorOrder> order,
             const char* part, Take take = Take::tensor) {
  const auto import = [&] { tensor_of_file(file, array, order, take); };
  EXPECT_THAT(import, ThrowsMessage<std::invalid_argument>(HasSubstr(part))) << file;
}

Matrix3d expected() { return test::symmetric({1, 0.2, 0.3, 2, 0.4, 3}); }

/// Expects the tensor `expected`, unless another is given.
void expect_tensor(const std::filesystem::path& file, const std::string& array, const Matrix3d& tensor = expected()) {
  EXPECT_LT((tensor_of_file(file, array) - tensor).norm(), 1e-6) << file << array;
}

/// The value of a uniform field may be a macro, or in another file.
TEST(ComponentNames, UniformTensorsOfOpenFoamHaveItsOrder) {
  const TemporaryFolder folder;
  OpenFoamCase::write(folder);
  const auto text = [](const std::string& name, const std::string& values) {
    return "FoamFile { version 2.0; format ascii; class volSymmTensorField; object " + name +
           "; } // xx xy xz yy yz zz\ndimensions [0 0 0 0 0 0 0];\n/* internalField uniform (7 7 7 7 7 7); */\n" +
           values + "\nboundaryField { walls { type calculated; value uniform (9 9 9 9 9 9); } }\n";
  };
  const std::filesystem::path time = folder / "0.5";
  const std::string uniform = "uniform (1 .2 .3 2 .4 3);\n";
  const std::string same = OpenFoamCase::list(std::vector<std::string>(8, "(1 .2 .3 2 .4 3)"));
  std::string list = "nonuniform List<symmTensor> 8(";
  for (int i = 0; i < 8; ++i) list += "(" + std::to_string(i) + " .2 .3 2 .4 3) ";
  const std::map<std::string, std::string> fields{
      {"plain", "internalField   " + uniform},
      {"list", "internalField nonuniform List<symmTensor>\n" + same + ";\n"},
      {"macro", "inner " + uniform + "internalField $inner;"},
      {"included", "#include \"values\""},
      {"macro_list", "inner " + list + ");\ninternalField $inner;"},
      {"included_list", "#include \"list_of_values\""}};
  for (const auto& [name, values] : fields) write_bytes(time / name, text(name, values));
  write_bytes(time / "values", "internalField " + uniform);
  write_bytes(time / "list_of_values", "internalField " + list + ");\n");
  write_bytes(time / "packed.gz", test::gzipped(text("packed", "internalField " + uniform)));
  for (const char* name : {"plain", "list", "packed", "macro", "included"}) expect_tensor(folder, name);
  const auto read = read_vtk_source(folder);
  for (const char* name : {"macro_list", "included_list"}) {
    vtkDataArray* const varied = read->GetCellData()->GetArray(name);
    ASSERT_TRUE(varied);
    EXPECT_EQ(varied->GetComponent(5, 0), 5) << name;
    EXPECT_EQ(varied->GetComponent(5, 1), 2) << name;
    EXPECT_NEAR(varied->GetComponent(5, 3), 0.2, 1e-6) << name;
  }
}

TEST(ComponentNames, SymmetricTensorsOfVtkHaveItsOrder) {
  const TemporaryFolder folder;
  const auto set = bar(0, 3);
  for (const char* name : {"first S", "second"})
    add_array<6>(*set, name,
                 [](const Vector3d&) { return (Eigen::Matrix<double, 6, 1>() << 1, 2, 3, 0.2, 0.4, 0.3).finished(); });
  set->GetPointData()->SetActiveTensors("second");
  write_xml(*set, folder / "a.vtu");
  expect_tensor(folder / "a.vtu", "second");
  for (const bool binary : {false, true}) {
    write_legacy(*set, folder / "a.vtk", binary);
    EXPECT_NE(bytes_of(folder / "a.vtk").find("TENSORS6 second"), std::string::npos);
    expect_tensor(folder / "a.vtk", "second");
    EXPECT_THROW(tensor_of_file(folder / "a.vtk", "second", TensorOrder::fsl), std::invalid_argument);
    EXPECT_THROW(tensor_of_file(folder / "a.vtk", "first S"), std::invalid_argument);  // It is a field's array.
  }
}

/// A title may be any words, also a keyword.
TEST(ComponentNames, OfTwoTensors6BothTellTheirOrder) {
  const TemporaryFolder folder;
  for (const std::string keyword : {"TENSORS6 ", "tensors6 "}) {
    std::string text =
        "# vtk DataFile Version 3.0\nTENSORS6 field\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nORIGIN 0 0 "
        "0\nSPACING 1 1 1\nPOINT_DATA 8\n";
    std::string numbers;
    for (int i = 0; i < 8; ++i) numbers += "1 2 3 .2 .4 .3\n";
    for (const std::string name : {"a", "b%20b"}) text += keyword + name + " float\n" + numbers;
    write_bytes(folder / "a.vtk", text + "FIELD FieldData 1\nfield 6 8 float\n" + numbers);
    for (const char* name : {"a", "b b"}) expect_tensor(folder / "a.vtk", name);
    refuses(folder / "a.vtk", "field", {}, "give it with --order");
  }
}

TEST(ComponentNames, ThreeScalarsAreAVector) {
  const TemporaryFolder folder;
  const Matrix3d gradient = (Matrix3d() << 1, 2, 3, -4, 5, 6, 7, -8, 10).finished();
  const auto set = bar(0, 3);
  const std::string list = "X Velocity,Y Velocity,Z Velocity";
  for (int i = 0; i < 3; ++i)
    add_array<1>(*set, std::string(1, "XYZ"[i]) + " Velocity",
                 [&](const Vector3d& p) { return Eigen::Matrix<double, 1, 1>(gradient.row(i).dot(p)); });
  write_xml(*set, folder / "a.vtu");
  EXPECT_LT((tensor_of_file(folder / "a.vtu", list, {}, Take::gradient) - gradient).norm(), 1e-4);
  EXPECT_LT((tensor_of_file(folder / "a.vtu", list, {}, Take::strain) - 0.5 * (gradient + gradient.transpose())).norm(),
            1e-4);
  const Matrix3d stress = (Matrix3d() << -26.0 / 3, -2, 10, -2, -2.0 / 3, -2, 10, -2, 28.0 / 3).finished();
  EXPECT_LT((tensor_of_file(folder / "a.vtu", list, {}, Take::viscous_stress) - stress).norm(), 1e-4);
  refuses(folder / "a.vtu", "X Velocity,Y Velocity", {}, "--gradient-of lists 2 arrays, and a vector has 3",
          Take::gradient);
}

/// The entries of a tensor that names tell, in orders that no program is known to use.
TEST(ComponentNames, TellAnyOrder) {
  const TemporaryFolder folder;
  const Matrix3d rows = (Matrix3d() << 1, 2, 3, 4, 5, 6, 7, 8, 9).finished();
  const std::vector<std::string> six{"ZZ", "xy", "s_11", "YZ", "S22", "zx"};
  const std::vector<std::string> nine{"xx", "yy", "zz", "xy", "yz", "xz", "yx", "zy", "zx"};
  const auto set = bar(0, 3);
  add_array<6>(*set, "six",
               [](const Vector3d&) { return (Eigen::Matrix<double, 6, 1>() << 3, 0.2, 1, 0.4, 2, 0.3).finished(); });
  add_array<9>(*set, "nine",
               [](const Vector3d&) { return (Eigen::Matrix<double, 9, 1>() << 1, 5, 9, 2, 6, 3, 4, 8, 7).finished(); });
  std::string list;
  for (int i = 0; i < 9; ++i) {
    const std::string& name = nine[static_cast<std::size_t>(i)];
    if (i < 6) set->GetPointData()->GetArray("six")->SetComponentName(i, six[static_cast<std::size_t>(i)].c_str());
    set->GetPointData()->GetArray("nine")->SetComponentName(i, name.c_str());
    add_array<1>(*set, "s" + name,
                 [&](const Vector3d&) { return Eigen::Matrix<double, 1, 1>(rows(name[0] - 'x', name[1] - 'x')); });
    list += (i == 0 ? "s" : ",s") + name;
  }
  const std::filesystem::path file = folder / "a.vtu";
  write_xml(*set, file);
  expect_tensor(file, "six");
  refuses(file, "six", TensorOrder::fsl, "leave --order out");
  expect_tensor(file, "nine", rows);
  expect_tensor(file, list, rows);
  expect_tensor(file, "szz,syz,syy,sxz,sxy,sxx", test::symmetric({1, 2, 3, 5, 6, 9}));
  refuses(file, "szz,syz,syy,sxz,sxy,sxx", TensorOrder::fsl, "leave --order out");
}

}  // namespace
}  // namespace tensorray
