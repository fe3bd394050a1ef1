#pragma once
/// Files of meshes, and checks and merges the data sets that VTK's readers return.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <vtkSmartPointer.h>
#include <vtkType.h>

class vtkDataObject;
class vtkDataSet;
class vtkIdTypeArray;
class vtkUnstructuredGrid;

namespace tensorray {

/// A file of a mesh that has been opened.
struct MeshFile {
  int steps = 1;  ///< Of time; 0 or 1 if it has none.
  /// Reads the data set, or a tree of them, at a step from 0 on. @throw std::runtime_error naming the file and the fix.
  std::function<vtkSmartPointer<vtkDataObject>(int step)> read;
  std::vector<std::string> notes{};  ///< For the user: guesses, and what is left out.
};

/// What reading a file may take at most, bytes: a small one may announce any number of points. (LZMA makes 7000 bytes
/// of one; threads have stacks.)
inline double max_memory_of(const std::filesystem::path& path) {
  return 0x1p30 + 8000.0 * static_cast<double>(std::filesystem::file_size(path));
}

/// Checks whether geometry can be used: VTK accepts any geometry that a file holds, and may then read beyond its arrays
/// or never end.
/// @throw std::runtime_error naming `path`: coordinates, an origin or a spacing not finite or beyond 1e30; fewer
/// points or coordinates than a grid's dimensions announce; cells of an unstructured grid that refer to missing
/// points, or that have fewer points than their type needs.
void check_geometry(vtkDataSet& data, const std::filesystem::path& path);

using DataSets = std::vector<vtkSmartPointer<vtkDataSet>>;

/// The data sets with cells in `data`, which may be a tree of blocks. They are copies that share their arrays.
DataSets data_sets_in(vtkDataObject* data);

/// The faces of polyhedra as VTK 9.4 and newer write them. Face f has points[point_ends[f − 1]] to points[point_ends[f]
/// − 1], cell c likewise faces[face_ends[c − 1]] ...; cells that are no polyhedra have none.
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

/// Whether both have the same points and cells.
bool is_same_mesh(vtkDataSet& a, vtkDataSet& b);

/// Returns the only data set of `pieces`. If there are several, merges them into one unstructured grid, and merges
/// points at equal positions, which take the values of the first piece in which they are finite. An array that a piece
/// lacks is NaN there; a piece's own points go before copies of another's. Where pieces overlap, they share no points,
/// and an array of cells, layer_array (mesh_tensors.h), says which ones do not overlap. Tensors whose components have
/// different names there are sorted by them. Null if `pieces` is empty. Changes the ghost arrays of the pieces. The
/// geometry of the pieces must have passed check_geometry.
///
/// Ghosts of all kinds of data sets mean the same. Of an only data set hidden cells and points stay marked (refined
/// cells count as hidden), and copies of neighbours' cells and points stay where no other cell is. Of several, hidden
/// cells, cells with hidden points, and copies are removed.
/// @param merges_points  False: points at equal positions stay apart, where pieces have values of their own.
vtkSmartPointer<vtkDataSet> one_data_set(const DataSets& pieces, bool merges_points = true);

}  // namespace tensorray
