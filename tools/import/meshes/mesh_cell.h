#pragma once
/// @file tools/import/meshes/mesh_cell.h
/// A cell of a mesh, and its interpolation at a point in space. Private to the importer.

#include <vector>

#include <Eigen/Geometry>
#include <vtkDataSet.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>

namespace tensorray {

/// Holds one three-dimensional cell at a time, of any of VTK's types. Finds parametric coordinates by Newton's method
/// on VTK's own shape functions. VTK's EvaluatePosition stops at an error of 1e-3 in parametric coordinates and takes
/// several times as long; it is used only for polyhedra, which have no derivatives.
/// Threads: the mesh is only read. After a first call of load() on one thread, several threads may load cells, each
/// with its own MeshCell.
class MeshCell {
 public:
  /// If a cell lists more points than its type has (for example linear hexahedra with the middle nodes of quadratic
  /// ones), only the first ones count. @return false if the cell is not three-dimensional, is hidden, or lists too
  /// few points; then call no other function.
  bool load(vtkDataSet& mesh, vtkIdType id);

  int points() const { return static_cast<int>(positions_.cols()); }
  vtkIdType point(int i) const { return cell_->GetPointId(i); }
  const Eigen::Matrix3Xd& positions() const { return positions_; }
  vtkGenericCell& vtk() const { return *cell_; }

  /// Contains the cell. For a curved cell it is larger than the box of its points.
  Eigen::AlignedBox3d box() const;
  double volume() const;

  /// Whether `x` is in the cell, or no farther than `tolerance` from it. weights() then returns the weights of the
  /// points at `x`.
  bool find(const Eigen::Vector3d& x, double tolerance);
  const std::vector<double>& weights() const { return weights_; }

 private:
  /// The parametric coordinates that are inside, by shape: box, [0, 1]³; simplex, all >= 0 with a sum <= 1; prism, a
  /// triangle times [0, 1]; pyramid, [0, 1]³ whose top is one point; unknown.
  enum class Shape { box, simplex, prism, pyramid, unknown };

  struct Type {
    Shape shape = Shape::unknown;
    int points = 0;  ///< Number of points of the shape functions; 0: all points of the cell.
  };

  static Type type_of(int cell_type);
  void set_frame();
  void evaluate(const Eigen::Vector3d& p);
  bool solve(const Eigen::Vector3d& x, Eigen::Vector3d& p);
  Eigen::Vector3d clamped(Eigen::Vector3d p) const;
  bool find_by_vtk(const Eigen::Vector3d& x, double tolerance);

  vtkNew<vtkGenericCell> cell_;
  Shape shape_ = Shape::unknown;
  bool linear_ = true;
  Eigen::Matrix3Xd positions_;
  std::vector<double> weights_, derivatives_;
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
