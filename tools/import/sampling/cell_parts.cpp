// Parts are boxes of collapsed coordinates, in [0, 1]³, which reach from a simplex's or prism's own parametric
// coordinates to those of a cube. A box is divided in two along its longest edge until it is small enough. Along each
// collapsed axis c volume has a density (1 − c)^k. Its integral and mean over an interval have closed forms, which give
// each part its exact volume and centroid, also if the part is a whole cell.

#include "tools/import/sampling/cell_parts.h"

#include <array>
#include <cmath>

namespace tensorray {
namespace {

using Eigen::Array3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Shape = MeshCell::Shape;

struct Piece {
  Array3d from = Array3d::Zero(), to = Array3d::Ones();
};

/// The power of (1 − c) in the density along each collapsed axis.
std::array<int, 3> powers(Shape shape) {
  if (shape == Shape::simplex) return {0, 1, 2};
  if (shape == Shape::prism) return {0, 1, 0};
  return {0, 0, shape == Shape::collapsed_pyramid || shape == Shape::pyramid ? 2 : 0};
}

double power(double x, int exponent) { return exponent == 0 ? 1 : x * power(x, exponent - 1); }

/// ∫ (1 − c)^k dc over an interval.
double mass(int k, double from, double to) { return (power(1 - from, k + 1) - power(1 - to, k + 1)) / (k + 1); }

/// The mean of c over the interval with the density (1 − c)^k.
double mean(int k, double from, double to) {
  return k == 0 ? 0.5 * (from + to) : 1 - mass(k + 1, from, to) / mass(k, from, to);
}

/// Parametric coordinates at collapsed ones; `tangents` are the derivatives.
Vector3d parametric(Shape shape, const Array3d& c, Matrix3d& tangents) {
  const double u = c[0], v = 1 - c[1], w = 1 - c[2];
  tangents.setIdentity();
  switch (shape) {
    case Shape::simplex:
      tangents << v * w, -u * w, -u * v, 0, w, -c[1], 0, 0, 1;
      return {u * v * w, c[1] * w, c[2]};
    case Shape::prism:
      tangents << v, -u, 0, 0, 1, 0, 0, 0, 1;
      return {u * v, c[1], c[2]};
    case Shape::pyramid:
      tangents << w, 0, 0.5 - u, 0, w, 0.5 - c[1], 0, 0, 0.5;
      return {0.5 + (u - 0.5) * w, 0.5 + (c[1] - 0.5) * w, 0.5 + 0.5 * c[2]};
    default:
      return c.matrix();
  }
}

class Divider {
 public:
  Divider(MeshCell& cell, std::size_t part, const Vector3d& longest, const Eigen::AlignedBox3d& where,
          const std::function<void(const CellPart&)>& visit)
      : cell_(cell),
        part_(part),
        shape_(cell.shape() == Shape::tetrahedra ? Shape::simplex : cell.shape()),
        powers_(powers(shape_)),
        longest_(cell.shape() == Shape::box && cell.is_linear() ? 1.0 * longest : 0.5 * longest),
        where_(where),
        visit_(visit),
        weights_(4, cell.points()) {}

  void divide(const Piece& piece) {
    Array3d centre;
    double volume = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      centre[axis] = mean(powers_[k], piece.from[axis], piece.to[axis]);
      volume *= mass(powers_[k], piece.from[axis], piece.to[axis]);
    }
    Matrix3d tangents;
    cell_.evaluate(parametric(shape_, centre, tangents), part_);
    tangents *= (piece.to - piece.from).matrix().asDiagonal();
    const Matrix3d edges = cell_.jacobian() * tangents;
    const Eigen::RowVector3d lengths = (longest_.cwiseInverse().asDiagonal() * edges).colwise().norm();
    Eigen::Index axis = 0;
    const bool is_part = !(lengths.maxCoeff(&axis) > rounded_one);
    // A part is affine. A larger piece may reach twice as far, because edges that are not parallel differ in length.
    const Vector3d reach = (is_part ? 0.5 : 1.0) * edges.cwiseAbs().rowwise().sum();
    if (!where_.intersects(Eigen::AlignedBox3d(cell_.position() - reach, cell_.position() + reach))) return;
    if (is_part) return visit_part(volume, centre, edges, tangents);
    Piece first = piece, second = piece;
    first.to[axis] = second.from[axis] = 0.5 * (piece.from[axis] + piece.to[axis]);
    divide(first);
    divide(second);
  }

 private:
  static constexpr double rounded_one = 1 + 1e-6;

  void visit_part(double volume, const Array3d& centre, const Matrix3d& edges, const Matrix3d& tangents) {
    if (shape_ == Shape::pyramid) volume *= 0.5;  // Its height.
    // The Jacobian of VTK's collapsed pyramids has the density in itself.
    if (shape_ == Shape::collapsed_pyramid) volume /= (1 - centre[2]) * (1 - centre[2]);
    volume *= std::abs(cell_.jacobian().determinant());
    weights_.row(0) = Eigen::Map<const Eigen::RowVectorXd>(cell_.weights().data(), weights_.cols());
    weights_.bottomRows<3>().noalias() = tangents.transpose() * cell_.derivatives().transpose();
    if (volume > 0) visit_({cell_.position(), volume, edges, weights_});
  }

  MeshCell& cell_;
  std::size_t part_;
  Shape shape_;
  std::array<int, 3> powers_;
  Vector3d longest_;
  const Eigen::AlignedBox3d& where_;
  const std::function<void(const CellPart&)>& visit_;
  Eigen::Matrix4Xd weights_;
};

}  // namespace

void visit_parts(MeshCell& cell, const Vector3d& longest, const Eigen::AlignedBox3d& where,
                 const std::function<void(const CellPart&)>& visit) {
  for (std::size_t part = 0; part < cell.parts(); ++part) Divider(cell, part, longest, where, visit).divide({});
}

}  // namespace tensorray
