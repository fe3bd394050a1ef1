#pragma once
/// @file tools/import/vtk/polyhedra.h
/// The faces of polyhedra as VTK 9.4 and newer write them, for older versions of VTK.

#include <filesystem>
#include <vector>

#include <vtkSmartPointer.h>
#include <vtkType.h>

class vtkIdTypeArray;
class vtkUnstructuredGrid;

namespace tensorray {

/// Face f has points[point_ends[f − 1]] to points[point_ends[f] − 1], cell c likewise faces[face_ends[c − 1]] ...;
/// cells that are no polyhedra have none.
struct FaceTables {
  std::vector<vtkIdType> points, point_ends, faces, face_ends;
};

/// Appends the faces of each cell to the lists that vtkUnstructuredGrid has: where each begins (−1: no polyhedron), and
/// numbers of faces, of points, and points. @param first_point  Is added to each. @return false if the tables name what
/// is not there.
bool append_faces(const FaceTables& tables, vtkIdType first_point, vtkIdTypeArray& locations, vtkIdTypeArray& faces);

/// Reads an unstructured grid in VTK's XML, with polyhedra of any version.
/// @throw std::runtime_error naming the file if its tables of faces are damaged. All other errors are VTK's messages.
vtkSmartPointer<vtkUnstructuredGrid> read_vtu(const std::filesystem::path& path);

}  // namespace tensorray
