#pragma once
/// Reads meshes as VTK data sets, from the formats that solvers write.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

class vtkDataSet;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// Reads a data set. Several blocks or pieces become one unstructured grid, whose points are merged where they meet.
///   .vtk (legacy)  .vti .vtr .vts .vtu  .pvti .pvtr .pvts .pvtu  .ex2 .exo .e .g (ExodusII)
///   .cgns (CGNS: the volumes of all zones)
///   .case (EnSight)  .xdmf .xmf (XDMF)  .vtkhdf .hdf (VTKHDF)
///   .vtm (blocks)  .pvd (ParaView's collection, with steps of time)  of the files above
///   .foam, controlDict or a folder with system/controlDict (OpenFOAM: internal mesh, also of several regions, whose
///   points are not merged, and of cases that are decomposed)
/// OpenFOAM's fields at cells stay there; mesh_tensors.h makes means at points. A symmTensor (xx xy xz yy yz zz in
/// OpenFOAM's files) is read in VTK's order, with its components named XX YY ZZ XY YZ XZ. A
/// volTensorField is read as it is: OpenFOAM's grad(U) is ∂_i u_j, the transpose of this program's gradients. Points
/// of an ExodusII mesh are not displaced. Images stay vtkImageData, and structured and rectilinear grids keep their
/// type, also if they are in pieces. Ghosts: see vtk_data_sets.h. The kind is found from the contents where they state
/// it; a wrong ending is an error that names both kinds. On damaged files VTK's readers may end the process or never
/// return: call this in a child process (child_process.h). The result has passed check_geometry (vtk_data_sets.h).
/// @param step  Of the steps of time, from 0 on; none: the last one that can be read, as a run that was stopped leaves
/// its last ones incomplete.
/// @param notes  Gets lines for the user: guesses, what is left out, and steps that are not complete.
/// @throw std::runtime_error, one line with the file and the fix; it includes the messages that VTK would print.
vtkSmartPointer<vtkDataSet> read_vtk_source(const std::filesystem::path& path, std::optional<int> step = std::nullopt,
                                            std::vector<std::string>* notes = nullptr);

/// The number of steps of time in a file; 1 for kinds that have none. @throw as read_vtk_source.
int time_steps(const std::filesystem::path& path);

}  // namespace tensorray
