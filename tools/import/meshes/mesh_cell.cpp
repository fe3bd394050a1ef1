#include "tools/import/meshes/mesh_cell.h"

#include <algorithm>
#include <cmath>

#include <vtkCellType.h>
#include <vtkDataSetAttributes.h>
#include <vtkIdList.h>
#include <vtkPoints.h>
#include <vtkUnsignedCharArray.h>

namespace tensorray {
namespace {

/// How far a curved cell may extend beyond the box of its points, as a fraction of the box. A parabola through 0, 1,
/// 1 reaches 9/8; a surface that is curved in two such directions reaches twice as far.
constexpr double bulge = 0.25;

Eigen::AlignedBox3d box_of(const Eigen::Matrix3Xd& points, bool linear) {
  Eigen::AlignedBox3d box(points.rowwise().minCoeff(), points.rowwise().maxCoeff());
  if (linear) return box;
  const Eigen::Vector3d margin = bulge * box.sizes();
  return {box.min() - margin, box.max() + margin};
}

}  // namespace

bool is_hidden(unsigned char ghost_type) {
  static_assert(static_cast<int>(vtkDataSetAttributes::DUPLICATEPOINT) ==
                static_cast<int>(vtkDataSetAttributes::DUPLICATECELL));
  return (ghost_type & ~static_cast<unsigned>(vtkDataSetAttributes::DUPLICATEPOINT)) != 0;
}

MeshCell::Type MeshCell::type_of(int cell_type) {
  switch (cell_type) {
    case VTK_VOXEL:
    case VTK_HEXAHEDRON:
      return {Shape::box, 8};
    case VTK_QUADRATIC_HEXAHEDRON:
      return {Shape::box, 20};
    case VTK_BIQUADRATIC_QUADRATIC_HEXAHEDRON:
      return {Shape::box, 24};
    case VTK_TRIQUADRATIC_HEXAHEDRON:
      return {Shape::box, 27};
    case VTK_LAGRANGE_HEXAHEDRON:
    case VTK_BEZIER_HEXAHEDRON:
      return {Shape::box, 0};
    case VTK_TETRA:
      return {Shape::simplex, 4};
    case VTK_QUADRATIC_TETRA:
      return {Shape::simplex, 10};
    case VTK_LAGRANGE_TETRAHEDRON:
    case VTK_BEZIER_TETRAHEDRON:
      return {Shape::simplex, 0};
    case VTK_WEDGE:
      return {Shape::prism, 6};
    case VTK_QUADRATIC_WEDGE:
      return {Shape::prism, 15};
    case VTK_QUADRATIC_LINEAR_WEDGE:
      return {Shape::prism, 12};
    case VTK_BIQUADRATIC_QUADRATIC_WEDGE:
      return {Shape::prism, 18};
    case VTK_LAGRANGE_WEDGE:
    case VTK_BEZIER_WEDGE:
      return {Shape::prism, 0};
    case VTK_PYRAMID:
      return {Shape::pyramid, 5};
    case VTK_QUADRATIC_PYRAMID:
      return {Shape::pyramid, 13};
    default:
      return {};
  }
}

bool MeshCell::load(vtkDataSet& mesh, vtkIdType id) {
  vtkUnsignedCharArray* ghosts = mesh.GetCellGhostArray();
  if (ghosts && is_hidden(ghosts->GetValue(id))) return false;
  mesh.GetCell(id, cell_);
  if (cell_->GetCellDimension() != 3) return false;
  const Type type = type_of(cell_->GetCellType());
  const vtkIdType count = type.points > 0 ? type.points : cell_->GetNumberOfPoints();
  if (cell_->GetNumberOfPoints() < count) return false;
  shape_ = type.shape;
  linear_ = cell_->IsLinear() != 0;
  positions_.resize(3, count);
  for (vtkIdType i = 0; i < count; ++i) cell_->Points->GetPoint(i, positions_.col(i).data());
  weights_.resize(static_cast<std::size_t>(count));
  derivatives_.resize(static_cast<std::size_t>(3 * count));
  set_frame();
  return true;
}

void MeshCell::set_frame() {
  has_frame_ = false;
  if (shape_ == Shape::unknown) return;
  cell_->GetParametricCenter(parametric_centre_.data());
  evaluate(parametric_centre_);
  centre_ = position_;
  const double extent = (positions_.rowwise().maxCoeff() - positions_.rowwise().minCoeff()).norm();
  const double determinant = jacobian_.determinant();
  if (!(std::abs(determinant) > 1e-15 * extent * extent * extent)) return;
  has_frame_ = true;
  to_frame_ = jacobian_.inverse();
  frame_box_ = box_of(to_frame_ * (positions_.colwise() - centre_), linear_);
}

Eigen::AlignedBox3d MeshCell::box() const { return box_of(positions_, linear_); }

double MeshCell::volume() const {
  vtkNew<vtkIdList> ids;
  vtkNew<vtkPoints> tetrahedra;
  tetrahedra->SetDataTypeToDouble();
  cell_->Triangulate(0, ids, tetrahedra);
  double volume = 0;
  for (vtkIdType i = 0; i + 3 < tetrahedra->GetNumberOfPoints(); i += 4) {
    Eigen::Matrix<double, 3, 4> corners;
    for (int k = 0; k < 4; ++k) tetrahedra->GetPoint(i + k, corners.col(k).data());
    const Eigen::Matrix3d edges = corners.rightCols<3>().colwise() - corners.col(0);
    volume += std::abs(edges.determinant()) / 6;
  }
  return volume;
}

/// Computes the position and its derivatives at parametric coordinates.
void MeshCell::evaluate(const Eigen::Vector3d& p) {
  cell_->InterpolateFunctions(p.data(), weights_.data());
  cell_->InterpolateDerivs(p.data(), derivatives_.data());
  position_.setZero();
  jacobian_.setZero();
  const std::size_t count = weights_.size();
  for (std::size_t i = 0; i < count; ++i) {
    const auto x = positions_.col(static_cast<Eigen::Index>(i));
    position_ += weights_[i] * x;
    for (std::size_t k = 0; k < 3; ++k) jacobian_.col(static_cast<Eigen::Index>(k)) += derivatives_[k * count + i] * x;
  }
}

/// Newton's method from `p`. @return whether it converged; the solution may be outside the cell.
bool MeshCell::solve(const Eigen::Vector3d& x, Eigen::Vector3d& p) {
  constexpr int iterations = 20;
  constexpr double converged = 1e-6;  // Length of a step; the error is about its square.
  constexpr double far_away = 8;
  constexpr double below_top = 1 - 1e-7;  // The Jacobian is singular at the top of a pyramid.
  for (int i = 0; i < iterations; ++i) {
    if (shape_ == Shape::pyramid) p.z() = std::min(p.z(), below_top);
    evaluate(p);
    const Eigen::Vector3d step = jacobian_.inverse() * (x - position_);
    if (!step.allFinite()) return false;
    p += step;
    if (step.cwiseAbs().maxCoeff() < converged) return true;
    if ((p - parametric_centre_).cwiseAbs().maxCoeff() > far_away && shape_ != Shape::pyramid) return false;
  }
  return shape_ == Shape::pyramid && p.allFinite();
}

Eigen::Vector3d MeshCell::clamped(Eigen::Vector3d p) const {
  p = p.cwiseMax(0).cwiseMin(1);
  if (shape_ == Shape::simplex) p /= std::max(1.0, p.sum());
  if (shape_ == Shape::prism) p.head<2>() /= std::max(1.0, p.head<2>().sum());
  return p;
}

bool MeshCell::find(const Eigen::Vector3d& x, double tolerance) {
  if (shape_ == Shape::unknown) return find_by_vtk(x, tolerance);
  Eigen::Vector3d p = parametric_centre_;
  if (has_frame_) {
    const Eigen::Vector3d in_frame = to_frame_ * (x - centre_);
    const Eigen::Vector3d margin = tolerance * to_frame_.rowwise().norm();
    if ((in_frame.array() < (frame_box_.min() - margin).array()).any()) return false;
    if ((in_frame.array() > (frame_box_.max() + margin).array()).any()) return false;
    p = clamped(p + in_frame);
  }
  if (!solve(x, p)) {
    p = parametric_centre_;
    if (!solve(x, p)) return false;
  }
  cell_->InterpolateFunctions(clamped(p).data(), weights_.data());
  position_.setZero();
  for (std::size_t i = 0; i < weights_.size(); ++i)
    position_ += weights_[i] * positions_.col(static_cast<Eigen::Index>(i));
  return (position_ - x).squaredNorm() <= tolerance * tolerance;
}

bool MeshCell::find_by_vtk(const Eigen::Vector3d& x, double tolerance) {
  Eigen::Vector3d closest, p;
  int part = 0;
  double squared_distance = 0;
  const int status =
      cell_->EvaluatePosition(x.data(), closest.data(), part, p.data(), squared_distance, weights_.data());
  return status == 1 || (status == 0 && squared_distance <= tolerance * tolerance);
}

}  // namespace tensorray
