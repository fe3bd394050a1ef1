#include "volumes/tensors/invariants.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/LU>
#include <tbb/parallel_for.h>

#include "base/text/text.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;

/// Norms below this fraction of the tensor's norm count as rounding errors.
constexpr double significant = 1e-6;

Matrix3d symmetric_part(const Matrix3d& tensor) { return (tensor + tensor.transpose()) / 2; }

Matrix3d deviator(const Matrix3d& tensor) { return symmetric_part(tensor) - tensor.trace() / 3 * Matrix3d::Identity(); }

double fractional_anisotropy(const Matrix3d& tensor) {
  const double norm = symmetric_part(tensor).norm();
  return norm > significant * tensor.norm() ? std::sqrt(1.5) * deviator(tensor).norm() / norm : 0;
}

double mode(const Matrix3d& tensor) {
  const Matrix3d part = deviator(tensor);
  const double norm = part.norm();
  if (norm <= significant * tensor.norm()) return 0;
  return std::clamp(3 * std::sqrt(6.0) * Matrix3d(part / norm).determinant(), -1.0, 1.0);
}

double max_shear(const Matrix3d& tensor) {
  const Eigen::Vector3cd values = eigenvalues(symmetric_part(tensor));
  return (values[0] - values[2]).real() / 2;
}

double von_mises(const Matrix3d& tensor) { return std::sqrt(1.5) * deviator(tensor).norm(); }
double vorticity(const Matrix3d& tensor) { return (tensor - tensor.transpose()).norm() / std::sqrt(2.0); }
double asymmetry(const Matrix3d& tensor) { return (tensor - tensor.transpose()).norm() / tensor.norm(); }

struct Definition {
  const char* name;
  double (*value)(const Matrix3d&);  ///< Takes a tensor whose greatest element is ±1.
  int degree;                        ///< The degree in f(c T) = c^degree f(T), for c > 0.
};

/// In the order of Invariant.
const Definition definitions[] = {
    {"norm", [](const Matrix3d& tensor) { return tensor.norm(); }, 1},
    {"trace", [](const Matrix3d& tensor) { return tensor.trace(); }, 1},
    {"determinant", [](const Matrix3d& tensor) { return tensor.determinant(); }, 3},
    {"fractional_anisotropy", fractional_anisotropy, 0},
    {"mode", mode, 0},
    {"largest_eigenvalue", [](const Matrix3d& tensor) { return eigenvalues(tensor)[0].real(); }, 1},
    {"middle_eigenvalue", [](const Matrix3d& tensor) { return eigenvalues(tensor)[1].real(); }, 1},
    {"smallest_eigenvalue", [](const Matrix3d& tensor) { return eigenvalues(tensor)[2].real(); }, 1},
    {"von_mises", von_mises, 1},
    {"max_shear", max_shear, 1},
    {"vorticity", vorticity, 1},
    {"swirling_strength", [](const Matrix3d& tensor) { return eigenvalues(tensor).imag().maxCoeff(); }, 1},
    {"asymmetry", asymmetry, 0},
};

}  // namespace

const std::vector<std::string>& invariant_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Definition& definition : definitions) all.emplace_back(definition.name);
    return all;
  }();
  return names;
}

Invariant invariant_of(const std::string& name) {
  const std::vector<std::string>& names = invariant_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<Invariant>(found - names.begin());
  throw std::invalid_argument("there is no invariant \"" + name + "\"; the invariants are: " + joined(names));
}

double invariant(Invariant which, const Matrix3d& tensor) {
  const Definition& definition = definitions[static_cast<std::size_t>(which)];
  const double largest = tensor.cwiseAbs().maxCoeff();
  if (largest == 0) return 0;
  double value = definition.value(tensor / largest);  // Scaled: squares and cubes neither overflow nor underflow.
  for (int i = 0; i < definition.degree; ++i) value *= largest;
  return std::clamp(value, std::numeric_limits<double>::lowest(), std::numeric_limits<double>::max());
}

std::string units_of_power(const std::string& units, int degree) {
  if (degree == 1 || units.empty()) return units;
  return degree == 0 ? "1" : "(" + units + ")^" + std::to_string(degree);
}

int invariant_degree(Invariant which) { return definitions[static_cast<std::size_t>(which)].degree; }

ScalarGrid invariant_grid(Invariant which, const TensorGrid& grid) {
  constexpr double greatest = std::numeric_limits<float>::max();
  ScalarGrid result;
  result.name = invariant_names()[static_cast<std::size_t>(which)];
  result.to_world = grid.to_world;
  result.metadata = grid.metadata;
  result.metadata.erase(negated_key);
  const auto units = result.metadata.find("tensorray:units");
  if (units != result.metadata.end()) units->second = units_of_power(units->second, invariant_degree(which));
  result.blocks.resize(grid.blocks.size());
  tbb::parallel_for(std::size_t{0}, grid.blocks.size(), [&](std::size_t i) {
    const TensorBlock& from = grid.blocks[i];
    ScalarBlock& to = result.blocks[i];
    to.origin = from.origin;
    to.active = from.active;
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      if (!from.active[offset]) continue;
      const double value = invariant(which, from.values[offset].cast<double>());
      to.values[offset] = static_cast<float>(std::clamp(value, -greatest, greatest));
    }
  });
  return result;
}

}  // namespace tensorray
