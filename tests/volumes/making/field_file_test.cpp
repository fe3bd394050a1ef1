// Fields whose bricks other processes map: the same bits, and nothing where the file is not complete.

#include "volumes/making/field_file.h"

#include <cmath>
#include <cstring>
#include <iostream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

const std::string words = "words of the program";

TensorField field_of(bool symmetric, const Interpolant& interpolant) {
  const Eigen::AlignedBox3i box(Eigen::Vector3i(-5, 3, 0), Eigen::Vector3i(16, 20, 30));
  Eigen::Affine3d to_world(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()));
  to_world.translate(Eigen::Vector3d(0.1, 7, -2));
  const auto value = [&](const Eigen::Vector3i& at) {
    Eigen::Matrix3d T;
    for (int i = 0; i < 9; ++i) T.data()[i] = std::sin(at.x() + 1.7 * i) * std::cos(0.3 * at.y() * i) + 0.1 * at.z();
    return Eigen::Matrix3d(symmetric ? Eigen::Matrix3d(T + T.transpose()) : T);
  };
  return TensorField(dense_source(box, to_world, value), interpolant);
}

bool are_same(const TensorField& a, const TensorField& b) {
  if (a.bricks() != b.bricks() || a.memory().stride != b.memory().stride || !(a.interpolant() == b.interpolant()) ||
      a.is_symmetric() != b.is_symmetric() || a.greatest_norm() != b.greatest_norm() ||
      a.to_world().matrix() != b.to_world().matrix() || a.to_index().matrix() != b.to_index().matrix() ||
      !(a.index_bounds().isApprox(b.index_bounds(), 0)) || !a.voxels().isApprox(b.voxels(), 0))
    return false;
  for (const Eigen::Vector3i& place : a.bricks()) {
    const TensorBrick one = a.brick(place), other = b.brick(place);
    if (one.strongest != other.strongest || one.trailing - one.bending != other.trailing - other.bending ||
        std::memcmp(one.bending, other.bending, a.memory().stride * sizeof(float)) != 0)
      return false;
  }
  return a.memory().floats != b.memory().floats;
}

/// @return what went wrong; empty: nothing.
std::string share_fields(const std::filesystem::path& folder) {
  bound_memory(std::size_t{256} << 20, folder);
  for (const bool symmetric : {true, false})
    for (const Interpolant& interpolant :
         {Interpolant{}, Interpolant{Interpolation::cubic, Border::fade}, {Interpolation::cubic, Border::extend}}) {
      const TensorField field = field_of(symmetric, interpolant);
      const auto in_file = [&] { return duplicate(*field.memory().file); };
      if (field_of_file(in_file())) return "the file is not complete";
      if (!complete_field_file(field, words)) return "the file cannot be completed";
      const std::optional<FieldOfFile> found = field_of_file(in_file());
      if (!found || found->words != words) return "nothing, or other words, found";
      if (!are_same(field, found->field)) return symmetric ? "another symmetric field" : "another field";
      const off_t size = lseek(in_file().get(), 0, SEEK_END);
      if (ftruncate(in_file().get(), size - 1) != 0 || field_of_file(in_file())) return "the file is cut off";
    }
  return "";
}

TEST(FieldFile, NeedsABound) { EXPECT_FALSE(complete_field_file(field_of(true, {}), words)); }

/// In a process of its own, as the bound stays.
TEST(FieldFile, IsTheSameFieldForAnotherProcess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto share = [] {
    const TemporaryFolder folder;
    std::cerr << "[" << share_fields(folder / "") << "]";
  };
  EXPECT_EXIT((share(), _exit(0)), ::testing::ExitedWithCode(0), R"(\[\])");
}

}  // namespace
}  // namespace tensorray
