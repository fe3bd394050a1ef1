#include "tools/import/vtk_source/vtk_source.h"

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <vtkAppendFilter.h>
#include <vtkUnsignedCharArray.h>

#include "tests/import/mesh_files.h"
#include "tests/import/openfoam_case.h"
#include "tests/import/vtk_files.h"
#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/vtk_formats/image_lattice.h"

namespace tensorray {
namespace {

TEST(VtkSourceTest, XmlFilesOfEveryEncoding) {
  const TemporaryFolder folder;
  for (const auto& [ending, written] : data_sets()) {
    for (const Mode mode : {Mode::ascii, Mode::binary, Mode::raw_compressed, Mode::raw_plain}) {
      SCOPED_TRACE(ending);
      write_xml(*written, folder / ("file" + ending), mode);
      const auto read = read_vtk_source(folder / ("file" + ending));
      EXPECT_STREQ(read->GetClassName(), written->GetClassName());
      expect_same(*read, *written, mode == Mode::ascii ? 1e-9 : 0x1p-1000);
    }
  }
}

TEST(VtkSourceTest, LegacyFiles) {
  const TemporaryFolder folder;
  for (const auto& [ending, written] : data_sets()) {
    for (const bool binary : {false, true}) {
      SCOPED_TRACE(ending);
      write_legacy(*written, folder / "file.vtk", binary);
      const auto read = read_vtk_source(folder / "file.vtk");
      EXPECT_TRUE(read->IsA(written->GetClassName())) << read->GetClassName();
      expect_same(*read, *written, binary ? 0x1p-1000 : 1e-5);  // VTK writes ASCII with six or more digits
    }
  }
}

std::string pieces_text(const std::string& kind, const std::string& whole, const std::string& pieces) {
  return "<VTKFile type=\"" + kind + "\" version=\"0.1\" byte_order=\"LittleEndian\">\n<" + kind +
         " GhostLevel=\"0\" " + whole +
         ">\n<PPointData><PDataArray type=\"Float64\" Name=\"tensor\" NumberOfComponents=\"9\"/></PPointData>\n" +
         "<PCellData><PDataArray type=\"Float64\" Name=\"rate\" NumberOfComponents=\"3\"/></PCellData>\n" +
         "<PPoints><PDataArray type=\"Float64\" NumberOfComponents=\"3\"/></PPoints>\n" + pieces + "</" + kind +
         ">\n</VTKFile>\n";
}

TEST(VtkSourceTest, UnstructuredPiecesAreMergedAndGhostCellsRemoved) {
  const TemporaryFolder folder;
  const auto first = bar(0, 3), second = bar(2, 3);  // both have the cube from 2 to 3; the first owns it
  second->AllocateCellGhostArray()->SetValue(0, vtkDataSetAttributes::DUPLICATECELL);
  second->AllocatePointGhostArray()->SetValue(5, vtkDataSetAttributes::DUPLICATEPOINT);
  write_xml(*first, folder / "p0.vtu");
  write_xml(*second, folder / "p1.vtu");
  write_bytes(folder / "all.pvtu",
              pieces_text("PUnstructuredGrid", "", "<Piece Source=\"p0.vtu\"/><Piece Source=\"p1.vtu\"/>\n"));
  const auto read = read_vtk_source(folder / "all.pvtu");
  EXPECT_EQ(read->GetNumberOfCells(), 5);
  EXPECT_EQ(read->GetNumberOfPoints(), 24);
  EXPECT_FALSE(read->HasAnyGhostPoints());
  for (vtkIdType i = 0; i < read->GetNumberOfPoints(); ++i) {
    EXPECT_EQ(read->GetPointData()->GetArray("tensor")->GetComponent(i, 4), number(read->GetPoint(i), 4));
  }

  std::filesystem::remove(folder / "p1.vtu");
  EXPECT_NE(read_error(folder / "all.pvtu").find("p1.vtu is missing"), std::string::npos);
  write_xml(*image(), folder / "image.vti");
  std::filesystem::rename(folder / "image.vti", folder / "p1.vtu");
  EXPECT_NE(read_error(folder / "all.pvtu").find("p1.vtu: "), std::string::npos);
}

TEST(VtkSourceTest, ExodusMeshIsNotMovedByItsArrays) {
  const std::filesystem::path path = data_file("disk_out_ref/disk_out_ref.ex2");
  SKIP_WITHOUT(path);
  const auto read = read_vtk_source(path);
  EXPECT_TRUE(read->IsA("vtkUnstructuredGrid"));
  EXPECT_EQ(read->GetNumberOfCells(), 7472);
  for (vtkIdType i = 0; i < 7472; ++i) ASSERT_EQ(read->GetCellType(i), VTK_HEXAHEDRON);
  ASSERT_TRUE(read->GetPointData()->GetArray("V"));
  EXPECT_EQ(read->GetPointData()->GetArray("V")->GetNumberOfComponents(), 3);
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_NEAR(read->GetBounds()[2 * axis], -5.75, 1e-5);
    EXPECT_NEAR(read->GetBounds()[2 * axis + 1], 5.75, 1e-5);
  }
}

TEST(VtkSourceTest, OpenFoamCase) {
  const TemporaryFolder folder;
  OpenFoamCase::write(folder);
  write_bytes(folder / "case.foam", "");
  for (const std::filesystem::path& path :
       {std::filesystem::path(folder), folder / "case.foam", folder / "system" / "controlDict"}) {
    const auto read = read_vtk_source(path);
    ASSERT_EQ(read->GetNumberOfCells(), OpenFoamCase::cells);
    ASSERT_EQ(read->GetNumberOfPoints(), 27);
    EXPECT_TRUE(Eigen::Vector3d(read->GetPoint(26)).isApprox(Eigen::Vector3d(2, 1, 4)));
    const int symmetric[6] = {0, 3, 5,
                              1, 4, 2};  // indices of VTK's xx yy zz xy yz xz among OpenFOAM's xx xy xz yy yz zz
    for (int cell = 0; cell < OpenFoamCase::cells; ++cell) {
      vtkCellData& data = *read->GetCellData();
      for (int c = 0; c < 9; ++c)
        EXPECT_EQ(data.GetArray("gradU")->GetComponent(cell, c), OpenFoamCase::value(cell, c, 1));
      for (int c = 0; c < 6; ++c) {
        EXPECT_EQ(data.GetArray("sigma")->GetComponent(cell, c), OpenFoamCase::value(cell, symmetric[c], 1));
      }
      for (int c = 0; c < 3; ++c) EXPECT_EQ(data.GetArray("U")->GetComponent(cell, c), OpenFoamCase::value(cell, c, 1));
    }
    // The components' names tell the order. The order of OpenFOAM's own files is refused.
    const ArrayChoice sigma{"sigma", true};
    const auto tensors = with_tensors(*read, sigma, Take::tensor, {});
    const double* const corner =
        vtkDoubleArray::SafeDownCast(tensors->GetPointData()->GetArray("tensor"))->GetPointer(0);
    for (int c = 0; c < 9; ++c) {
      const int expected[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
      EXPECT_EQ(corner[c], OpenFoamCase::value(0, expected[c], 1)) << c;
    }
    EXPECT_THROW(with_tensors(*read, sigma, Take::tensor, TensorOrder::fsl), std::invalid_argument);
    // Points have the mean of their cells; the middle point has the mean of all cells.
    const auto gradients = with_tensors(*read, {"gradU", true}, Take::tensor, {});
    EXPECT_NEAR(gradients->GetPointData()->GetArray("tensor")->GetComponent(13, 3), 1000 + 35 + 3, 1e-3);
  }
}

TEST(VtkSourceTest, IncompleteOpenFoamCases) {
  const TemporaryFolder folder;
  const auto error = [&] { return read_error(folder); };
  EXPECT_NE(error().find("controlDict is missing"), std::string::npos);
  OpenFoamCase::write(folder);
  std::filesystem::rename(folder / "constant/polyMesh/owner", folder / "owner");
  EXPECT_NE(error().find("owner: is missing"), std::string::npos);
  std::filesystem::rename(folder / "owner", folder / "constant/polyMesh/owner");
  std::filesystem::remove_all(folder / "0");
  std::filesystem::remove_all(folder / "0.5");
  EXPECT_NE(error().find("time"), std::string::npos);
  std::filesystem::create_directories(folder / "processor0");
  std::filesystem::remove_all(folder / "constant");
  EXPECT_NE(error().find("has no mesh"), std::string::npos);
}

}  // namespace
}  // namespace tensorray
