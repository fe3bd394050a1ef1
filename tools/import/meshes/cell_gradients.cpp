#include "tools/import/meshes/cell_gradients.h"

#include <limits>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDoubleArray.h>
#include <vtkIdList.h>
#include <vtkNew.h>

#include "tools/import/meshes/cell_graph.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Step = Eigen::Vector3d;
using Gradient = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using Curvature = Eigen::Matrix<double, 9, 3>;  ///< Row 3 i + j, column k: ∂²v_i/∂x_j∂x_k.

/// A difference that a gradient is fitted to: from a cell to another, or to a wall of its own.
struct Difference {
  std::size_t cell;
  const Wall* wall;  ///< Null: to the cell.
  Step factor;       ///< The gradient is the sum of the differences times the factors.
};

using Differences = std::vector<Difference>;

/// From the centre of a cell.
Step step_of(const CellGraph& graph, std::size_t id, const Difference& one) {
  if (!one.wall) return graph.centres[one.cell] - graph.centres[id];
  const Step step = one.wall->centre - graph.centres[id];
  return one.wall->kind == Wall::Kind::value ? step : Step(one.wall->normal * one.wall->normal.dot(step));
}

/// Sets the factors. @return the least eigenvalue of the fit: the differences along its axis.
double fit(const CellGraph& graph, std::size_t id, Differences& differences) {
  Matrix3d matrix = Matrix3d::Zero();
  for (Difference& one : differences) {
    const Step step = step_of(graph, id, one);
    if (step.squaredNorm() > 0) one.factor = step / step.squaredNorm();
    matrix += step * one.factor.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(matrix);
  const double none = 1e-6 * solver.eigenvalues()[2];
  Step inverse = Step::Zero();
  for (int k = 0; k < 3; ++k)
    if (solver.eigenvalues()[k] > none) inverse[k] = 1 / solver.eigenvalues()[k];
  const Matrix3d pseudo_inverse = solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose();
  for (Difference& one : differences) one.factor = pseudo_inverse * one.factor;
  return solver.eigenvalues()[0];
}

/// The differences of gradients, and those of vectors, of a cell.
struct Stencil {
  Differences cells, all;  ///< `all` is empty if there are no walls: the same as `cells`.
  const Differences& of_vectors() const { return all.empty() ? cells : all; }
};

Stencil stencil_of(vtkDataSet& mesh, const CellGraph& graph, std::size_t id) {
  constexpr double enough = 0.3;  // A corner of a grid of boxes has 1, as directions have unit length.
  const auto fitted_to = [&](bool with_walls) {
    Differences differences;
    for (const bool widened : {false, true}) {
      differences.clear();
      const std::vector<vtkIdType> others =
          widened ? cells_around(mesh, graph, static_cast<vtkIdType>(id)) : graph.neighbours[id];
      differences.reserve(others.size() + (with_walls ? graph.walls[id].size() : 0));
      for (const vtkIdType other : others)
        differences.push_back({static_cast<std::size_t>(other), nullptr, Step::Zero()});
      if (with_walls)
        for (const Wall& wall : graph.walls[id]) differences.push_back({id, &wall, Step::Zero()});
      if (fit(graph, id, differences) >= enough) break;
    }
    return differences;
  };
  return {fitted_to(false), graph.walls[id].empty() ? Differences() : fitted_to(true)};
}

/// The vector's difference without what its curvature adds.
Step difference(const Difference& one, const Step& step, const Eigen::Map<const Eigen::Matrix3Xd>& vectors,
                const Step& from, const Curvature& curvature) {
  const Eigen::Matrix<double, 9, 1> change = curvature * step;
  const Step bend = Eigen::Map<const Gradient>(change.data()) * step;
  if (!one.wall) return vectors.col(static_cast<Eigen::Index>(one.cell)) - from - 0.5 * bend;
  const Wall& wall = *one.wall;
  if (wall.kind == Wall::Kind::value) return wall.value - from - 0.5 * bend;
  // Without a gradient at the wall, that of the cell is all of the bend.
  if (wall.kind == Wall::Kind::zero_gradient) return -bend;
  return wall.normal * wall.normal.dot(0.5 * bend - from) - bend;
}

struct Fields {
  std::vector<Gradient> gradients;
  std::vector<Curvature> curvatures;
};

Curvature curvature_of(const Stencil& stencil, const std::vector<Gradient>& gradients, std::size_t id) {
  Curvature sum = Curvature::Zero();
  for (const Difference& one : stencil.cells) {
    const Gradient change = gradients[one.cell] - gradients[id];
    sum.noalias() += Eigen::Map<const Eigen::Matrix<double, 9, 1>>(change.data()) * one.factor.transpose();
  }
  return sum;
}

/// Fits gradients and curvatures in turn. Where the gradient of a cell changes more than the last time, it is kept.
Fields fitted(const CellGraph& graph, const std::vector<Stencil>& stencils,
              const Eigen::Map<const Eigen::Matrix3Xd>& vectors) {
  constexpr int rounds = 10;  // Beside a border without a wall, each leaves half of the error.
  const std::size_t count = stencils.size();
  Fields fields{std::vector<Gradient>(count, Gradient::Zero()), std::vector<Curvature>(count, Curvature::Zero())};
  std::vector<double> changes(count, std::numeric_limits<double>::infinity());
  for (int round = 0; round < rounds; ++round) {
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t id) {
      Gradient sum = Gradient::Zero();
      const Step from = vectors.col(static_cast<Eigen::Index>(id));
      for (const Difference& one : stencils[id].of_vectors())
        sum.noalias() +=
            difference(one, step_of(graph, id, one), vectors, from, fields.curvatures[id]) * one.factor.transpose();
      const double change = (sum - fields.gradients[id]).norm();
      if (!(change <= changes[id])) return;
      if (round > 0) changes[id] = change;  // The first one is the gradient itself.
      fields.gradients[id] = sum;
    });
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t id) {
      if (graph.used[id]) fields.curvatures[id] = curvature_of(stencils[id], fields.gradients, id);
    });
  }
  return fields;
}

vtkSmartPointer<vtkDoubleArray> empty_gradients(vtkIdType count) {
  auto array = vtkSmartPointer<vtkDoubleArray>::New();
  array->SetNumberOfComponents(9);
  array->SetNumberOfTuples(count);
  array->Fill(std::numeric_limits<double>::quiet_NaN());
  return array;
}

Eigen::Map<Gradient> gradient_in(vtkDoubleArray& array, vtkIdType id) {
  return Eigen::Map<Gradient>(array.GetPointer(9 * id));
}

CellGradients to_points(vtkDataSet& mesh, const CellGraph& graph, const Fields& fields) {
  CellGradients result{empty_gradients(mesh.GetNumberOfCells()), empty_gradients(mesh.GetNumberOfPoints())};
  std::vector<int> counts(static_cast<std::size_t>(mesh.GetNumberOfPoints()), 0);
  vtkNew<vtkIdList> points;
  for (std::size_t id = 0; id < graph.used.size(); ++id) {
    if (!graph.used[id]) continue;
    gradient_in(*result.of_cells, static_cast<vtkIdType>(id)) = fields.gradients[id];
    mesh.GetCellPoints(static_cast<vtkIdType>(id), points);
    for (const vtkIdType point : *points) {
      const Step step = Step(mesh.GetPoint(point)) - graph.centres[id];
      const Eigen::Matrix<double, 9, 1> change = fields.curvatures[id] * step;
      auto sum = gradient_in(*result.of_points, point);
      if (counts[static_cast<std::size_t>(point)]++ == 0) sum.setZero();
      sum += fields.gradients[id] + Eigen::Map<const Gradient>(change.data());
    }
  }
  for (vtkIdType point = 0; point < mesh.GetNumberOfPoints(); ++point)
    if (counts[static_cast<std::size_t>(point)] > 0)
      gradient_in(*result.of_points, point) /= counts[static_cast<std::size_t>(point)];
  return result;
}

}  // namespace

CellGradients cell_gradients(vtkDataSet& mesh, vtkDataArray& vectors) {
  vtkNew<vtkDoubleArray> numbers;
  numbers->DeepCopy(&vectors);
  const CellGraph graph = cell_graph(mesh, *numbers);
  std::vector<Stencil> stencils(graph.centres.size());
  tbb::parallel_for(std::size_t{0}, stencils.size(), [&](std::size_t id) {
    if (graph.used[id]) stencils[id] = stencil_of(mesh, graph, id);
  });
  const Eigen::Map<const Eigen::Matrix3Xd> values(numbers->GetPointer(0), 3, numbers->GetNumberOfTuples());
  return to_points(mesh, graph, fitted(graph, stencils, values));
}

}  // namespace tensorray
