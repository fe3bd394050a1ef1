// Fields whose bricks other processes map: the same bits.

#include <cmath>
#include <cstring>
#include <iostream>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"
#include "renderer/meshes/mesh.h"
#include "scenes/scene/scene.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

LoadedField loaded_field(bool symmetric, const Interpolant& interpolant) {
  const Eigen::AlignedBox3i box(Eigen::Vector3i(-5, 3, 0), Eigen::Vector3i(16, 20, 30));
  Eigen::Affine3d to_world(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()));
  to_world.translate(Eigen::Vector3d(0.1, 7, -2));
  const auto value = [&](const Eigen::Vector3i& at) {
    Eigen::Matrix3d T;
    for (int i = 0; i < 9; ++i) T.data()[i] = std::sin(at.x() + 1.7 * i) * std::cos(0.3 * at.y() * i) + 0.1 * at.z();
    return Eigen::Matrix3d(symmetric ? Eigen::Matrix3d(T + T.transpose()) : T);
  };
  BlockSource source = dense_source(box, to_world, value);
  source.surface = box_mesh({Eigen::Vector3d(-6, 3, 1), Eigen::Vector3d(15, 20.5, 30)}, to_world);
  return prepare_field(source, {0, Eigenvalues::raw, interpolant}, "the field");
}

bool are_same(const TensorField& a, const TensorField& b) {
  if (a.bricks() != b.bricks() || a.memory().stride != b.memory().stride || a.interpolant() != b.interpolant() ||
      a.surface().vertices != b.surface().vertices || a.surface().triangles != b.surface().triangles ||
      a.is_symmetric() != b.is_symmetric() || a.max_norm() != b.max_norm() ||
      a.to_world().matrix() != b.to_world().matrix() || a.to_index().matrix() != b.to_index().matrix() ||
      !a.index_bounds().isApprox(b.index_bounds(), 0) || !a.voxels().isApprox(b.voxels(), 0))
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
  setenv("TMPDIR", folder.c_str(), 1);
  bound_memory(std::size_t{256} << 20, folder);
  int key = 0;
  for (const bool symmetric : {true, false})
    for (const Interpolant& interpolant :
         {Interpolant{}, Interpolant{Interpolation::cubic, Border::fade}, {Interpolation::cubic, Border::extend}}) {
      const std::string name = std::to_string(++key);
      const auto make = [&] { return loaded_field(symmetric, interpolant); };
      const auto refuse = []() -> LoadedField { throw std::logic_error("is loaded again"); };
      const LoadedField made = share_field(name, make, Progress());
      const LoadedField found = share_field(name, refuse, Progress());
      if (!are_same(made.field, found.field)) return "another field";
      if (found.notes.size() != made.notes.size() + 1 || found.notes[0] != made.notes[0]) return "other notes";
      if (ftruncate(made.field.memory().file->get(), static_cast<off_t>(made.field.memory().bytes())) != 0)
        return "cut";
      if (share_field(name, make, Progress()).notes != made.notes) return "a file that is cut off is used";
    }
  return std::filesystem::is_empty(folder) ? "" : "a file is left";
}

/// In a process of its own, as the bound stays.
TEST(SharedField, IsTheSameForAnotherProcess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto share = [] {
    const TemporaryFolder folder;
    std::cerr << "[" << share_fields(folder / "") << "]";
  };
  EXPECT_EXIT((share(), _exit(0)), ::testing::ExitedWithCode(0), R"(\[\])");
}

}  // namespace
}  // namespace tensorray
