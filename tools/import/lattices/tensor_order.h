#pragma once
/// @file tools/import/lattices/tensor_order.h
/// The orders in which programs write a tensor's components.

#include <string>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

enum class TensorOrder {
  full,            ///< Nine: xx xy xz yx yy yz zx zy zz, row by row.
  vtk,             ///< Six: xx yy zz xy yz xz. VTK, ParaView, Ansys, CalculiX.
  fsl,             ///< Six: xx xy xz yy yz zz. FSL, NRRD. OpenFOAM's files too, but VTK hands them over as `vtk`.
  mrtrix,          ///< Six: xx yy zz xy xz yz. MRtrix.
  voigt,           ///< Six: xx yy zz yz xz xy. Continuum mechanics.
  lower_triangle,  ///< Six: xx xy yy xz yz zz. NIfTI where it says "symmetric matrix"; never asked for by name.
};

/// The names that a user may give: "vtk", "fsl", "mrtrix", "voigt".
const std::vector<std::string>& tensor_order_names();

/// @throw std::invalid_argument listing the names if unknown.
TensorOrder tensor_order_of(const std::string& name);

/// The tensor of nine (`full`) or six components. Six are those of a symmetric one.
Eigen::Matrix3d tensor_of(const double* components, TensorOrder order);

}  // namespace tensorray
