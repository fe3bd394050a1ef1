#include "tools/import/meshes/mesh_cell.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include <Eigen/Eigenvalues>
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
  static const std::unordered_map<int, Type> types{
      {VTK_VOXEL, {Shape::box, 8}},
      {VTK_HEXAHEDRON, {Shape::box, 8}},
      {VTK_QUADRATIC_HEXAHEDRON, {Shape::box, 20}},
      {VTK_BIQUADRATIC_QUADRATIC_HEXAHEDRON, {Shape::box, 24}},
      {VTK_TRIQUADRATIC_HEXAHEDRON, {Shape::box, 27}},
      {VTK_LAGRANGE_HEXAHEDRON, {Shape::box, 0, Derivatives::by_point}},
      {VTK_BEZIER_HEXAHEDRON, {Shape::box, 0, Derivatives::by_point}},
      {VTK_TETRA, {Shape::simplex, 4}},
      {VTK_QUADRATIC_TETRA, {Shape::simplex, 10}},
      {VTK_LAGRANGE_TETRAHEDRON, {Shape::simplex, 0}},
      {VTK_BEZIER_TETRAHEDRON, {Shape::simplex, 0, Derivatives::differences}},
      {VTK_WEDGE, {Shape::prism, 6}},
      {VTK_QUADRATIC_WEDGE, {Shape::prism, 15}},
      {VTK_QUADRATIC_LINEAR_WEDGE, {Shape::prism, 12}},
      {VTK_BIQUADRATIC_QUADRATIC_WEDGE, {Shape::prism, 18}},
      {VTK_LAGRANGE_WEDGE, {Shape::prism, 0}},
      {VTK_PYRAMID, {Shape::collapsed_pyramid, 5}},
      {VTK_QUADRATIC_PYRAMID, {Shape::collapsed_pyramid, 13, Derivatives::differences}},
      {VTK_TRIQUADRATIC_PYRAMID, {Shape::pyramid, 19, Derivatives::differences}}};
  const auto found = types.find(cell_type);
  return found == types.end() ? Type() : found->second;
}

bool MeshCell::load(vtkDataSet& mesh, vtkIdType id) {
  vtkUnsignedCharArray* ghosts = mesh.GetCellGhostArray();
  if (ghosts && is_hidden(ghosts->GetValue(id))) return false;
  mesh.GetCell(id, cell_);
  if (cell_->GetCellDimension() != 3) return false;
  const Type type = type_of(cell_->GetCellType());
  const vtkIdType count = type.points > 0 ? type.points : cell_->GetNumberOfPoints();
  if (cell_->GetNumberOfPoints() < count) return false;
  if (vtkUnsignedCharArray* const hidden = mesh.GetPointGhostArray())
    for (vtkIdType i = 0; i < count; ++i)
      if (is_hidden(hidden->GetValue(cell_->GetPointId(static_cast<int>(i))))) return false;
  shape_ = type.shape;
  kind_ = type.derivatives;
  linear_ = cell_->IsLinear() != 0;
  positions_.resize(3, count);
  for (vtkIdType i = 0; i < count; ++i) cell_->Points->GetPoint(i, positions_.col(i).data());
  weights_.resize(static_cast<std::size_t>(count));
  derivatives_.resize(count, 3);
  scratch_.resize(static_cast<std::size_t>(3 * count));
  if (shape_ == Shape::tetrahedra) make_tetrahedra();
  set_frame();
  return true;
}

void MeshCell::find_faces() {
  faces_.clear();
  if (cell_->GetCellType() == VTK_CONVEX_POINT_SET) return find_faces_of_hull();
  for (int i = 0; i < cell_->GetNumberOfFaces(); ++i) {
    std::vector<std::size_t>& face = faces_.emplace_back();
    vtkIdList& ids = *cell_->GetFace(i)->GetPointIds();
    for (vtkIdType k = 0; k < ids.GetNumberOfIds(); ++k)
      face.push_back(static_cast<std::size_t>(cell_->GetPointIds()->IsId(ids.GetId(k))));
  }
}

/// VTK lists no faces of convex point sets. They are the triangles that one of the cell's tetrahedra has alone.
void MeshCell::find_faces_of_hull() {
  vtkNew<vtkIdList> ids;
  vtkNew<vtkPoints> points;
  cell_->Triangulate(0, ids, points);
  std::map<std::vector<std::size_t>, int> triangles;
  for (vtkIdType first = 0; first + 3 < ids->GetNumberOfIds(); first += 4)
    for (vtkIdType without = 0; without < 4; ++without) {
      std::vector<std::size_t> triangle;
      for (vtkIdType k = 0; k < 4; ++k)
        if (k != without) triangle.push_back(static_cast<std::size_t>(ids->GetId(first + k)));
      std::sort(triangle.begin(), triangle.end());
      ++triangles[triangle];
    }
  for (const auto& [triangle, count] : triangles)
    if (count == 1) faces_.push_back(triangle);
}

void MeshCell::make_tetrahedra() {
  find_faces();
  tetrahedra_.clear();
  const auto at = [&](std::size_t i) { return positions_.col(static_cast<Eigen::Index>(i)); };
  const Eigen::Vector3d centre = positions_.rowwise().mean();
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const std::vector<std::size_t>& face = faces_[i];
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const std::size_t corner : face) middle += at(corner) / static_cast<double>(face.size());
    for (std::size_t k = 0; k < face.size(); ++k) {
      Tetrahedron tetrahedron;
      tetrahedron.face = i;
      tetrahedron.edge = {face[k], face[(k + 1) % face.size()]};
      tetrahedron.origin = centre;
      tetrahedron.edges << middle - centre, at(tetrahedron.edge[0]) - centre, at(tetrahedron.edge[1]) - centre;
      tetrahedra_.push_back(tetrahedron);
    }
  }
}

void MeshCell::set_frame() {
  has_frame_ = false;
  if (shape_ == Shape::tetrahedra) return;
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
  if (shape_ == Shape::tetrahedra) {
    double volume = 0;
    for (const Tetrahedron& tetrahedron : tetrahedra_) volume += std::abs(tetrahedron.edges.determinant()) / 6;
    return volume;
  }
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

double MeshCell::edge() const { return std::cbrt(has_frame_ ? 1 / std::abs(to_frame_.determinant()) : volume()); }

double MeshCell::thickness(const Eigen::Vector3d& scale) const {
  if (!has_frame_) {
    const Eigen::Matrix3Xd points = scale.asDiagonal() * (positions_.colwise() - positions_.rowwise().mean());
    const Eigen::Matrix3d variance = points * points.transpose() / static_cast<double>(points.cols());
    const double least =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(variance, Eigen::EigenvaluesOnly).eigenvalues()[0];
    return 2 * std::sqrt(std::max(0.0, least));
  }
  // The gradients of the parametric coordinates: 1 / length is the distance of the faces at 0 and 1.
  const Eigen::Matrix3d gradients = to_frame_ * scale.cwiseInverse().asDiagonal();
  Eigen::Vector3d lengths = gradients.rowwise().norm();
  if (shape_ == Shape::simplex || shape_ == Shape::prism) {
    const int axes = shape_ == Shape::simplex ? 3 : 2;
    lengths[0] =
        std::max(lengths[0], gradients.topRows(axes).colwise().sum().norm());  // The face opposite to them all.
    lengths.head(axes) /= std::sqrt(2.0);
  }
  return 1 / lengths.maxCoeff();
}

void MeshCell::differentiate(const Eigen::Vector3d& p) {
  const Eigen::Index count = derivatives_.rows();
  if (kind_ == Derivatives::by_axis) return cell_->InterpolateDerivs(p.data(), derivatives_.data());
  if (kind_ == Derivatives::by_point) {
    cell_->InterpolateDerivs(p.data(), scratch_.data());
    derivatives_ = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>(scratch_.data(), 3, count).transpose();
    return;
  }
  constexpr double step = 1e-5;  // Of a central difference: its error is about 1e-10.
  const Eigen::Map<const Eigen::VectorXd> weights(scratch_.data(), count);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    derivatives_.col(axis).setZero();
    for (const double side : {-step, step}) {
      Eigen::Vector3d beside = p;
      beside[axis] += side;
      cell_->InterpolateFunctions(beside.data(), scratch_.data());
      derivatives_.col(axis) += weights / (2 * side);
    }
  }
}

void MeshCell::evaluate(const Eigen::Vector3d& p, std::size_t part) {
  if (shape_ == Shape::tetrahedra) {
    const Tetrahedron& tetrahedron = tetrahedra_[part];
    const std::vector<std::size_t>& face = faces_[tetrahedron.face];
    position_ = tetrahedron.origin + tetrahedron.edges * p;
    jacobian_ = tetrahedron.edges;
    const double mean = 1 / static_cast<double>(weights_.size()), of_face = 1 / static_cast<double>(face.size());
    std::fill(weights_.begin(), weights_.end(), (1 - p.sum()) * mean);
    derivatives_.setConstant(-mean);
    for (const std::size_t i : face) {
      weights_[i] += p.x() * of_face;
      derivatives_(static_cast<Eigen::Index>(i), 0) += of_face;
    }
    for (std::size_t k = 0; k < 2; ++k) {
      weights_[tetrahedron.edge[k]] += p[static_cast<Eigen::Index>(k + 1)];
      derivatives_(static_cast<Eigen::Index>(tetrahedron.edge[k]), static_cast<Eigen::Index>(k + 1)) += 1;
    }
    return;
  }
  cell_->InterpolateFunctions(p.data(), weights_.data());
  differentiate(p);
  position_.noalias() = positions_ * Eigen::Map<const Eigen::VectorXd>(weights_.data(), positions_.cols());
  jacobian_.noalias() = positions_ * derivatives_;
}

Eigen::Matrix3d MeshCell::gradient(const Eigen::Matrix3Xd& values, int point) {
  if (shape_ != Shape::tetrahedra) {
    Eigen::Vector3d p(cell_->GetParametricCoords() + 3 * point);
    if (shape_ == Shape::collapsed_pyramid || shape_ == Shape::pyramid) p.z() = std::min(p.z(), 1 - 1e-3);
    evaluate(p);
    return values * derivatives_ * jacobian_.inverse();
  }
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  int count = 0;
  for (std::size_t part = 0; part < tetrahedra_.size(); ++part) {
    const std::array<std::size_t, 2>& edge = tetrahedra_[part].edge;
    if (edge[0] != static_cast<std::size_t>(point) && edge[1] != static_cast<std::size_t>(point)) continue;
    evaluate(Eigen::Vector3d::Zero(), part);
    sum += values * derivatives_ * jacobian_.inverse();
    ++count;
  }
  return sum / count;
}

/// Newton's method from `p`. @return whether it converged; the solution may be outside the cell.
bool MeshCell::solve(const Eigen::Vector3d& x, Eigen::Vector3d& p) {
  constexpr int iterations = 20;
  constexpr double converged = 1e-6;  // Length of a step; the error is about its square.
  constexpr double far_away = 8;
  // At the top of a pyramid the Jacobian is singular, or the shape functions are.
  const bool has_top = shape_ == Shape::collapsed_pyramid || shape_ == Shape::pyramid;
  const double below_top = kind_ == Derivatives::differences ? 1 - 1e-4 : 1 - 1e-7;
  for (int i = 0; i < iterations; ++i) {
    if (has_top) p.z() = std::min(p.z(), below_top);
    evaluate(p);
    const Eigen::Vector3d step = jacobian_.inverse() * (x - position_);
    if (!step.allFinite()) return false;
    p += step;
    if (step.cwiseAbs().maxCoeff() < converged) return true;
    if ((p - parametric_centre_).cwiseAbs().maxCoeff() > far_away && !has_top) return false;
  }
  return has_top && p.allFinite();
}

Eigen::Vector3d MeshCell::clamped(Eigen::Vector3d p) const {
  p = p.cwiseMax(0).cwiseMin(1);
  if (shape_ == Shape::simplex) p /= std::max(1.0, p.sum());
  if (shape_ == Shape::prism) p.head<2>() /= std::max(1.0, p.head<2>().sum());
  if (shape_ == Shape::pyramid) {
    p.z() = std::max(p.z(), 0.5);
    const double half = 1 - p.z();
    p.head<2>() = p.head<2>().cwiseMax(0.5 - half).cwiseMin(0.5 + half);
  }
  return p;
}

bool MeshCell::find(const Eigen::Vector3d& x, double tolerance) {
  if (shape_ == Shape::tetrahedra) return find_in_tetrahedra(x, tolerance);
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

bool MeshCell::find_in_tetrahedra(const Eigen::Vector3d& x, double tolerance) {
  for (std::size_t part = 0; part < tetrahedra_.size(); ++part) {
    const Tetrahedron& tetrahedron = tetrahedra_[part];
    const Eigen::Vector3d p = tetrahedron.edges.inverse() * (x - tetrahedron.origin);
    if (!p.allFinite()) continue;  // It is flat.
    const Eigen::Vector3d q = p.cwiseMax(0) / std::max(1.0, p.cwiseMax(0).sum());
    if ((tetrahedron.edges * (q - p)).squaredNorm() > tolerance * tolerance) continue;
    evaluate(q, part);
    return true;
  }
  return false;
}

}  // namespace tensorray
