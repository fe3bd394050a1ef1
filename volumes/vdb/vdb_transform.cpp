#include "volumes/vdb/vdb_transform.h"

#include <cmath>
#include <cstdlib>

#include "base/errors.h"

namespace tensorray {
namespace {

constexpr double min_determinant = 1e-14;  // OpenVDB's own limit is 3e-15.

/// OpenVDB multiplies row vectors from the left, Eigen column vectors from the right.
openvdb::Mat4d to_openvdb(const Eigen::Affine3d& affine) {
  openvdb::Mat4d matrix;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) matrix(column, row) = affine.matrix()(row, column);
  return matrix;
}

Eigen::Affine3d to_eigen(const openvdb::Mat4d& matrix) {
  Eigen::Affine3d affine;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) affine.matrix()(row, column) = matrix(column, row);
  return affine;
}

double length_unit(const std::filesystem::path& path, const openvdb::GridBase& grid) {
  const auto stored = grid.getMetadata<openvdb::StringMetadata>(length_unit_key);
  if (!stored) return 1;
  char* end = nullptr;
  const double unit = std::strtod(stored->value().c_str(), &end);
  if (*end != '\0' || !(unit > 0) || !std::isfinite(unit))
    fail(path, "grid " + grid.getName() + " has a " + length_unit_key + " that is no positive number; write it again");
  return unit;
}

}  // namespace

LengthUnit length_unit_for(double determinant) {
  if (!(std::abs(determinant) < min_determinant) || determinant == 0) return {};
  const std::string text = "1e" + std::to_string(static_cast<int>(std::floor(std::log10(std::abs(determinant)) / 3)));
  return {std::stod(text), text};  // The number that a reader gets.
}

void note_unit(openvdb::GridBase& grid, const LengthUnit& unit) {
  if (unit.value != 1) grid.insertMeta(length_unit_key, openvdb::StringMetadata(unit.text));
}

void place(openvdb::GridBase& grid, const Eigen::Affine3d& to_world) {
  const LengthUnit unit = length_unit_for(to_world.linear().determinant());
  grid.setTransform(openvdb::math::Transform::createLinearTransform(
      to_openvdb(Eigen::Affine3d(to_world.matrix().topRows<3>() / unit.value))));
  note_unit(grid, unit);
}

Eigen::Affine3d placement(const std::filesystem::path& path, const openvdb::GridBase& grid) {
  if (!grid.transform().isLinear())
    fail(path, "grid " + grid.getName() + " has a transform that is not affine (a frustum); resample it first");
  Eigen::Affine3d affine = to_eigen(grid.transform().baseMap()->getAffineMap()->getMat4());
  affine.matrix().topRows<3>() *= length_unit(path, grid);
  if (!affine.matrix().allFinite() || !affine.inverse().matrix().allFinite())
    fail(path, "grid " + grid.getName() + " has a transform that cannot be inverted; give it voxels of some size");
  return affine;
}

}  // namespace tensorray
