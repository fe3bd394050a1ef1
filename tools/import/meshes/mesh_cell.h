#pragma once
/// A cell of a mesh, and its interpolation at a point in space.

#include <array>
#include <vector>

#include <Eigen/Geometry>
#include <vtkDataSet.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>

namespace tensorray {

/// Holds one three-dimensional cell at a time, of any of VTK's types. Finds parametric coordinates by Newton's method
/// on VTK's own shape functions, as VTK's EvaluatePosition stops at an error of 1e-3 in parametric coordinates and
/// takes several times as long. Polyhedra, convex point sets and prisms over polygons are divided into tetrahedra,
/// between the cell's mean point, the mean point of a face and an edge. Each mean point has the mean of the values, so
/// that linear fields are exact and cells that share a face agree on it. Threads: the mesh is only read. After a first
/// call of load() on one thread, several threads may load cells, each with its own MeshCell.
class MeshCell {
 public:
  /// The parametric coordinates that are inside, by shape: box, [0, 1]³; simplex, all >= 0 with a sum <= 1; prism, a
  /// triangle times [0, 1]; collapsed_pyramid, [0, 1]³ whose top is one point; pyramid, the square [0, 1]² below the
  /// top (1/2, 1/2, 1); tetrahedra: those of a polyhedron.
  enum class Shape { box, simplex, prism, collapsed_pyramid, pyramid, tetrahedra };

  /// If a cell lists more points than its type has (for example linear hexahedra with the middle nodes of quadratic
  /// ones), only the first ones count. @return false if the cell is not three-dimensional, is hidden, has a hidden
  /// point, or lists too few points; then call no other function.
  bool load(vtkDataSet& mesh, vtkIdType id);

  int points() const { return static_cast<int>(positions_.cols()); }
  vtkIdType point(int i) const { return cell_->GetPointId(i); }
  const Eigen::Matrix3Xd& positions() const { return positions_; }
  vtkGenericCell& vtk() const { return *cell_; }
  Shape shape() const { return shape_; }
  bool is_linear() const { return linear_; }
  /// Of a cell of `tetrahedra`: the points of each face, around it, as numbers of the cell's points.
  const std::vector<std::vector<std::size_t>>& faces() const { return faces_; }

  /// Contains the cell. For a curved cell it is larger than the box of its points.
  Eigen::AlignedBox3d box() const;
  double volume() const;
  double edge() const;  ///< Of a cube that is as large, or that is divided into such simplices or prisms.

  /// The least distance between opposite faces, after a stretch by `scale` along each axis: as if the cell were what it
  /// is at its centre. Of simplices and prisms it is √2 times that, so that a cube's tetrahedra are as thick as the
  /// cube. Of other cells, twice the least standard deviation of the points, which is the same for a box.
  double thickness(const Eigen::Vector3d& scale) const;

  /// Whether `x` is in the cell, or no farther than `tolerance` from it. weights() then returns the weights of the
  /// points at `x`.
  bool find(const Eigen::Vector3d& x, double tolerance);
  const std::vector<double>& weights() const { return weights_; }

  /// Computes weights(), position() and jacobian() at parametric coordinates, of a cell of `tetrahedra` at those of the
  /// tetrahedron `part`.
  void evaluate(const Eigen::Vector3d& p, std::size_t part = 0);
  const Eigen::Vector3d& position() const { return position_; }
  const Eigen::Matrix3d& jacobian() const { return jacobian_; }  ///< ∂ position / ∂ parametric coordinates.
  /// ∂v_i/∂x_j at point `point` of a vector that is `values` at the points; of a cell of `tetrahedra`, its mean in
  /// those that have the point. Not finite where the cell is flat.
  Eigen::Matrix3d gradient(const Eigen::Matrix3Xd& values, int point);

  std::size_t parts() const { return shape_ == Shape::tetrahedra ? tetrahedra_.size() : 1; }
  /// Derivatives of the weights where evaluate() was last: a row for each point, a column for each parametric axis.
  const Eigen::MatrixX3d& derivatives() const { return derivatives_; }

 private:
  /// How derivatives of the shape functions are had. VTK's classes store them by axis or by point. Those of some are
  /// wrong or are read beyond their arrays (VTK 9.1: Bézier tetrahedra, quadratic and triquadratic pyramids):
  /// there differences are taken.
  enum class Derivatives { by_axis, by_point, differences };

  /// One of the tetrahedra of a polyhedron: the cell's mean point, that of a face, and the ends of an edge.
  struct Tetrahedron {
    std::size_t face = 0;                  ///< Index in faces_.
    std::array<std::size_t, 2> edge = {};  ///< Indices of the cell's points.
    Eigen::Vector3d origin;                ///< The cell's mean point.
    Eigen::Matrix3d edges;                 ///< From there to the others.
  };

  struct Type {
    Shape shape = Shape::tetrahedra;
    int points = 0;  ///< Number of points of the shape functions; 0: all points of the cell.
    Derivatives derivatives = Derivatives::by_axis;
  };

  static Type type_of(int cell_type);
  void set_frame();
  void differentiate(const Eigen::Vector3d& p);
  bool solve(const Eigen::Vector3d& x, Eigen::Vector3d& p);
  Eigen::Vector3d clamped(Eigen::Vector3d p) const;
  void find_faces();
  void find_faces_of_hull();
  void make_tetrahedra();
  bool find_in_tetrahedra(const Eigen::Vector3d& x, double tolerance);

  vtkNew<vtkGenericCell> cell_;
  Shape shape_ = Shape::tetrahedra;
  Derivatives kind_ = Derivatives::by_axis;
  bool linear_ = true;
  Eigen::Matrix3Xd positions_;
  std::vector<double> weights_;
  Eigen::MatrixX3d derivatives_;
  std::vector<double> scratch_;
  std::vector<std::vector<std::size_t>> faces_;  ///< Of a polyhedron: the indices of their points.
  std::vector<Tetrahedron> tetrahedra_;
  Eigen::Vector3d position_;  ///< Result of the last evaluate().
  Eigen::Matrix3d jacobian_;

  // The affine map that agrees with the cell's map at its centre. It gives the first guess, and a box as oblique as
  // the cell.
  Eigen::Vector3d parametric_centre_, centre_;
  Eigen::Matrix3d to_frame_;
  Eigen::AlignedBox3d frame_box_;
  bool has_frame_ = false;
};

/// Whether the vtkGhostType of a point or a cell marks it as absent. Duplicates are not absent.
bool is_hidden(unsigned char ghost_type);

}  // namespace tensorray
