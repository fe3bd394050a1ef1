// Datasets whose numbers are elsewhere, or were never written: HDF5 itself reads zeros.

#include "tools/import/hdf5/hdf5_file.h"

#include <functional>

#include <fmt/format.h>

#include "base/text/byte_order.h"
#include "tests/import/hdf5_writer.h"
#include "tests/import/vtk_files.h"

namespace tensorray {
namespace {

using Ints = std::vector<int>;
using Doubles = std::vector<double>;
using Strings = std::vector<std::string>;
namespace fs = std::filesystem;

constexpr hsize_t count = 6;

/// Makes a dataset of six doubles, for which `set` has set the properties. @return whether it was made.
bool make(const std::filesystem::path& path, const std::string& name, const std::function<void(hid_t)>& set,
          const std::vector<double>& first = {}) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), space = H5Screate_simple(1, &count, nullptr),
              properties = H5Pcreate(H5P_DATASET_CREATE);
  set(properties);
  const hid_t data = H5Dcreate2(file, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, properties, H5P_DEFAULT);
  const hsize_t zero = 0, some = first.size();
  if (some > 0) {
    const hid_t memory = H5Screate_simple(1, &some, nullptr);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, &zero, nullptr, &some, nullptr);
    EXPECT_GE(H5Dwrite(data, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, first.data()), 0);
    H5Sclose(memory);
  }
  H5Dclose(data);
  H5Pclose(properties);
  H5Sclose(space);
  H5Fclose(file);
  return data >= 0;
}

/// Sets chunks of so many numbers.
std::function<void(hid_t)> chunks_of(hsize_t size) {
  return [size](hid_t properties) { H5Pset_chunk(properties, 1, &size); };
}

TEST(Hdf5File, NumbersThatAreElsewhereOrNowhere) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.h5";
  const Doubles numbers{1, 2, 3, 4, 5, 6};
  { Hdf5Writer(folder / "source.h5").write("/there", {count}, numbers); }
  { Hdf5Writer(folder / "source.h5.unwritten").announce("/there", {count}); }
  write_bytes(folder / "raw.bin", std::string(reinterpret_cast<const char*>(numbers.data()), 8 * count));
  write_bytes(folder / "cut.bin", "12345678");
  {
    Hdf5Writer file(path);
    file.write("/own", {count}, numbers);
    file.write("/zeros", {count}, Doubles(count, 0));
    file.announce("/announced", {count});
  }
  const auto virtual_of = [](const char* file, const char* source) {
    return [file, source](hid_t properties) {
      const hid_t space = H5Screate_simple(1, &count, nullptr);
      H5Pset_virtual(properties, space, file, source, space);
      H5Sclose(space);
    };
  };
  const auto external = [](const char* file) {
    return [file](hid_t properties) { H5Pset_external(properties, file, 0, 8 * count); };
  };
  struct Row {
    const char* name;
    std::function<void(hid_t)> set;
    const char* error;  ///< Empty: the numbers are read.
  };
  const Row table[] = {
      {"/own", nullptr, ""},
      {"/zeros", nullptr, ""},
      {"/announced", nullptr, "a.h5: its dataset /announced was announced, and not written"},
      {"/v", virtual_of("source.h5", "/there"), ""},
      {"/v_own", virtual_of(".", "/own"), ""},
      {"/v_of_v", virtual_of(".", "/v"), ""},
      {"/v_file", virtual_of("gone.h5", "/there"),
       "its dataset /v_file is virtual, and its source is the file gone.h5"},
      {"/v_of_v_file", virtual_of(".", "/v_file"), "gone.h5, which is missing"},
      {"/v_data", virtual_of("source.h5", "/gone"), "source.h5, which has no dataset /gone"},
      {"/v_unwritten", virtual_of("source.h5.unwritten", "/there"), "dataset /there was announced, and not written"},
      {"/v_itself", virtual_of(".", "/v_itself"), "refers to itself"},
      {"/e", external("raw.bin"), ""},
      {"/e_gone", external("gone.bin"), "its dataset /e_gone are in the file gone.bin, which is missing"},
      {"/e_cut", external("cut.bin"), "cut.bin, which is missing or cut off"},
      {"/chunks", chunks_of(3), "/chunks was announced, and not written"}};
  for (const Row& row : table) {
    EXPECT_TRUE(!row.set || make(path, row.name, row.set)) << row.name;
    const std::string error = error_of([&] {
      const auto read = Hdf5File(path).read(row.name);
      for (vtkIdType i = 0; i < read->GetNumberOfTuples(); ++i)
        EXPECT_EQ(read->GetComponent(i, 0), row.name == std::string("/zeros") ? 0 : 1 + i) << row.name;
    });
    EXPECT_THAT(error, HasSubstr(row.error)) << row.name;
    EXPECT_EQ(error.empty(), row.error[0] == '\0') << error;
  }
}

/// Of a part, as of a step, its own chunks count: also zeros that were written.
TEST(Hdf5File, PartsThatWereNotWritten) {
  const TemporaryFolder folder;
  { Hdf5Writer file(folder / "a.h5"); }
  ASSERT_TRUE(make(folder / "a.h5", "/x", chunks_of(2), {0, 0, 0}));
  const Hdf5File file(folder / "a.h5");
  const auto error = [&](std::uint64_t start, std::uint64_t size) {
    return error_of([&] { file.read("/x", {{start}, {1}, {size}}); });
  };
  for (const std::uint64_t start : {0, 1, 2, 3}) EXPECT_EQ(error(start, 2), "") << start;
  for (const std::uint64_t start : {4, 5})
    EXPECT_THAT(error(start, 6 - start), HasSubstr("/x was announced, and not written")) << start;
  EXPECT_EQ(error(0, 6), "");
}

TEST(Hdf5File, LinksToOtherFiles) {
  const TemporaryFolder folder;
  { Hdf5Writer(folder / "source.h5").write("/there/x", {1}, Doubles{7}); }
  { Hdf5Writer file(folder / "a.h5"); }
  const hid_t id = H5Fopen((folder / "a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Lcreate_external("source.h5", "/there", id, "/good", H5P_DEFAULT, H5P_DEFAULT);
  H5Lcreate_external("gone.h5", "/there", id, "/group", H5P_DEFAULT, H5P_DEFAULT);
  H5Lcreate_external("gone.h5", "/there/x", id, "/x", H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(id);
  const Hdf5File file(folder / "a.h5");
  EXPECT_EQ(file.read("/good/x")->GetComponent(0, 0), 7);
  for (const char* name : {"/group/x", "/x"})
    EXPECT_THAT(error_of([&] { file.read(name); }), HasSubstr("in the file gone.h5, which is missing")) << name;
  EXPECT_THAT(error_of([&] { file.read("/none"); }), HasSubstr("has no dataset /none"));
}

// VTKHDF files, written dataset by dataset as the format prescribes.
/// 0, 1, ... end − 1.
Doubles counting(int end) {
  Doubles values;
  for (int i = 0; i < end; ++i) values.push_back(i);
  return values;
}

/// Two parts, a tetrahedron each, with a common face; and, if wanted, two steps of the values, on the same mesh.
void write_grid(const std::filesystem::path& path, bool with_steps, double version = 2) {
  Hdf5Writer file(path);
  file.begin_vtk("UnstructuredGrid", {version, 0});
  file.write("/VTKHDF/NumberOfPoints", {2}, Ints{4, 4});
  file.write("/VTKHDF/NumberOfCells", {2}, Ints{1, 1});
  file.write("/VTKHDF/NumberOfConnectivityIds", {2}, Ints{4, 4});
  file.write("/VTKHDF/Points", {8, 3}, Doubles{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1});
  file.write("/VTKHDF/Connectivity", {8}, Ints{0, 1, 2, 3, 0, 1, 2, 3});
  file.write("/VTKHDF/Offsets", {4}, Ints{0, 4, 0, 4});
  file.write("/VTKHDF/Types", {2}, Ints{10, 10});
  const int steps = with_steps ? 2 : 1;
  file.write("/VTKHDF/PointData/f", {static_cast<hsize_t>(8 * steps)}, counting(8 * steps));
  file.write("/VTKHDF/CellData/T", {static_cast<hsize_t>(2 * steps), 9}, counting(2 * 9 * steps));
  if (!with_steps) return;
  file.group("/VTKHDF/Steps");
  file.attribute("/VTKHDF/Steps", "NSteps", Doubles{2});
  file.write("/VTKHDF/Steps/Values", {2}, Doubles{0, 0.5});
  for (const std::string name : {"PartOffsets", "PointOffsets"}) file.write("/VTKHDF/Steps/" + name, {2}, Ints{0, 0});
  file.write("/VTKHDF/Steps/NumberOfParts", {2}, Ints{2, 2});
  for (const std::string name : {"CellOffsets", "ConnectivityIdOffsets"})
    file.write("/VTKHDF/Steps/" + name, {2, 1}, Ints{0, 0});
  file.write("/VTKHDF/Steps/PointDataOffsets/f", {2}, Ints{0, 8});
  file.write("/VTKHDF/Steps/CellDataOffsets/T", {2}, Ints{0, 2});
}

TEST(VtkHdf, PartsAreMergedAndStepsAreRead) {
  const TemporaryFolder folder;
  for (const bool with_steps : {false, true}) {
    write_grid(folder / "a.vtkhdf", with_steps);
    EXPECT_EQ(time_steps(folder / "a.vtkhdf"), with_steps ? 2 : 1);
    for (const int step : {0, with_steps ? 1 : 0}) {
      const auto mesh = read_vtk_source(folder / "a.vtkhdf", step);
      ASSERT_EQ(mesh->GetNumberOfCells(), 2);
      EXPECT_EQ(mesh->GetNumberOfPoints(), 5);
      EXPECT_EQ(mesh->GetPointData()->GetArray("f")->GetComponent(4, 0), 8 * step + 7);
      EXPECT_EQ(mesh->GetCellData()->GetArray("T")->GetComponent(1, 3), 18 * step + 12);
    }
  }
}

/// An image of 3 x 2 x 2 points.
void begin_image(Hdf5Writer& file, double version) {
  file.begin_vtk("ImageData", {version, 0});
  file.attribute("/VTKHDF", "WholeExtent", Doubles{0, 2, 0, 1, 0, 1});
  file.attribute("/VTKHDF", "Origin", Doubles{1, 2, 3});
  file.attribute("/VTKHDF", "Spacing", Doubles{0.5, 1, 2});
}

/// Of a file with steps, arrays may be the same at all of them, and others may name their steps.
TEST(VtkHdf, ImagesWithAndWithoutSteps) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "a.hdf");
    begin_image(file, 1);
    file.write("/VTKHDF/PointData/still", {2, 2, 3, 3}, counting(12 * 3));
  }
  {
    Hdf5Writer file(folder / "a.vtkhdf");
    begin_image(file, 2);
    file.group("/VTKHDF/Steps");
    file.attribute("/VTKHDF/Steps", "NSteps", Doubles{2});
    for (const std::string name : {"moving", "named"})
      file.write("/VTKHDF/PointData/" + name, {2, 2, 2, 3, 3}, counting(2 * 12 * 3));
    file.write("/VTKHDF/Steps/PointDataOffsets/named", {2}, Ints{1, 0});
    file.write("/VTKHDF/PointData/still", {2, 2, 3, 3}, counting(12 * 3));
    file.text("/VTKHDF/PointData/label", "water");
  }
  const auto expect_array = [&](const char* file, std::optional<int> step, const char* name, int first) {
    SCOPED_TRACE(fmt::format("{} {} {}", file, name, step.value_or(-1)));
    const auto image = read_vtk_source(folder / file, step);
    ASSERT_TRUE(vtkImageData::SafeDownCast(image));
    EXPECT_EQ(Vector3d(image->GetPoint(11)), Vector3d(2, 3, 5));
    vtkDataArray* const array = image->GetPointData()->GetArray(name);
    ASSERT_TRUE(array);
    EXPECT_EQ(array->GetNumberOfComponents(), 3);
    EXPECT_EQ(array->GetComponent(11, 2), first + 35);
  };
  expect_array("a.hdf", {}, "still", 0);
  expect_array("a.vtkhdf", {}, "moving", 36);  // The last step.
  for (const int step : {0, 1}) {
    expect_array("a.vtkhdf", step, "still", 0);
    expect_array("a.vtkhdf", step, "moving", 36 * step);
    expect_array("a.vtkhdf", step, "named", 36 - 36 * step);
  }
}

TEST(VtkHdf, DamageAndOtherKindsAreErrorsWithTheFile) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "a.vtkhdf";
  struct Row {
    std::function<void()> write;
    const char* words;
  };
  const Row table[] = {
      {[&] { write_grid(path, false, 3); }, "a.vtkhdf: is of version 3"},
      {[&] {
         Hdf5Writer file(path);
         begin_image(file, 2);
         file.announce("/VTKHDF/PointData/v", {1 << 30, 1 << 20});  // None of these numbers was written.
       },
       "a.vtkhdf: is damaged, or too large: it announces more than memory holds"},
      {[&] {
         write_grid(path, false);
         std::filesystem::resize_file(path, file_size(path) / 2);
       },
       "a.vtkhdf: is no HDF5 file, or cut off"},
      {[&] { Hdf5Writer(path).write("/x", {1}, Ints{1}); }, "no group VTKHDF"},
      {[&] { Hdf5Writer(path).begin_vtk("PolyData"); }, "PolyData"},
      {[&] {
         Hdf5Writer file(path);
         file.begin_vtk("UnstructuredGrid");
         file.write("/VTKHDF/NumberOfPoints", {1}, Ints{4});
         file.write("/VTKHDF/NumberOfCells", {1}, Ints{1});
         file.write("/VTKHDF/NumberOfConnectivityIds", {1}, Ints{4});
         file.write("/VTKHDF/Points", {3, 3}, Doubles(9, 0));
       },
       "Points is smaller"}};
  for (const Row& row : table) {
    row.write();
    EXPECT_THAT(read_error(path), HasSubstr(row.words));
  }
}

const std::string mesh_items = R"(
  <Topology TopologyType="Tetrahedron" NumberOfElements="2" NodesPerElement="4">
    <DataItem Dimensions="2 4" NumberType="Int" Format="XML">0 1 2 3  1 2 3 4</DataItem>
  </Topology>
  <Geometry GeometryType="XYZ">
    <DataItem Dimensions="5 3" Format="XML">0 0 0  1 0 0  0 1 0  0 0 1  1 1 1</DataItem>
  </Geometry>)";

std::string document(const std::string& domain, const std::string& doctype = "") {
  return "<?xml version=\"1.0\"?>\n" + doctype +
         "<Xdmf Version=\"3.0\" xmlns:ns0=\"https://www.w3.org/2001/XInclude\"><Domain>" + domain +
         "</Domain></Xdmf>\n";
}

std::string grid_document(const std::string& items) { return document("<Grid Name=\"a\">" + items + "</Grid>"); }

/// A scalar at the five points, with the value `first` at the first one.
std::string attribute(const std::string& name, int first) {
  return fmt::format(R"(<Attribute Name="{}" AttributeType="Scalar" Center="Node">
    <DataItem Dimensions="5 1" Format="XML">{} {} {} {} {}</DataItem></Attribute>)",
                     name, first, first + 1, first + 2, first + 3, first + 4);
}

class Xdmf : public testing::Test {
 protected:
  vtkSmartPointer<vtkDataSet> read(const std::string& text, std::optional<int> step = {}) const {
    write_bytes(folder_ / "a.xdmf", text);
    return read_vtk_source(folder_ / "a.xdmf", step);
  }

  void refuses(const std::string& text, const char* words) const {
    EXPECT_THAT(error_of([&] { read(text); }), HasSubstr(words));
  }

  TemporaryFolder folder_;
};

TEST_F(Xdmf, AGridInTheFileItself) {
  const auto mesh = read(grid_document(mesh_items + attribute("f", 7) + R"(
    <Attribute Name="S" AttributeType="Tensor" Center="Cell"><DataItem Dimensions="2 9" Format="XML">
      1 2 3 4 5 6 7 8 9  11 12 13 14 15 16 17 18 19</DataItem></Attribute>)"));
  EXPECT_EQ(mesh->GetNumberOfCells(), 2);
  EXPECT_EQ(mesh->GetCellType(1), VTK_TETRA);
  EXPECT_EQ(mesh->GetPoint(4)[2], 1);
  EXPECT_EQ(mesh->GetPointData()->GetArray("f")->GetComponent(4, 0), 11);
  EXPECT_EQ(mesh->GetCellData()->GetArray("S")->GetNumberOfComponents(), 9);
  EXPECT_EQ(mesh->GetCellData()->GetArray("S")->GetComponent(1, 5), 16);
}

/// A mesh, and for each function a collection of grids in time that include the mesh: as FEniCSx writes it.
TEST_F(Xdmf, FunctionsOfFenicsxShareTheirMesh) {
  const auto function = [](const std::string& name, int first) {
    std::string grids;
    for (const int step : {0, 1})
      grids += fmt::format(R"xml(<Grid Name="{}" GridType="Uniform"><ns0:include
        xpointer="xpointer(/Xdmf/Domain/Grid[@GridType='Uniform'][1]/*[self::Topology or self::Geometry])" />
        <Time Value="{}" />{}</Grid>)xml",
                           name, step, attribute(name, first + 100 * step));
    return fmt::format(R"(<Grid Name="{}" GridType="Collection" CollectionType="Temporal">{}</Grid>)", name, grids);
  };
  const std::string text = document("<Grid Name=\"mesh\" GridType=\"Uniform\">" + mesh_items + "</Grid>" +
                                    function("f", 1) + function("g", 50));
  const auto last = read(text), first = read(text, 0);
  EXPECT_EQ(time_steps(folder_ / "a.xdmf"), 2);
  EXPECT_EQ(last->GetNumberOfCells(), 2);
  for (const auto& set : {last, first}) ASSERT_TRUE(set->GetPointData()->HasArray("f"));
  ASSERT_TRUE(last->GetPointData()->HasArray("g"));
  EXPECT_EQ(last->GetPointData()->GetArray("f")->GetComponent(0, 0), 101);
  EXPECT_EQ(last->GetPointData()->GetArray("g")->GetComponent(0, 0), 150);
  EXPECT_EQ(first->GetPointData()->GetArray("f")->GetComponent(0, 0), 1);
  EXPECT_THROW(read(text, 2), std::invalid_argument);
}

TEST_F(Xdmf, NumbersInHdf5WithReferencesSlabsAndEntities) {
  {
    Hdf5Writer file(folder_ / "b.h5");
    file.write("/geometry/vertices", {5, 3}, Doubles{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1});
    file.write("/topology/cells", {2, 4}, Ints{0, 1, 2, 3, 1, 2, 3, 4});
    file.write("/fields/u", {2, 5, 3}, counting(2 * 5 * 3));
  }
  // PyLith: items that others refer to, an entity for the file's name, and parts of a dataset with all steps.
  const std::string text = document(R"xml(
    <DataItem Name="cells" ItemType="Uniform" Format="HDF" NumberType="Int" Dimensions="2 4">&HeavyData;:/topology/cells</DataItem>
    <DataItem Name="vertices" Format="HDF" Dimensions="5 3">&HeavyData;:/geometry/vertices</DataItem>
    <Grid Name="t" GridType="Collection" CollectionType="Temporal">
     <Grid Name="d" GridType="Uniform">
      <Topology TopologyType="Tetrahedron" NumberOfElements="2"><DataItem Reference="XML">
        /Xdmf/Domain/DataItem[@Name="cells"]</DataItem></Topology>
      <Geometry GeometryType="XYZ"><DataItem Reference="XML">/Xdmf/Domain/DataItem[@Name="vertices"]</DataItem></Geometry>
      <Attribute Name="u" Type="Vector" Center="Node">
       <DataItem ItemType="HyperSlab" Dimensions="1 5 3" Type="HyperSlab">
        <DataItem Dimensions="3 3" Format="XML">1 0 0  1 1 1  1 5 3</DataItem>
        <DataItem DataType="Float" Precision="8" Dimensions="2 5 3" Format="HDF">&HeavyData;:/fields/u</DataItem>
       </DataItem></Attribute>
      <Attribute Name="joined" Type="Vector" Center="Node">
       <DataItem ItemType="Function" Dimensions="5 2" Function="JOIN($0 ; $1)">
        <DataItem ItemType="HyperSlab" Dimensions="5 1">
         <DataItem Dimensions="3 3" Format="XML">0 0 2  1 1 1  1 5 1</DataItem>
         <DataItem Dimensions="2 5 3" Format="HDF">&HeavyData;:/fields/u</DataItem></DataItem>
        <DataItem ItemType="Function" Dimensions="5" Function="0*$0">
         <DataItem Format="XML" Dimensions="5">1 2 3 4 5</DataItem></DataItem>
       </DataItem></Attribute>
     </Grid></Grid>)xml",
                                    "<!DOCTYPE Xdmf SYSTEM \"Xdmf.dtd\" [ <!ENTITY HeavyData \"b.h5\"> ]>\n");
  const auto mesh = read(text);
  ASSERT_EQ(mesh->GetNumberOfPoints(), 5);
  vtkDataArray &u = *mesh->GetPointData()->GetArray("u"), &joined = *mesh->GetPointData()->GetArray("joined");
  for (int i = 0; i < 5; ++i) {
    for (int c = 0; c < 3; ++c) EXPECT_EQ(u.GetComponent(i, c), 15 + 3 * i + c);
    EXPECT_EQ(joined.GetComponent(i, 0), 3 * i + 2);
    EXPECT_EQ(joined.GetComponent(i, 1), 0);
  }
}

TEST_F(Xdmf, MixedCellsOrderedMeshesAndBinaryFiles) {
  const auto mixed = read(document(R"(<Grid><Topology TopologyType="Mixed" NumberOfElements="3">
      <DataItem Dimensions="12" NumberType="Int" Format="XML">6 0 1 2 3  1 1 4  4 1 2 3 </DataItem></Topology>
    <Geometry GeometryType="X_Y_Z"><DataItem Format="XML" Dimensions="5">0 1 0 0 1</DataItem>
      <DataItem Format="XML" Dimensions="5">0 0 1 0 1</DataItem>
      <DataItem Format="XML" Dimensions="5">0 0 0 1 1</DataItem></Geometry></Grid>)"));
  ASSERT_EQ(mixed->GetNumberOfCells(), 3);
  EXPECT_EQ(mixed->GetCellType(0), VTK_TETRA);
  EXPECT_EQ(mixed->GetCellType(1), VTK_POLY_VERTEX);
  EXPECT_EQ(mixed->GetCellType(2), VTK_TRIANGLE);
  EXPECT_EQ(mixed->GetPoint(3)[2], 1);

  std::string numbers = "skip";
  for (int i = 0; i < 24; ++i) append_number(static_cast<float>(i), ByteOrder::big, numbers);
  write_bytes(folder_ / "f.raw", numbers);
  const auto image = read(document(R"(<Grid><Topology TopologyType="3DCoRectMesh" Dimensions="2 3 4"/>
    <Geometry GeometryType="ORIGIN_DXDYDZ"><DataItem Dimensions="3" Format="XML">10 20 30</DataItem>
      <DataItem Dimensions="3" Format="XML">1 2 3</DataItem></Geometry>
    <Attribute Name="f"><DataItem Dimensions="2 3 4" Format="Binary" Endian="Big" Seek="4" NumberType="Float"
      Precision="4">f.raw</DataItem></Attribute></Grid>)"));
  ASSERT_TRUE(vtkImageData::SafeDownCast(image));
  double bounds[6];
  image->GetBounds(bounds);
  EXPECT_THAT(bounds, testing::ElementsAre(30, 39, 20, 24, 10, 11));
  EXPECT_EQ(image->GetPointData()->GetArray("f")->GetComponent(23, 0), 23);

  const auto rectilinear = read(document(R"(<Grid><Topology TopologyType="3DRectMesh" Dimensions="2 1 3"/>
    <Geometry GeometryType="VXVYVZ"><DataItem Dimensions="3" Format="XML">0 1 5</DataItem>
      <DataItem Dimensions="1" Format="XML">7</DataItem><DataItem Dimensions="2" Format="XML">0 3</DataItem>
    </Geometry></Grid>)"));
  ASSERT_TRUE(vtkRectilinearGrid::SafeDownCast(rectilinear));
  EXPECT_EQ(rectilinear->GetPoint(2)[0], 5);
  EXPECT_EQ(rectilinear->GetPoint(2)[1], 7);

  const auto structured = read(document(R"(<Grid><Topology TopologyType="2DSMesh" Dimensions="2 2"/>
    <Geometry GeometryType="XY"><DataItem Dimensions="4 2" Format="XML">0 0 1 0 0 1 2 2</DataItem></Geometry></Grid>)"));
  ASSERT_TRUE(vtkStructuredGrid::SafeDownCast(structured));
  EXPECT_EQ(structured->GetPoint(3)[1], 2);
}

TEST_F(Xdmf, DamageIsAnErrorWithTheFileAndTheReason) {
  const auto changed = [](const std::string& from, const std::string& to) {
    return replaced_text(grid_document(mesh_items), from, to);
  };
  const auto with_array = [](const std::string& item) {
    return grid_document(mesh_items + "<Attribute Name=\"f\">" + item + "</Attribute>");
  };
  const auto ordered = [](const char* type, const char* size, const char* geometry, const Strings& lists) {
    std::string items;
    for (const std::string& list : lists) items += "<DataItem Format=\"XML\">" + list + "</DataItem>";
    const char* const form =
        R"(<Topology TopologyType="{}" Dimensions="{}"/><Geometry GeometryType="{}">{}</Geometry>)";
    return grid_document(fmt::format(form, type, size, geometry, items));
  };
  refuses(grid_document(mesh_items).substr(0, 200), "a.xdmf: is damaged");
  refuses(document(""), "has no grid");
  refuses(changed("1 2 3 4</DataItem>", "1 2 3</DataItem>"), "has 7");
  refuses(changed("1 2 3 4</DataItem>", "1 2 3 9</DataItem>"), "point 9");
  refuses(changed("Tetrahedron", "Wurtzite"), "type wurtzite");
  refuses(changed("0 0 0  1 0 0", "0 0 0  1 0 x"), "no numbers");
  refuses(changed("Format=\"XML\">0 0", "Format=\"HDF\">none.h5:/x"), "none.h5: is missing");
  write_bytes(folder_ / "b.h5", "\x89HDF\r\n\x1a\n and no more");
  refuses(changed("Format=\"XML\">0 0", "Format=\"HDF\">b.h5:/x"), "b.h5: is no HDF5");
  refuses(with_array("<DataItem Format=\"XML\">1 2</DataItem>"), "2 numbers for 5 points");
  refuses(with_array("<DataItem Reference=\"XML\">/Xdmf/Domain/Grid/Attribute/DataItem</DataItem>"),
          "refers to itself");
  // Numbers whose products are beyond all integers, or that do not fit each other.
  refuses(with_array(R"(<DataItem ItemType="HyperSlab" Dimensions="5">
      <DataItem Format="XML">0 17592186044416 1048577</DataItem><DataItem Format="XML">1 2 3 4 5</DataItem></DataItem>)"),
          "a.xdmf: a DataItem is a HyperSlab beyond");
  refuses(ordered("3DCoRectMesh", "1000000000 1000000000 1000000000", "Origin_DxDyDz", {"0 0 0", "1 1 1"}),
          "senseless");
  refuses(ordered("3DCoRectMesh", "2 2 2", "VxVyVz", {"5 6", "5 6", "5 6"}), "type vxvyvz, which does not fit");
  refuses(ordered("3DRectMesh", "2 2 2", "Origin_DxDyDz", {"5 6 7", "1 1 1"}),
          "type origin_dxdydz, which does not fit");
  refuses(ordered("3DRectMesh", "2 2 3", "VxVyVz", {"5 6", "5 6", "5 6"}), "other numbers of coordinates");
  refuses(ordered("3DSMesh", "2 2 2", "XYZ", {"0 0 0  1 0 0"}), "another number of points");
}

TEST_F(Xdmf, BlocksThatShareTheirPointsAreNotTheSameMesh) {
  std::string grids;
  for (const std::string cell : {"0 1 2 3", "1 2 3 4"}) {
    const std::string items = replaced_text(replaced_text(mesh_items, "2 4\"", "1 4\""), "0 1 2 3  1 2 3 4", cell);
    grids += "<Grid Name=\"" + cell + "\">" + items + attribute("f", 7) + "</Grid>";
  }
  const auto mesh = read(document("<Grid GridType=\"Collection\" CollectionType=\"Spatial\">" + grids + "</Grid>"));
  EXPECT_EQ(mesh->GetNumberOfCells(), 2);
  EXPECT_EQ(mesh->GetNumberOfPoints(), 5);
}

TEST_F(Xdmf, PointsMayBeCountedFromOne) {
  const auto with = [](const std::string& type, const std::string& attributes, const std::string& cells) {
    const std::string items =
        replaced_text(replaced_text(mesh_items, "Tetrahedron\"", type + "\" " + attributes), "0 1 2 3  1 2 3 4", cells);
    return grid_document(replaced_text(items, "\"2 4\"", type == "Mixed" ? "\"10\"" : "\"2 4\"") + attribute("f", 7));
  };
  for (const std::string& text : {with("Tetrahedron", "BaseOffset=\"1\"", "1 2 3 4  2 3 4 5"),
                                  with("Mixed", "BaseOffset=\"1\"", "6 1 2 3 4  6 2 3 4 5")}) {
    const auto mesh = read(text);
    ASSERT_EQ(mesh->GetNumberOfCells(), 2);
    EXPECT_EQ(mesh->GetCell(1)->GetPointId(3), 4);
    EXPECT_EQ(mesh->GetCell(0)->GetPointId(0), 0);
  }
  refuses(with("Tetrahedron", "Order=\"3 2 1 0\"", "0 1 2 3  1 2 3 4"), "order of points of their own");
}

}  // namespace
}  // namespace tensorray
