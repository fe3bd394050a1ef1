#pragma once
/// Imports files as a user does, and writes files to import. Their field consists of lumps without any symmetry.

#include <array>
#include <cstdint>
#include <cstring>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tests/import/openfoam_case.h"
#include "tests/program/support.h"
#include "volumes/files/tensor_files.h"

namespace tensorray::test {

using Arguments = std::vector<std::string>;
using nlohmann::json;

inline void for_each_voxel(const TensorGrid& grid,
                           const std::function<void(const Vector3i&, const Eigen::Matrix3f&)>& visit) {
  for (const TensorBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      if (block.active[offset]) visit(block.origin + TensorBlock::position(offset), block.values[offset]);
}

/// Expects the same voxels with the same numbers, bit for bit.
inline void expect_same(const TensorGrid& a, const TensorGrid& b) {
  EXPECT_LT((a.to_world.matrix() - b.to_world.matrix()).norm(), 1e-12 * a.to_world.matrix().norm());
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (std::size_t i = 0; i < a.blocks.size(); ++i) {
    ASSERT_EQ(a.blocks[i].origin, b.blocks[i].origin);
    ASSERT_EQ(a.blocks[i].active, b.blocks[i].active);
    for (int offset = 0; offset < TensorBlock::voxels; ++offset)
      ASSERT_EQ(a.blocks[i].values[offset], b.blocks[i].values[offset]) << a.blocks[i].origin.transpose();
  }
}

template <class Number>
inline std::string bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

class Import : public Program {
 protected:
  /// Imports into FIELD.vdb. @return the report of `info` on the field.
  json import(Arguments arguments, const std::string& field) {
    arguments.insert(arguments.begin(), "import");
    arguments.insert(arguments.end(), {"-q", "-o", field + ".vdb"});
    imported_ = run_well(arguments);
    return info(field);
  }
  json info(const std::string& field) const {
    const json all = json::parse(run_well({"info", field + ".vdb", "--json"}).out);
    return all["fields"][0];
  }
  TensorGrid field(const std::string& name) const { return read_tensor_vdb(in_folder(name + ".vdb")); }

  /// Expects `status`, one line that contains `parts`, and that all files stay unchanged, also an older output.
  void refuses(const Arguments& arguments, int status, const std::vector<std::string>& parts) const {
    write("old.vdb", " BDV, which was there before");
    const auto before = files();
    Arguments all{"import", "-q", "-o", "old.vdb"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const Outcome outcome = run(all);
    const std::string trace = fmt::format("{}: {}", fmt::join(arguments, " "), outcome.error);
    EXPECT_EQ(outcome.status, status) << trace;
    EXPECT_EQ(outcome.out, "") << trace;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << trace;
    for (const std::string& part : parts)
      EXPECT_NE(outcome.error.find(part), std::string::npos) << part << "\n" << trace;
    EXPECT_EQ(files(), before) << trace;
    EXPECT_TRUE(read_file(in_folder("old.vdb")) == " BDV, which was there before") << trace;
  }

  Outcome imported_;  ///< Result of the last import.
};

inline double at(const json& value, const char* group, const char* key) { return value[group][key].get<double>(); }

inline void expect_extent(const json& field, const Vector3d& min, const Vector3d& max, double tolerance) {
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(field["world_extent"]["min"][axis].get<double>(), min[axis], tolerance) << "axis " << axis;
    EXPECT_NEAR(field["world_extent"]["max"][axis].get<double>(), max[axis], tolerance) << "axis " << axis;
  }
}

inline Vector3i voxels_of(const json& field) {
  Vector3i size;
  for (int axis = 0; axis < 3; ++axis)
    size[axis] = field["index_extent"]["max"][axis].get<int>() - field["index_extent"]["min"][axis].get<int>() + 1;
  return size;
}

constexpr int lump_size[3] = {18, 14, 12};
inline const Vector3i lumps_size(lump_size[0], lump_size[1], lump_size[2]);

/// The field of lumps. @param p  Position relative to the centre of the lattice.
/// @return A symmetric tensor that is nowhere zero.
inline Matrix3d lumps(const Vector3d& p) {
  Matrix3d a, b, c;
  a << 0.2, 0.1, 0.35, 0.1, -0.1, 0.15, 0.35, 0.15, 0.3;
  b << -0.3, 0.2, -0.2, 0.2, 0.2, 0.3, -0.2, 0.3, 0.1;
  c << 0.1, -0.3, 0.1, -0.3, 0.4, -0.25, 0.1, -0.25, -0.2;
  const auto lump = [&](double x, double y, double z, double width) {
    return std::exp(-(p - Vector3d(x, y, z)).squaredNorm() / (width * width));
  };
  return a * lump(-3, 2, 1, 4) + b * lump(4, -2.5, -2, 3) + c * lump(1, 3, 0, 5);
}

/// Calls `put(tensor)` for every voxel, x fastest.
template <class Put>
inline void for_lumps(const Put& put) {
  for (int z = 0; z < lumps_size.z(); ++z)
    for (int y = 0; y < lumps_size.y(); ++y)
      for (int x = 0; x < lumps_size.x(); ++x)
        put(lumps(Vector3d(x, y, z) - 0.5 * (lumps_size.cast<double>() - Vector3d::Ones())));
}

/// The nine components of all tensors, row by row.
inline std::vector<float> lump_components() {
  std::vector<float> numbers;
  for_lumps([&](const Matrix3d& tensor) {
    for (int i = 0; i < 9; ++i) numbers.push_back(static_cast<float>(tensor(i / 3, i % 3)));
  });
  return numbers;
}

/// A VTK image in ASCII XML with nine components in world axes.
inline std::string vti(const Vector3i& size, const Vector3d& origin, const Vector3d& spacing, const Matrix3d& direction,
                       const std::vector<float>& numbers) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = direction;
  const auto extent = fmt::format("0 {} 0 {} 0 {}", size.x() - 1, size.y() - 1, size.z() - 1);
  std::string values;
  for (const float number : numbers) values += fmt::format("{:.9g} ", number);
  return fmt::format(
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\"><ImageData WholeExtent=\"{}\" "
      "Origin=\"{:.17g} {:.17g} {:.17g}\" Spacing=\"{:.17g} {:.17g} {:.17g}\" Direction=\"{:.17g}\"><Piece "
      "Extent=\"{}\">"
      "<PointData Tensors=\"lumps\"><DataArray type=\"Float32\" Name=\"lumps\" NumberOfComponents=\"9\" "
      "format=\"ascii\">{}</DataArray></PointData></Piece></ImageData></VTKFile>",
      extent, origin.x(), origin.y(), origin.z(), spacing.x(), spacing.y(), spacing.z(),
      fmt::join(rows.data(), rows.data() + 9, " "), extent, values);
}

/// The header that numpy.save writes for 32-bit floats.
inline std::string npy_header(const std::string& shape) {
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + shape + "), }";
  header.resize(117, ' ');
  return std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + "\n";
}

}  // namespace tensorray::test
