#include "tools/import/vtk_formats/vtk_counts.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/import/mesh_files.h"

namespace tensorray {
namespace {

std::string counts_of(const std::string& text, std::string (*impossible)(const std::filesystem::path&)) {
  const TemporaryFolder folder;
  write_bytes(folder / "a", text);
  return impossible(folder / "a");
}

/// Words of a title, names that are numbers, and extents of a whole whose points are in other files, announce nothing.
TEST(VtkCounts, SoundFilesArePossible) {
  for (const char* title : {"Field of 20240517 after the run", "Points 20240517", "lines to infinity", "CELLS 1e9"})
    for (const char* name : {"stress", "20240517"})
      EXPECT_EQ(counts_of("# vtk DataFile Version 3.0\n" + std::string(title) +
                              "\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 1\nPOINT_DATA 2\nSCALARS " + name +
                              " float 1\nLOOKUP_TABLE default\n1 2\n",
                          impossible_legacy_count),
                "");
  const std::string array = "<DataArray type=\"Float64\" NumberOfTuples=\"1\">5</DataArray>";
  for (const std::string& contents :
       {"<FieldData>" + array + "</FieldData><Piece Extent=\"0 999 0 999 0 999\" Source=\"a.vti\"/>",
        "<Piece Extent=\"0 1 0 1 0 1\"><PointData>" + array + "</PointData></Piece>"})
    EXPECT_EQ(counts_of("<VTKFile><ImageData WholeExtent=\"0 999 0 999 0 999\">" + contents + "</ImageData></VTKFile>",
                        impossible_xml_count),
              "");
}

TEST(VtkCounts, WhatNoFileOfTheSizeHoldsIsTold) {
  const auto told = [](const std::string& piece) {
    return counts_of("<VTKFile><ImageData>" + piece + "</ImageData></VTKFile>", impossible_xml_count);
  };
  EXPECT_NE(told("<Piece Extent=\"0 999 0 999 0 999\"><DataArray/></Piece>").find("1000000000 points"),
            std::string::npos);
  EXPECT_NE(told("<Piece NumberOfPoints=\"2000000000\"/>").find("NumberOfPoints 2000000000"), std::string::npos);
  EXPECT_NE(told("<DataArray NumberOfComponents=\"-9\"/>").find("-9 components"), std::string::npos);
  EXPECT_NE(counts_of("# vtk DataFile Version 3.0\nx\nPOINTS 2000000000 float\n", impossible_legacy_count)
                .find("POINTS 2000000000 float"),
            std::string::npos);
}

}  // namespace
}  // namespace tensorray
