#pragma once
/// Imports files as a user does, and writes files to import. Their field consists of lumps without any symmetry.

#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tests/import/openfoam_case.h"
#include "tests/program/support.h"
#include "volumes/files/tensor_files.h"

namespace tensorray::test {

template <class Number>
inline std::string bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

class Import : public Program {
 protected:
  /// Imports into FIELD.vdb. @return the report of `info` on the field.
  json import(const Arguments& arguments, const std::string& field) {
    imported_ = run_well(joined({"import", "-q", "-o", field + ".vdb"}, arguments));
    return json::parse(run_well({"info", field + ".vdb", "--json"}).out)["fields"][0];
  }

  /// Expects `status`, one line that contains `parts`, and that all files stay unchanged, also an older output.
  void refuses(const Arguments& arguments, int status, const std::vector<std::string>& parts) const {
    const std::string old = " BDV, which was there before";
    write("old.vdb", old);
    const auto before = files();
    const Outcome outcome = run(joined({"import", "-q", "-o", "old.vdb"}, arguments));
    SCOPED_TRACE(fmt::format("{}: {}", fmt::join(arguments, " "), outcome.error));
    expect_one_line(outcome, "", status);
    for (const std::string& part : parts) EXPECT_THAT(outcome.error, HasSubstr(part));
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(files(), before);
    EXPECT_EQ(contents("old.vdb"), old);
  }

  Outcome imported_;  ///< Result of the last import.
};

/// The size of a lattice along x, y and z.
inline const Vector3i lattice(18, 14, 12);

/// Nine components of the tensors of `voxels` voxels. Files of them do not get small.
inline std::vector<float> components(int voxels) {
  std::vector<float> numbers;
  for (std::uint32_t i = 0; i < 9 * static_cast<std::uint32_t>(voxels); ++i)
    numbers.push_back(static_cast<float>(1 + i * 2654435761u % 1021) / 3);
  return numbers;
}

/// A VTK image in ASCII XML with nine components.
inline std::string vti(const Vector3i& size, const std::vector<float>& numbers) {
  return fmt::format(
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\"><ImageData WholeExtent=\"{0}\" "
      "Origin=\"0 0 0\" Spacing=\"1 1 1\"><Piece Extent=\"{0}\"><PointData><DataArray type=\"Float32\" "
      "Name=\"lumps\" NumberOfComponents=\"9\" format=\"ascii\">{1}</DataArray></PointData></Piece></ImageData>"
      "</VTKFile>",
      fmt::format("0 {} 0 {} 0 {}", size.x() - 1, size.y() - 1, size.z() - 1), fmt::join(numbers, " "));
}

/// An array as numpy.save writes it, of 32-bit floats. @param shape  Of the tensors: "4, 3, 2" along z, y and x.
inline std::string npy(const std::string& shape, const std::vector<float>& numbers) {
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + shape + ", 3, 3), }";
  header.resize(117, ' ');
  return std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + "\n" + bytes_of(numbers);
}

}  // namespace tensorray::test
