#include "tools/import/vtk_formats/image_lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

namespace tensorray {
namespace {

/// The arrays of the image, whose slices are freed as they are read.
struct Source {
  vtkSmartPointer<vtkDataArray> values;
  std::vector<bool> hidden;  ///< Of each voxel; empty if none is.
  vtkIdType slice = 0;       ///< Voxels per slice.
};

Eigen::Vector3i size_of(vtkImageData& image, bool of_cells) {
  Eigen::Vector3i size(image.GetDimensions());
  if (of_cells) size = (size.array() - 1).max(1);  // along an axis with one point, VTK's cells are flat
  return size;
}

/// The edges of a voxel, as columns. If a flat image has no thickness, its thinnest other edge is used.
Eigen::Matrix3d edges_of(vtkImageData& image) {
  Eigen::Vector3d spacing(image.GetSpacing());
  double thinnest = std::numeric_limits<double>::infinity();
  for (const double edge : spacing)
    if (edge != 0) thinnest = std::min(thinnest, std::abs(edge));
  for (int axis = 0; axis < 3; ++axis)
    if (spacing[axis] == 0 && image.GetDimensions()[axis] == 1) spacing[axis] = thinnest;
  const double* const direction = image.GetDirectionMatrix()->GetData();
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(direction) * spacing.asDiagonal();
}

Eigen::Affine3d to_world_of(vtkImageData& image, bool of_cells) {
  Eigen::Vector3d first;
  for (int axis = 0; axis < 3; ++axis)
    first[axis] = image.GetExtent()[2 * axis] + (of_cells && image.GetDimensions()[axis] > 1 ? 0.5 : 0.0);
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  to_world.linear() = edges_of(image);
  to_world.translation() = Eigen::Map<const Eigen::Vector3d>(image.GetOrigin()) + to_world.linear() * first;
  const double volume = to_world.linear().determinant();
  if (volume == 0 || !std::isfinite(volume) || !to_world.translation().allFinite())
    throw std::runtime_error("the image's spacing, direction or origin is zero or not finite; write it again");
  return to_world;
}

/// Cells that are hidden or have a hidden point; or points that are hidden or have hidden cells alone.
std::vector<bool> hidden_voxels(vtkImageData& image, bool of_cells) {
  vtkUnsignedCharArray* const cells = image.GetCellGhostArray();
  vtkUnsignedCharArray* const points = image.GetPointGhostArray();
  if (!cells && !points) return {};
  constexpr unsigned char hidden_cell = vtkDataSetAttributes::HIDDENCELL | vtkDataSetAttributes::REFINEDCELL;
  const auto is_hidden_point = [&](vtkIdType i) {
    return points && (points->GetValue(i) & vtkDataSetAttributes::HIDDENPOINT) != 0;
  };
  std::vector<bool> hidden(static_cast<std::size_t>(of_cells ? image.GetNumberOfCells() : image.GetNumberOfPoints()),
                           !of_cells);
  vtkNew<vtkIdList> corners;
  for (vtkIdType cell = 0; cell < image.GetNumberOfCells(); ++cell) {
    const bool is_hidden = cells && (cells->GetValue(cell) & hidden_cell) != 0;
    image.GetCellPoints(cell, corners);
    for (vtkIdType i = 0; i < corners->GetNumberOfIds(); ++i) {
      const vtkIdType point = corners->GetId(i);
      if (of_cells && (is_hidden || is_hidden_point(point))) hidden[static_cast<std::size_t>(cell)] = true;
      if (!of_cells && !is_hidden && !is_hidden_point(point)) hidden[static_cast<std::size_t>(point)] = false;
    }
  }
  return hidden;
}

void read_slice(Source& source, int z, double* out) {
  const vtkIdType begin = z * source.slice, end = begin + source.slice;
  vtkDataArray& values = *source.values;
  if (end > values.GetNumberOfTuples())
    throw std::logic_error("read_slice: slices are read once, from the last to the first");
  const int components = values.GetNumberOfComponents();
  for (vtkIdType i = begin; i < end; ++i, out += components) {
    values.GetTuple(i, out);
    if (!source.hidden.empty() && source.hidden[static_cast<std::size_t>(i)])
      std::fill(out, out + components, std::numeric_limits<double>::quiet_NaN());
  }
  // Resize keeps the front of the array, and returns whole pages to the system.
  if (values.GetReferenceCount() == 1) values.Resize(begin);
}

}  // namespace

Lattice lattice_of(vtkSmartPointer<vtkImageData> image, vtkSmartPointer<vtkDataArray> values, bool of_cells) {
  Lattice lattice;
  lattice.size = size_of(*image, of_cells);
  lattice.to_world = to_world_of(*image, of_cells);
  if (values->GetName()) lattice.array = values->GetName();
  lattice.components = values->GetNumberOfComponents();
  const auto source = std::make_shared<Source>();
  source->slice = static_cast<vtkIdType>(lattice.size.x()) * lattice.size.y();
  source->hidden = hidden_voxels(*image, of_cells);
  source->values = std::move(values);
  if (source->values->GetNumberOfTuples() != source->slice * lattice.size.z())
    throw std::runtime_error("the array '" + lattice.array + "' has " +
                             std::to_string(source->values->GetNumberOfTuples()) + " values for an image of " +
                             std::to_string(source->slice * lattice.size.z()) + " voxels; write the file again");
  lattice.read_slice = [source](int z, double* out) { read_slice(*source, z, out); };
  return lattice;
}

}  // namespace tensorray
