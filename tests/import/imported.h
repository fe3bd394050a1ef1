#pragma once
/// What is imported of a file.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/process/progress.h"
#include "tests/import/mesh_fixtures.h"
#include "tools/import/import_file.h"

namespace tensorray {

struct Imported {
  TensorGrid grid;
  ImportReport report;

  std::size_t voxels() const { return grid.active_voxels(); }

  /// The tensor of all voxels, which must be the same but for `tolerance`.
  Matrix3d tensor(double tolerance = 1e-5) const {
    Matrix3d first = Matrix3d::Constant(NAN);
    mesh_fixtures::for_each_voxel(grid, [&](const auto&, const Matrix3d& value) {
      if (first.hasNaN()) first = value;
      EXPECT_LT((value - first).norm(), tolerance);
    });
    return first;
  }

  std::string notes() const { return fmt::format("{}", fmt::join(report.notes, "\n")); }
  std::string warnings() const { return fmt::format("{}", fmt::join(report.warnings, "\n")); }
};

inline Imported imported(const ImportSettings& settings) {
  Imported result;
  result.grid = import_tensors(settings, Progress(), result.report);
  return result;
}

inline Imported imported(const std::filesystem::path& file, ImportSettings settings = {}) {
  settings.files = {file};
  return imported(settings);
}

/// The settings of an array, and of voxels of a size if one is given, and a step.
inline ImportSettings array_settings(const std::string& array, Take take = Take::tensor, double voxel = 0,
                                     std::optional<int> step = {}) {
  ImportSettings settings;
  settings.array = array;
  settings.take = take;
  settings.step = step;
  if (voxel > 0) settings.sampling.resolution = voxel;
  return settings;
}

}  // namespace tensorray
