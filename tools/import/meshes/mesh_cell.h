#pragma once
/// @file tools/import/meshes/mesh_cell.h
/// A cell of a mesh, and the way from a point in space to the cell's interpolation. Private to the importer.

#include <vector>

#include <Eigen/Geometry>
#include <vtkDataSet.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>

namespace tensorray {

/// One three-dimensional cell at a time, of any type that VTK has. The mesh is only read: after one call of load() for
/// it on one thread, cells may be loaded on several, each thread with a MeshCell of its own.
///
/// The position is found by Newton's method on VTK's own shape functions. VTK's EvaluatePosition stops at 1e-3 in
/// parametric coordinates and takes several times as long; it is used for polyhedra alone, which have no derivatives.
class MeshCell {
 public:
  /// Of a cell that lists more points than its type has (linear hexahedra with the middle nodes of quadratic ones, say)
  /// the first count. @return false if the cell is not three-dimensional, hidden, or lists too few; then nothing else
  /// may be called.
  bool load(vtkDataSet& mesh, vtkIdType id);

  int points() const { return static_cast<int>(positions_.cols()); }
  vtkIdType point(int i) const { return cell_->GetPointId(i); }
  const Eigen::Matrix3Xd& positions() const { return positions_; }
  vtkGenericCell& vtk() const { return *cell_; }

  /// Contains the cell; that of a curved one is larger than that of its points.
  Eigen::AlignedBox3d box() const;
  double volume() const;

  /// Whether `x` is in the cell, or no farther than `tolerance` from it; weights() are then those of its points there.
  bool find(const Eigen::Vector3d& x, double tolerance);
  const std::vector<double>& weights() const { return weights_; }

 private:
  /// What parametric coordinates are inside: [0, 1]³; all >= 0 with a sum <= 1; a triangle times [0, 1]; [0, 1]³ of
  /// which the top is one point; or unknown.
  enum class Shape { box, simplex, prism, pyramid, unknown };

  struct Type {
    Shape shape = Shape::unknown;
    int points = 0;  ///< That the shape functions are of; 0: as many as the cell has.
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
  Eigen::Vector3d position_;  ///< Of the last evaluate().
  Eigen::Matrix3d jacobian_;

  // The affine map that agrees with the cell's at its middle: the first guess, and a box that is as oblique as the
  // cell.
  Eigen::Vector3d parametric_centre_, centre_;
  Eigen::Matrix3d to_frame_;
  Eigen::AlignedBox3d frame_box_;
  bool has_frame_ = false;
};

/// Whether a vtkGhostType of a point or a cell says that it is not there (duplicates are).
bool is_hidden(unsigned char ghost_type);

}  // namespace tensorray
