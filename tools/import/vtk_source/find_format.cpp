#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <vtkExtentSplitter.h>
#include <vtkNew.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/vtk_formats/vtk_tags.h"
#include "tools/import/vtk_source/mesh_formats.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

const MeshFormat* format_of_type(const std::string& type) {
  for (const MeshFormat& format : mesh_formats())
    if (format.xml_type == type) return &format;
  return nullptr;
}

std::string read_head(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(path, "cannot be opened; check that it exists and may be read");
  std::string text(4096, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

const MeshFormat* xml_format(const fs::path& path, const std::string& head) {
  std::size_t root = head.find("<VTKFile");
  if (root == std::string::npos) return nullptr;
  const std::string type = attribute(head, "type", root);
  if (const MeshFormat* const format = type.empty() ? nullptr : format_of_type(type)) return format;
  fail(path,
       "is a VTK file of type '" + escaped(type) +
           "', which has no volume to import; save it as an image, a rectilinear, structured or unstructured grid");
}

/// Whether a text begins, after comments, with EnSight's section FORMAT.
bool is_ensight(const std::string& head) {
  std::istringstream stream(head);
  for (std::string line; std::getline(stream, line);) {
    if (line.compare(0, 6, "FORMAT") == 0) return true;
    if (line.find_first_not_of(" \t\r") != std::string::npos && line[0] != '#') return false;
  }
  return false;
}

const MeshFormat* format_of_contents(const fs::path& path, const std::string& head) {
  const std::string ending = lower_case_ending(path);
  if (ending == ".mnc" || ending == ".mat") return nullptr;  // Which are netCDF or HDF5, too.
  if (starts_with(head, "# vtk DataFile Version")) return format_with_ending(".vtk");
  for (const char version : {'\x01', '\x02', '\x05'})
    if (starts_with(head, std::string("CDF") + version)) return format_with_ending(".exo");
  if (starts_with(head, "\x89HDF\r\n\x1a\n")) {  // Of several kinds; their readers tell what else is in the file.
    for (const char* named : {".cgns", ".vtkhdf"})
      if (format_with_ending(ending) == format_with_ending(named)) return format_with_ending(named);
    return format_with_ending(ending == ".h5" || ending == ".hdf5" ? ".vtkhdf" : ".exo");
  }
  if (head.find("ADF Database") == 4) return format_with_ending(".cgns");
  if (const MeshFormat* const format = xml_format(path, head)) return format;
  if (head.find("<Xdmf") != std::string::npos) return format_with_ending(".xdmf");
  if (ending == ".series" && starts_with(trimmed(head), "{")) return format_with_ending(".series");
  if (is_ensight(head)) return format_with_ending(".case");
  return path.filename() == "controlDict" || path.extension() == ".foam" ? format_with_ending(".foam") : nullptr;
}

using Extent = std::array<int, 6>;

/// Empty if the text is not an extent, or if the extent is empty.
std::optional<Extent> extent_of(const std::string& text) {
  std::istringstream stream(text);
  Extent extent;
  for (int& bound : extent) stream >> bound;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!stream || extent[2 * axis] > extent[2 * axis + 1]) return {};
  return extent;
}

/// VTK reads invalid numbers as 0 or 1.
void check_placement(const fs::path& path, const std::string& tag) {
  for (const char* name : {"Origin", "Spacing"}) {
    const std::string text = attribute(tag, name);
    std::istringstream stream(text);
    double x, y, z;
    if (!text.empty() && !(stream >> x >> y >> z))
      fail(path, "is damaged: its origin or spacing is not finite, or beyond 1e30; write it again");
  }
}

/// VTK does not initialize the part of an extent that no piece covers.
void check_extents(const fs::path& path) {
  vtkNew<vtkExtentSplitter> splitter;
  std::optional<Extent> whole;
  int pieces = 0;
  for_each_tag(path, [&](const std::string& tag) {
    if (!whole) {
      whole = extent_of(attribute(tag, "WholeExtent"));
      if (whole) check_placement(path, tag);
    } else if (starts_with(tag, "Piece")) {
      std::optional<Extent> extent = extent_of(attribute(tag, "Extent"));
      if (extent) splitter->AddExtentSource(pieces++, 0, extent->data());
    }
  });
  if (!whole) return;
  splitter->AddExtent(whole->data());
  if (splitter->ComputeSubExtents() == 0)
    fail(path, "its pieces do not fill its extent; write it again, or import the file that names it as a piece");
}

const MeshFormat& checked_format(const fs::path& path);

void check_pieces(const fs::path& path, const MeshFormat& whole) {
  const std::vector<fs::path> pieces = piece_files(path);
  const MeshFormat& of_pieces = *format_of_type(whole.xml_type.substr(1));
  if (pieces.empty()) fail(path, "names no pieces; write it again");
  for (const fs::path& piece : pieces) {
    if (!fs::is_regular_file(piece))
      fail(path, "its piece " + escaped(piece.string()) + " is missing; copy it there too");
    if (&checked_format(piece) != &of_pieces)
      fail(path, "its piece " + escaped(piece.string()) + " is not " + of_pieces.text);
  }
}

/// For formats that others convert: how. Empty for all others.
std::string way_out(const std::string& ending, const std::string& name) {
  const std::pair<std::vector<std::string>, std::string> ways[] = {
      {{".msh"},
       "is a mesh of Gmsh, which is not read; run `meshio convert " + name + " FILE.vtu` (Debian's meshio-tools)"},
      {{".med", ".rmed", ".mmed"},
       "is a file of MED (Salome, Code_Aster), which is not read; save it as .vtu with Salome's ParaViS (File > Save "
       "Data), or print it in Code_Aster with fields at nodes alone (IMPR_RESU, NOM_CHAM='SIGM_NOEU') and run `meshio "
       "convert " +
           name + " FILE.vtk` (Debian's meshio-tools and python3-h5py), which fails on fields at Gauss points"},
      {{".frd"},
       "is a result of CalculiX, which is not read; convert it to .vtu with ccx2paraview, or in FreeCAD (export its "
       "Results)"},
      {{".npz"},
       "holds several arrays of NumPy; save the one of the tensors: numpy.save(\"FILE.npy\", numpy.load(\"" + name +
           "\")[NAME])"},
      {{".dat", ".plt", ".tec", ".szplt"},
       "may be a file of Tecplot, which is not read; open it in ParaView (File > Open, Tecplot reader) and save it as "
       ".vtu, or .vtm if it has several blocks"},
      {{".odb"}, "is a result of Abaqus, which only Abaqus reads; make .vtu of it with odb2vtk in Abaqus's own Python"},
      {{".rst", ".rth"},
       "is a result of Ansys, which is not read; pip install ansys-mapdl-reader, and then in Python "
       "ansys.mapdl.reader.read_binary(\"" +
           name + "\").save_as_vtk(\"FILE.vtu\")"},
      {{".cas", ".cas.h5", ".dat.h5", ".sim", ".ccm", ".op2", ".d3plot", ".unv", ".res"},
       "is of a solver's own format, which is not read; save it in the solver, its postprocessor or ParaView as "
       "EnSight "
       "Gold (.case), CGNS or .vtu"},
      {{".mgz", ".mgh"}, "is an image of FreeSurfer, which is not read; run mri_convert " + name + " FILE.nii.gz"},
      {{".mnc"}, "is an image of MINC, which is not read; run mnc2nii " + name + " FILE.nii"},
      {{".fib.gz", ".fib", ".fz", ".src.gz", ".sz", ".dcm", ".tck", ".trk"},
       "holds signals or fibres, and no tensors; fit these to the measured images: dtifit --save_tensor (FSL) or "
       "dwi2tensor (MRtrix)"},
      {{".stl", ".ply", ".obj"}, "is a surface, which has no tensors in it; import the grid of the volume"},
      {{".mat"},
       "is a file of MATLAB; save its array as .npy: numpy.save(\"FILE.npy\", scipy.io.loadmat(\"" + name +
           "\")[NAME])"},
      {{".vdb"}, "is an OpenVDB file, which needs no import: name it in the scene (field.file)"}};
  for (const auto& [endings, way] : ways)
    if (std::any_of(endings.begin(), endings.end(),
                    [&](const std::string& one) { return ending == one || ends_with(lower_case(name), one); }))
      return way;
  return {};
}

/// Also checks pieces, which may have the extent of the whole.
const MeshFormat& checked_format(const fs::path& path) {
  if (!fs::exists(path)) fail(path, "does not exist");
  require_no_device(path);
  const bool is_folder = fs::is_directory(path);
  const std::string head = is_folder ? "" : read_head(path), ending = lower_case_ending(path);
  const MeshFormat* const promised = format_with_ending(is_folder ? ".foam" : ending);
  const MeshFormat* const found = is_folder ? promised : format_of_contents(path, head);
  if (head.empty() && promised != format_with_ending(".foam")) fail(path, "is empty; write it again");
  if (!found && promised) fail(path, "is not " + promised->text + ", as its ending says");
  if (const std::string way = way_out(ending, path.filename().string());
      !way.empty() && (!found || ends_with(ending, "med")))  // MED is HDF5, too.
    fail(path, way);
  if (!found)
    fail(path,
         "is no file of VTK, ExodusII, CGNS, OpenFOAM, EnSight or XDMF, nor named as NRRD (.nrrd), NIfTI (.nii), "
         "MetaImage (.mha), MRtrix (.mif) or NumPy (.npy); PLOT3D needs two files, the grid and its q");
  if (promised && promised != found)
    fail(path, "its ending says " + promised->text + ", its contents are " + found->text + "; give it the ending " +
                   found->endings.front());
  if (!found->xml_type.empty() && !is_closed(path))
    fail(path, "is cut off: it does not end with </VTKFile>; copy or write it again");
  if (!found->xml_type.empty())
    for_each_tag(path, [&](const std::string& tag) {
      if (!has_possible_components(tag))
        fail(path, "is damaged: one of its arrays has no such number of components; copy or write it again");
    });
  if (found->is_in_pieces()) check_pieces(path, *found);
  return *found;
}

}  // namespace

const MeshFormat& find_format(const fs::path& path) {
  const MeshFormat& format = checked_format(path);
  const std::string type = format.xml_type.substr(format.is_in_pieces() ? 1 : 0);
  if (type == "ImageData" || type == "RectilinearGrid" || type == "StructuredGrid") check_extents(path);
  return format;
}

}  // namespace tensorray
