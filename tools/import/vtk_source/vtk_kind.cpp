#include "tools/import/vtk_source/vtk_kind.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <vtkExtentSplitter.h>
#include <vtkNew.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/cases/openfoam_parts.h"
#include "tools/import/vtk_formats/netcdf_size.h"
#include "tools/import/vtk_formats/vtk_counts.h"
#include "tools/import/vtk_formats/vtk_tags.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

struct KindFacts {
  VtkKind kind;
  const char* text;                  ///< For messages.
  const char* xml_type;              ///< The type in <VTKFile type="...">; null if the kind is not XML.
  std::vector<const char*> endings;  ///< Lower case.
};

const std::vector<KindFacts>& kinds() {
  static const std::vector<KindFacts> table = {
      {VtkKind::legacy, "a legacy VTK file", nullptr, {".vtk"}},
      {VtkKind::image, "a VTK image", "ImageData", {".vti"}},
      {VtkKind::rectilinear, "a VTK rectilinear grid", "RectilinearGrid", {".vtr"}},
      {VtkKind::structured, "a VTK structured grid", "StructuredGrid", {".vts"}},
      {VtkKind::unstructured, "a VTK unstructured grid", "UnstructuredGrid", {".vtu"}},
      {VtkKind::image_pieces, "a VTK image in pieces", "PImageData", {".pvti"}},
      {VtkKind::rectilinear_pieces, "a VTK rectilinear grid in pieces", "PRectilinearGrid", {".pvtr"}},
      {VtkKind::structured_pieces, "a VTK structured grid in pieces", "PStructuredGrid", {".pvts"}},
      {VtkKind::unstructured_pieces, "a VTK unstructured grid in pieces", "PUnstructuredGrid", {".pvtu"}},
      {VtkKind::exodus, "an ExodusII file", nullptr, {".ex2", ".exo", ".e", ".g"}},
      {VtkKind::cgns, "a CGNS file", nullptr, {".cgns"}},
      {VtkKind::openfoam, "an OpenFOAM case", nullptr, {".foam"}},
      {VtkKind::ensight, "a case of EnSight", nullptr, {".case", ".encas"}},
      {VtkKind::xdmf, "an XDMF file", nullptr, {".xdmf", ".xmf", ".xdmf2", ".xdmf3"}},
      {VtkKind::vtkhdf, "a VTKHDF file", nullptr, {".vtkhdf", ".hdf"}},
      {VtkKind::blocks, "a VTK multi-block file", "vtkMultiBlockDataSet", {".vtm"}},
      {VtkKind::time_series, "a ParaView collection", "Collection", {".pvd"}},
  };
  return table;
}

const KindFacts& facts_of(VtkKind kind) {
  return *std::find_if(kinds().begin(), kinds().end(), [&](const KindFacts& facts) { return facts.kind == kind; });
}

/// The kind that the file's ending names.
std::optional<VtkKind> promised_kind(const fs::path& path) {
  const std::string ending = lower_case_ending(path);
  for (const KindFacts& facts : kinds()) {
    if (std::count(facts.endings.begin(), facts.endings.end(), ending) > 0) return facts.kind;
  }
  return {};
}

std::string read_part(const fs::path& path, std::uintmax_t offset, std::uintmax_t count) {
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(path, "cannot be opened; check that it exists and may be read");
  std::string text(static_cast<std::size_t>(count), '\0');
  file.seekg(static_cast<std::streamoff>(offset));
  file.read(text.data(), static_cast<std::streamsize>(count));
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

std::string read_head(const fs::path& path) { return read_part(path, 0, 4096); }

std::optional<VtkKind> xml_kind(const fs::path& path, const std::string& head) {
  std::size_t root = head.find("<VTKFile");
  if (root == std::string::npos) return {};
  const std::string type = attribute(head, "type", root);
  for (const KindFacts& facts : kinds()) {
    if (facts.xml_type && type == facts.xml_type) return facts.kind;
  }
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

std::optional<VtkKind> kind_of_contents(const fs::path& path, const std::string& head) {
  const auto begins_with = [&](const std::string& magic) { return head.compare(0, magic.size(), magic) == 0; };
  if (begins_with("# vtk DataFile Version")) return VtkKind::legacy;
  for (const char version : {'\x01', '\x02', '\x05'}) {
    if (begins_with(std::string("CDF") + version)) return VtkKind::exodus;
  }
  if (begins_with("\x89HDF\r\n\x1a\n")) {  // Of several kinds; their readers tell what else is in the file.
    const std::optional<VtkKind> promised = promised_kind(path);
    if (promised == VtkKind::cgns || promised == VtkKind::vtkhdf) return promised;
    if (const std::string ending = lower_case_ending(path); ending == ".h5" || ending == ".hdf5")
      return VtkKind::vtkhdf;
    return VtkKind::exodus;
  }
  if (head.find("ADF Database") == 4) return VtkKind::cgns;
  if (const std::optional<VtkKind> kind = xml_kind(path, head)) return kind;
  if (head.find("<Xdmf") != std::string::npos) return VtkKind::xdmf;
  if (is_ensight(head)) return VtkKind::ensight;
  if (path.filename() == "controlDict" || path.extension() == ".foam") return VtkKind::openfoam;
  return {};
}

void check_netcdf_size(const fs::path& path) {
  const std::optional<std::uint64_t> needed = netcdf_size(path);
  if (needed && fs::file_size(path) < *needed)
    fail(path, "is cut off: it has " + std::to_string(fs::file_size(path)) + " of " + std::to_string(*needed) +
                   " bytes; copy or write it again");
}

void check_xml_end(const fs::path& path) {
  const std::uintmax_t size = fs::file_size(path), tail = std::min<std::uintmax_t>(size, 256);
  if (read_part(path, size - tail, tail).find("</VTKFile>") == std::string::npos) {
    fail(path, "is cut off: it does not end with </VTKFile>; copy or write it again");
  }
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

VtkKind piece_kind(VtkKind whole) {
  const int distance = static_cast<int>(VtkKind::image_pieces) - static_cast<int>(VtkKind::image);
  return static_cast<VtkKind>(static_cast<int>(whole) - distance);
}

VtkKind checked_kind(const fs::path& path);

void check_pieces(const fs::path& path, VtkKind kind) {
  const std::vector<fs::path> pieces = piece_files(path);
  if (pieces.empty()) fail(path, "names no pieces; write it again");
  for (const fs::path& piece : pieces) {
    if (!fs::is_regular_file(piece))
      fail(path, "its piece " + escaped(piece.string()) + " is missing; copy it there too");
    if (checked_kind(piece) != piece_kind(kind)) {
      fail(path, "its piece " + escaped(piece.string()) + " is not " + facts_of(piece_kind(kind)).text);
    }
  }
}

/// The kind of data set in a legacy file. Its title, on the second line, may be any text.
void check_legacy(const fs::path& path, const std::string& head) {
  std::size_t position = head.find('\n');
  if (position != std::string::npos) position = head.find('\n', position + 1);
  const std::size_t start = position == std::string::npos ? position : head.find("DATASET", position);
  if (start == std::string::npos) fail(path, "is cut off, or no data set: it has no line DATASET ...");
  const std::string line = head.substr(start, head.find_first_of("\r\n", start) - start);
  if (line.find("POLYDATA") != std::string::npos) {
    fail(path, "holds surfaces (POLYDATA), which have no volume to import; save the volume's grid");
  }
}

/// For formats that others convert: how. Empty for all others.
std::string way_out(const std::string& ending, const std::string& name) {
  const auto one_of = [&](std::initializer_list<const char*> endings) {
    return std::any_of(endings.begin(), endings.end(), [&](const char* e) { return ending == e; });
  };
  if (one_of({".msh"}))
    return "is a mesh of Gmsh, which is not read; run `meshio convert " + name + " FILE.vtu` (Debian's meshio-tools)";
  if (one_of({".med"}))
    return "is a file of MED (Salome, Code_Aster), which is not read; run `meshio convert " + name +
           " FILE.vtk` (Debian's meshio-tools and python3-h5py)";
  if (one_of({".frd"}))
    return "is a result of CalculiX, which is not read; convert it to .vtu with ccx2paraview, or in FreeCAD (export "
           "its Results)";
  if (one_of({".npz"}))
    return "holds several arrays of NumPy; save the one of the tensors: numpy.save(\"FILE.npy\", numpy.load(\"" + name +
           "\")[NAME])";
  if (one_of({".dat", ".plt", ".tec", ".szplt"}))
    return "may be a file of Tecplot, which is not read; open it in ParaView (File > Open, Tecplot reader) and save it "
           "as .vtu, or .vtm if it has several blocks";
  return {};
}

/// @param reason  Empty if the file is possible.
void require_possible(const fs::path& path, const std::string& reason) {
  if (!reason.empty()) fail(path, reason);
}

/// Also checks pieces, which may have the extent of the whole.
VtkKind checked_kind(const fs::path& path) {
  if (!fs::exists(path)) fail(path, "does not exist");
  if (fs::is_directory(path)) {
    openfoam_parts(path, openfoam_case(path));
    return VtkKind::openfoam;
  }
  require_no_device(path);
  const std::string head = read_head(path);
  const std::optional<VtkKind> promised = promised_kind(path), found = kind_of_contents(path, head);
  if (head.empty() && promised != VtkKind::openfoam) fail(path, "is empty; write it again");
  if (!found && promised) fail(path, std::string("is not ") + facts_of(*promised).text + ", as its ending says");
  const std::string ending = lower_case_ending(path);
  if (const std::string way = way_out(ending, path.filename().string());
      !way.empty() && (!found || ending == ".med"))  // MED is HDF5, too.
    fail(path, way);
  if (!found)
    fail(path,
         "is no file of VTK, ExodusII, CGNS, OpenFOAM, EnSight or XDMF, nor named as NRRD (.nrrd), NIfTI (.nii), "
         "MetaImage (.mha), MRtrix (.mif) or NumPy (.npy); PLOT3D needs two files, the grid and its q");
  if (promised && *promised != *found) {
    fail(path, std::string("its ending says ") + facts_of(*promised).text + ", its contents are " +
                   facts_of(*found).text + "; give it the ending " + facts_of(*found).endings.front());
  }
  if (facts_of(*found).xml_type) {
    check_xml_end(path);
    require_possible(path, impossible_xml_count(path));
  }
  if (*found >= VtkKind::image_pieces && *found <= VtkKind::unstructured_pieces) check_pieces(path, *found);
  if (*found == VtkKind::legacy) {
    check_legacy(path, head);
    require_possible(path, impossible_legacy_count(path));
  }
  if (*found == VtkKind::openfoam) openfoam_parts(path, openfoam_case(path));
  if (*found == VtkKind::exodus) check_netcdf_size(path);
  return *found;
}

}  // namespace

std::vector<fs::path> piece_files(const fs::path& path) {
  const std::string text = read_part(path, 0, fs::file_size(path));
  std::vector<fs::path> pieces;
  std::size_t position = 0;
  for (std::string name; !(name = attribute(text, "Source", position)).empty();) {
    pieces.push_back(path.parent_path() / name);
  }
  return pieces;
}

fs::path openfoam_case(const fs::path& path) {
  if (fs::is_directory(path)) return path;
  const fs::path folder = fs::absolute(path).parent_path();
  return path.filename() == "controlDict" ? folder.parent_path() : folder;
}

VtkKind vtk_kind(const fs::path& path) {
  const VtkKind kind = checked_kind(path);
  const bool has_extent = (kind >= VtkKind::image && kind <= VtkKind::structured) ||
                          (kind >= VtkKind::image_pieces && kind <= VtkKind::structured_pieces);
  if (has_extent) check_extents(path);
  return kind;
}

}  // namespace tensorray
