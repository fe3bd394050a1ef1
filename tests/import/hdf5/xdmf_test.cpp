// XDMF as FEniCSx, PyLith, Underworld and meshio write it.

#include <gmock/gmock.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkRectilinearGrid.h>
#include <vtkSmartPointer.h>
#include <vtkStructuredGrid.h>

#include "base/text/byte_order.h"
#include "tests/import/hdf5_writer.h"
#include "tests/import/mesh_files.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

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

/// A scalar at the five points, with the value `first` at the first one.
std::string attribute(const std::string& name, int first) {
  std::string numbers;
  for (int i = 0; i < 5; ++i) numbers += std::to_string(first + i) + " ";
  return "<Attribute Name=\"" + name +
         "\" AttributeType=\"Scalar\" Center=\"Node\"><DataItem Dimensions=\"5 1\" "
         "Format=\"XML\">" +
         numbers + "</DataItem></Attribute>";
}

vtkSmartPointer<vtkDataSet> read(const fs::path& folder, const std::string& text, std::optional<int> step = {}) {
  write_bytes(folder / "a.xdmf", text);
  return read_vtk_source(folder / "a.xdmf", step);
}

double first_value(vtkDataSet& mesh, const char* name) {
  vtkDataArray* const array = mesh.GetPointData()->GetArray(name);
  return array ? array->GetComponent(0, 0) : NAN;
}

TEST(Xdmf, AGridInTheFileItself) {
  const TemporaryFolder folder;
  const auto mesh =
      read(folder, document("<Grid Name=\"a\" GridType=\"Uniform\">" + mesh_items + attribute("f", 7) + R"(
    <Attribute Name="S" AttributeType="Tensor" Center="Cell"><DataItem Dimensions="2 9" Format="XML">
      1 2 3 4 5 6 7 8 9  11 12 13 14 15 16 17 18 19</DataItem></Attribute></Grid>)"));
  EXPECT_EQ(mesh->GetNumberOfCells(), 2);
  EXPECT_EQ(mesh->GetCellType(1), VTK_TETRA);
  EXPECT_EQ(mesh->GetPoint(4)[2], 1);
  EXPECT_EQ(mesh->GetPointData()->GetArray("f")->GetComponent(4, 0), 11);
  EXPECT_EQ(mesh->GetCellData()->GetArray("S")->GetNumberOfComponents(), 9);
  EXPECT_EQ(mesh->GetCellData()->GetArray("S")->GetComponent(1, 5), 16);
}

/// A mesh, and for each function a collection of grids in time that include the mesh: as FEniCSx writes it.
TEST(Xdmf, FunctionsOfFenicsxShareTheirMesh) {
  const TemporaryFolder folder;
  const std::string include =
      "<ns0:include xpointer=\"xpointer(/Xdmf/Domain/Grid[@GridType='Uniform'][1]/*[self::Topology or "
      "self::Geometry])\" />";
  const auto function = [&](const std::string& name, int first) {
    std::string grids;
    for (const int step : {0, 1})
      grids += "<Grid Name=\"" + name + "\" GridType=\"Uniform\">" + include + "<Time Value=\"" + std::to_string(step) +
               "\" />" + attribute(name, first + 100 * step) + "</Grid>";
    return "<Grid Name=\"" + name + "\" GridType=\"Collection\" CollectionType=\"Temporal\">" + grids + "</Grid>";
  };
  const std::string text = document("<Grid Name=\"mesh\" GridType=\"Uniform\">" + mesh_items + "</Grid>" +
                                    function("f", 1) + function("g", 50));
  const auto last = read(folder, text), first = read(folder, text, 0);
  EXPECT_EQ(time_steps(folder / "a.xdmf"), 2);
  EXPECT_EQ(last->GetNumberOfCells(), 2);
  EXPECT_EQ(first_value(*last, "f"), 101);
  EXPECT_EQ(first_value(*last, "g"), 150);
  EXPECT_EQ(first_value(*first, "f"), 1);
  EXPECT_THROW(read(folder, text, 2), std::invalid_argument);
}

TEST(Xdmf, NumbersInHdf5WithReferencesSlabsAndEntities) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "b.h5");
    file.write("/geometry/vertices", {5, 3}, std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1});
    file.write("/topology/cells", {2, 4}, std::vector<int>{0, 1, 2, 3, 1, 2, 3, 4});
    std::vector<double> fields;
    for (int i = 0; i < 2 * 5 * 3; ++i) fields.push_back(i);
    file.write("/fields/u", {2, 5, 3}, fields);
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
  const auto mesh = read(folder, text);
  ASSERT_EQ(mesh->GetNumberOfPoints(), 5);
  vtkDataArray &u = *mesh->GetPointData()->GetArray("u"), &joined = *mesh->GetPointData()->GetArray("joined");
  for (int i = 0; i < 5; ++i) {
    for (int c = 0; c < 3; ++c) EXPECT_EQ(u.GetComponent(i, c), 15 + 3 * i + c);
    EXPECT_EQ(joined.GetComponent(i, 0), 3 * i + 2);
    EXPECT_EQ(joined.GetComponent(i, 1), 0);
  }
}

TEST(Xdmf, MixedCellsOrderedMeshesAndBinaryFiles) {
  const TemporaryFolder folder;
  const auto mixed = read(folder, document(R"(<Grid><Topology TopologyType="Mixed" NumberOfElements="3">
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
  write_bytes(folder / "f.raw", numbers);
  const auto image = read(folder, document(R"(<Grid><Topology TopologyType="3DCoRectMesh" Dimensions="2 3 4"/>
    <Geometry GeometryType="ORIGIN_DXDYDZ"><DataItem Dimensions="3" Format="XML">10 20 30</DataItem>
      <DataItem Dimensions="3" Format="XML">1 2 3</DataItem></Geometry>
    <Attribute Name="f"><DataItem Dimensions="2 3 4" Format="Binary" Endian="Big" Seek="4" NumberType="Float"
      Precision="4">f.raw</DataItem></Attribute></Grid>)"));
  ASSERT_TRUE(vtkImageData::SafeDownCast(image));
  double bounds[6];
  image->GetBounds(bounds);
  EXPECT_THAT(bounds, testing::ElementsAre(30, 39, 20, 24, 10, 11));
  EXPECT_EQ(image->GetPointData()->GetArray("f")->GetComponent(23, 0), 23);

  const auto rectilinear = read(folder, document(R"(<Grid><Topology TopologyType="3DRectMesh" Dimensions="2 1 3"/>
    <Geometry GeometryType="VXVYVZ"><DataItem Dimensions="3" Format="XML">0 1 5</DataItem>
      <DataItem Dimensions="1" Format="XML">7</DataItem><DataItem Dimensions="2" Format="XML">0 3</DataItem>
    </Geometry></Grid>)"));
  ASSERT_TRUE(vtkRectilinearGrid::SafeDownCast(rectilinear));
  EXPECT_EQ(rectilinear->GetPoint(2)[0], 5);
  EXPECT_EQ(rectilinear->GetPoint(2)[1], 7);

  const auto structured = read(folder, document(R"(<Grid><Topology TopologyType="2DSMesh" Dimensions="2 2"/>
    <Geometry GeometryType="XY"><DataItem Dimensions="4 2" Format="XML">0 0 1 0 0 1 2 2</DataItem></Geometry></Grid>)"));
  ASSERT_TRUE(vtkStructuredGrid::SafeDownCast(structured));
  EXPECT_EQ(structured->GetPoint(3)[1], 2);
}

TEST(Xdmf, DamageIsAnErrorWithTheFileAndTheReason) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& text) { return error_of([&] { read(folder, text); }); };
  const std::string grid = "<Grid Name=\"a\">" + mesh_items + "</Grid>";
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = document(grid);
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_THAT(error(document(grid).substr(0, 200)), HasSubstr("a.xdmf: is damaged"));
  EXPECT_THAT(error(document("")), HasSubstr("has no grid"));
  EXPECT_THAT(error(changed("1 2 3 4</DataItem>", "1 2 3</DataItem>")), HasSubstr("has 7"));
  EXPECT_THAT(error(changed("1 2 3 4</DataItem>", "1 2 3 9</DataItem>")), HasSubstr("point 9"));
  EXPECT_THAT(error(changed("Tetrahedron", "Wurtzite")), HasSubstr("type wurtzite"));
  EXPECT_THAT(error(changed("0 0 0  1 0 0", "0 0 0  1 0 x")), HasSubstr("no numbers"));
  EXPECT_THAT(error(changed("Format=\"XML\">0 0", "Format=\"HDF\">none.h5:/x")), HasSubstr("none.h5: is missing"));
  EXPECT_THAT(error(document("<Grid>" + mesh_items +
                             "<Attribute Name=\"f\"><DataItem Format=\"XML\">1 2</DataItem>"
                             "</Attribute></Grid>")),
              HasSubstr("2 numbers for 5 points"));
  EXPECT_THAT(error(document("<Grid>" + mesh_items + R"(<Attribute Name="f"><DataItem Reference="XML">
    /Xdmf/Domain/Grid/Attribute/DataItem</DataItem></Attribute></Grid>)")),
              HasSubstr("refers to itself"));
  write_bytes(folder / "b.h5", "\x89HDF\r\n\x1a\n and no more");
  EXPECT_THAT(error(changed("Format=\"XML\">0 0", "Format=\"HDF\">b.h5:/x")), HasSubstr("b.h5: is no HDF5"));
}

TEST(Xdmf, BlocksThatShareTheirPointsAreNotTheSameMesh) {
  const TemporaryFolder folder;
  std::string grids;
  for (const std::string cell : {"0 1 2 3", "1 2 3 4"}) {
    std::string items = mesh_items;
    items.replace(items.find("2 4\""), 3, "1 4");
    items.replace(items.find("0 1 2 3  1 2 3 4"), 16, cell);
    grids += "<Grid Name=\"" + cell + "\">" + items + attribute("f", 7) + "</Grid>";
  }
  const auto mesh =
      read(folder, document("<Grid GridType=\"Collection\" CollectionType=\"Spatial\">" + grids + "</Grid>"));
  EXPECT_EQ(mesh->GetNumberOfCells(), 2);
  EXPECT_EQ(mesh->GetNumberOfPoints(), 5);
}

TEST(Xdmf, PointsMayBeCountedFromOne) {
  const TemporaryFolder folder;
  const auto with = [](const std::string& type, const std::string& attributes, const std::string& cells) {
    std::string items = mesh_items;
    items.replace(items.find("Tetrahedron\""), 12, type + "\" " + attributes);
    items.replace(items.find("0 1 2 3  1 2 3 4"), 16, cells);
    return items.replace(items.find("\"2 4\""), 5, type == "Mixed" ? "\"10\"" : "\"2 4\"");
  };
  const auto grid = [&](const std::string& items) {
    return document("<Grid Name=\"a\">" + items + attribute("f", 7) + "</Grid>");
  };
  for (const std::string& items : {with("Tetrahedron", "BaseOffset=\"1\"", "1 2 3 4  2 3 4 5"),
                                   with("Mixed", "BaseOffset=\"1\"", "6 1 2 3 4  6 2 3 4 5")}) {
    const auto mesh = read(folder, grid(items));
    ASSERT_EQ(mesh->GetNumberOfCells(), 2);
    EXPECT_EQ(mesh->GetCell(1)->GetPointId(3), 4);
    EXPECT_EQ(mesh->GetCell(0)->GetPointId(0), 0);
  }
  const std::string ordered = grid(with("Tetrahedron", "Order=\"3 2 1 0\"", "0 1 2 3  1 2 3 4"));
  EXPECT_THAT(error_of([&] { read(folder, ordered); }), HasSubstr("order of points of their own"));
}

/// Numbers whose products are beyond all integers, or that do not fit each other.
TEST(Xdmf, SizesThatDoNotFitAreErrors) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& grid) {
    return error_of([&] { read(folder, document("<Grid Name=\"a\">" + grid + "</Grid>")); });
  };
  const auto numbers = [](const std::string& list) { return "<DataItem Format=\"XML\">" + list + "</DataItem>"; };
  const auto grid_of = [](const std::string& type, const std::string& size, const std::string& geometry,
                          const std::string& items) {
    return "<Topology TopologyType=\"" + type + "\" Dimensions=\"" + size + "\"/><Geometry GeometryType=\"" + geometry +
           "\">" + items + "</Geometry>";
  };
  EXPECT_THAT(error(mesh_items + "<Attribute Name=\"f\"><DataItem ItemType=\"HyperSlab\" Dimensions=\"5\">" +
                    numbers("0 17592186044416 1048577") + numbers("1 2 3 4 5") + "</DataItem></Attribute>"),
              HasSubstr("a.xdmf: a DataItem is a HyperSlab beyond"));
  EXPECT_THAT(error(grid_of("3DCoRectMesh", "1000000000 1000000000 1000000000", "Origin_DxDyDz",
                            numbers("0 0 0") + numbers("1 1 1"))),
              HasSubstr("senseless"));
  EXPECT_THAT(error(grid_of("3DCoRectMesh", "2 2 2", "VxVyVz", numbers("5 6") + numbers("5 6") + numbers("5 6"))),
              HasSubstr("type vxvyvz, which does not fit"));
  EXPECT_THAT(error(grid_of("3DRectMesh", "2 2 2", "Origin_DxDyDz", numbers("5 6 7") + numbers("1 1 1"))),
              HasSubstr("type origin_dxdydz, which does not fit"));
  EXPECT_THAT(error(grid_of("3DRectMesh", "2 2 3", "VxVyVz", numbers("5 6") + numbers("5 6") + numbers("5 6"))),
              HasSubstr("other numbers of coordinates"));
  EXPECT_THAT(error(grid_of("3DSMesh", "2 2 2", "XYZ", numbers("0 0 0  1 0 0"))),
              HasSubstr("another number of points"));
}

}  // namespace
}  // namespace tensorray
