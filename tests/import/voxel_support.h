#pragma once
/// Temporary files of voxels, the data sets, and checks of the results.

#include <array>
#include <cstring>
#include <functional>
#include <optional>

#include <zlib.h>

#include "tests/import/mesh_files.h"
#include "tests/volumes/grid_support.h"
#include "tools/import/lattices/lattice.h"

namespace tensorray::test {

template <class Number>
std::string bytes_of(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

/// As a file of gzip.
inline std::string gzipped(const std::string& bytes) {
  const Temporary file("packed.gz");
  const gzFile out = gzopen(file.c_str(), "wb");
  gzwrite(out, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(out);
  return tensorray::bytes_of(file);
}

/// The components of a symmetric tensor: xx xy xz yy yz zz; and of any one, row by row.
inline std::vector<float> upper_triangle(const Matrix3d& tensor) {
  const Matrix3f t = tensor.cast<float>();
  return {t(0, 0), t(0, 1), t(0, 2), t(1, 1), t(1, 2), t(2, 2)};
}
inline std::vector<float> rows(const Matrix3d& tensor) {
  const Matrix3f columns = tensor.transpose().cast<float>();
  return {columns.data(), columns.data() + 9};
}

inline Matrix3d symmetric(const std::array<double, 6>& c) {
  return (Matrix3d() << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5]).finished();
}

/// Reverses the bytes of a number.
template <class Number>
Number swapped(Number number) {
  auto* bytes = reinterpret_cast<char*>(&number);
  std::reverse(bytes, bytes + sizeof number);
  return number;
}

inline TensorGrid tensors_of(const Lattice& lattice, std::optional<TensorOrder> order = {}) {
  LatticeReport report;
  return tensors_of(lattice, order, report);
}

/// The tensor of the first voxel of a file; NaN if it is inactive.
inline Matrix3d first_tensor(const TensorGrid& grid) {
  const Matrix3f* const tensor = find(grid, {0, 0, 0});
  return tensor ? Matrix3d(tensor->cast<double>()) : Matrix3d(Matrix3d::Constant(NAN));
}

/// Expects an exception of any type with a one-line message that contains `words`.
inline void expect_error(const std::function<void()>& run, const std::vector<std::string>& words) {
  const std::string text = message(run);
  EXPECT_NE(text, "nothing was thrown");
  for (const std::string& word : words) EXPECT_THAT(text, HasSubstr(word));
}

/// Expects that a file with these bytes is refused, in one line with its name and `words`.
inline void refuses(Lattice (*open)(const std::filesystem::path&, bool), const std::string& name,
                    const std::string& bytes, std::vector<std::string> words = {}) {
  SCOPED_TRACE(std::to_string(bytes.size()) + " bytes: " + testing::PrintToString(bytes.substr(0, 400)));
  const Temporary file(name, bytes);
  words.insert(words.begin(), name);
  expect_error([&] { tensors_of(open(file, false), TensorOrder::fsl); }, words);
}

inline Matrix3d rotation() { return Eigen::AngleAxisd(0.7, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix(); }

/// A symmetric tensor that no permutation of the axes leaves unchanged.
inline Matrix3d symmetric_tensor() { return symmetric({1.5, 0.25, -0.5, 0.75, 0.125, 2}); }

inline Matrix3d general_tensor() {
  return (Matrix3d() << 0.5, -1.25, 0.375, 0.75, -0.5, 1.0, -0.25, 0.625, 0.25).finished();
}

inline void expect_near(const Matrix3d& expected, const Matrix3f* found, double tolerance = 1e-6) {
  ASSERT_NE(found, nullptr);
  EXPECT_LT((found->cast<double>() - expected).norm(), tolerance * expected.norm()) << *found << "\nnot\n" << expected;
}

}  // namespace tensorray::test
