#include "tools/import/vtk_source/mesh_formats.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include <vtkCGNSReader.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataSet.h>
#include <vtkDataSetReader.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkOpenFOAMReader.h>
#include <vtkSmartPointer.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLGenericDataObjectReader.h>

#include "base/errors.h"
#include "base/files/temporary_folder.h"
#include "base/text/text.h"
#include "tools/import/cases/case_files.h"
#include "tools/import/cases/openfoam.h"
#include "tools/import/hdf5/hdf5_meshes.h"
#include "tools/import/meshes/cell_graph.h"
#include "tools/import/vtk_formats/array_names.h"
#include "tools/import/vtk_formats/vtk_tags.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

MeshFile open_xml(const Path& path) {
  return {1, [path](int) -> vtkSmartPointer<vtkDataObject> {
            vtkNew<vtkXMLGenericDataObjectReader> reader;
            reader->SetFileName(path.c_str());
            reader->Update();
            return reader->GetOutputDataObject(0);
          }};
}

MeshFile open_unstructured(const Path& path) {
  return {1, [path](int) { return read_vtu(path); }};
}

/// Reads piece by piece, because VTK's own reader of pieces duplicates the points on every seam.
MeshFile open_unstructured_pieces(const Path& path) {
  return {1, [path](int) {
            auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
            unsigned int index = 0;
            for (const Path& piece : piece_files(path)) blocks->SetBlock(index++, read_vtu(piece));
            return blocks;
          }};
}

/// Finds what VTK reads in silence, or for hours. The title, on the second line, may be any text.
void check_legacy(const Path& path) {
  std::string data_set;
  int number = 0;
  for_each_short_line(path, 254, [&](const std::string& line) {
    if (++number <= 2) return true;
    std::istringstream words(line);
    std::string keyword, name;
    double count = 0;
    words >> keyword >> name >> count;
    if (lower_case(keyword) == "dataset" && data_set.empty()) data_set = lower_case(name);
    if (lower_case(keyword) == "field" && count > static_cast<double>(std::filesystem::file_size(path)))
      fail(path, "is damaged or cut off: it announces \"" + escaped(line) +
                     "\", and VTK would look for so many arrays; copy or write it again");
    return true;
  });
  if (data_set.empty()) fail(path, "is cut off, or no data set: it has no line DATASET ...");
  if (data_set == "polydata")
    fail(path, "holds surfaces (POLYDATA), which have no volume to import; save the volume's grid");
}

/// Requests all arrays of each kind; by default VTK reads only the first one.
MeshFile open_legacy(const Path& path) {
  check_legacy(path);
  return {1, [path](int) -> vtkSmartPointer<vtkDataObject> {
            vtkNew<vtkDataSetReader> reader;
            reader->SetFileName(path.c_str());
            reader->ReadAllScalarsOn();
            reader->ReadAllVectorsOn();
            reader->ReadAllNormalsOn();
            reader->ReadAllTensorsOn();
            reader->ReadAllFieldsOn();
            reader->Update();
            for (vtkDataSet* const set : data_sets_in(reader->GetOutputDataObject(0))) name_tensors6(*set, path);
            return reader->GetOutputDataObject(0);
          }};
}

/// Only volumes, with all arrays. By default VTK reads none.
MeshFile open_cgns(const Path& path) {
  const auto reader = vtkSmartPointer<vtkCGNSReader>::New();
  if (!reader->CanReadFile(path.c_str())) fail(path, "is damaged or cut off, or no CGNS file; copy or write it again");
  reader->SetFileName(path.c_str());
  reader->SetDoublePrecisionMesh(1);
  reader->UpdateInformation();
  auto* const time_steps = vtkStreamingDemandDrivenPipeline::TIME_STEPS();
  vtkInformation& facts = *reader->GetOutputInformation(0);
  std::vector<double> times(static_cast<std::size_t>(std::max(0, facts.Length(time_steps))));
  if (!times.empty()) facts.Get(time_steps, times.data());
  return {static_cast<int>(times.size()), [=](int step) -> vtkSmartPointer<vtkDataObject> {
            reader->LoadBndPatchOff();
            reader->EnableAllBases();
            reader->EnableAllFamilies();
            reader->EnableAllPointArrays();
            reader->EnableAllCellArrays();
            if (!times.empty()) reader->UpdateTimeStep(times[static_cast<std::size_t>(step)]);
            reader->Update();
            return reader->GetOutputDataObject(0);
          }};
}

std::string block_name(vtkMultiBlockDataSet& blocks, unsigned int index) {
  const char* const name =
      blocks.HasMetaData(index) ? blocks.GetMetaData(index)->Get(vtkCompositeDataSet::NAME()) : nullptr;
  return name ? name : "";
}

/// Corrects tensors and names their components. @param time  The folder of the fields, or of the regions' folders.
void complete_fields(vtkMultiBlockDataSet& blocks, const Path& time) {
  for (unsigned int i = 0; i < blocks.GetNumberOfBlocks(); ++i) {
    const Path region = time / block_name(blocks, i);
    for (vtkDataSet* const set : data_sets_in(blocks.GetBlock(i))) {
      correct_uniform_tensors(*set, std::filesystem::is_directory(region) ? region : time);
      name_symmetric_components(*set);
    }
  }
}

/// Reads a whole case: one block, or one for each region.
vtkSmartPointer<vtkMultiBlockDataSet> read_case(const Path& folder, const OpenFoamTime& time) {
  vtkNew<vtkOpenFOAMReader> reader;
  reader->SetFileName((folder / "system" / "controlDict").c_str());
  reader->SkipZeroTimeOff();
  reader->UpdateInformation();
  for (int i = 0; i < reader->GetNumberOfPatchArrays(); ++i) {
    const std::string name = reader->GetPatchArrayName(i);
    reader->SetPatchArrayStatus(name.c_str(), name == "internalMesh" || ends_with(name, "/internalMesh"));
  }
  reader->EnableAllCellArrays();
  reader->EnableAllPointArrays();
  // The file has values at cells; they are averaged to points where cells are known to be finite.
  reader->CreateCellToPointOff();
  // Of the parts of a polyhedron each would have its value, and a gradient beside it.
  reader->DecomposePolyhedraOff();
  reader->UpdateTimeStep(time.value);
  reader->Update();
  complete_fields(*reader->GetOutput(), folder / time.folder);
  return reader->GetOutput();
}

/// The regions, which share no points; of a decomposed case, each of the parts of all processors.
vtkSmartPointer<vtkDataObject> read_regions(const OpenFoamParts& parts, const OpenFoamTime& time) {
  const TemporaryFolder folder;
  std::map<std::string, DataSets> regions;  // A processor may have no part of a region.
  OpenFoamWalls walls;
  for (const Path& one :
       parts.processors.empty() ? std::vector{parts.folder} : processor_cases(parts, time, folder / "")) {
    const vtkSmartPointer<vtkMultiBlockDataSet> blocks = read_case(one, time);
    for (unsigned int i = 0; i < blocks->GetNumberOfBlocks(); ++i)
      for (const auto& set : data_sets_in(blocks->GetBlock(i))) {
        check_geometry(*set, parts.folder);
        regions[block_name(*blocks, i)].push_back(set);
      }
    add_openfoam_walls(one, time, walls);
  }
  DataSets merged;
  for (const auto& [name, sets] : regions) merged.push_back(one_data_set(sets));
  const vtkSmartPointer<vtkDataSet> all = one_data_set(merged, false);
  for (const auto& [field, of_field] : walls) add_walls(*all, field, of_field);
  return all;
}

/// @param path  The case's folder, a .foam file in it, or its system/controlDict.
MeshFile open_openfoam(const Path& path) {
  const Path parent = std::filesystem::absolute(path).parent_path();
  const OpenFoamParts parts = openfoam_parts(path, std::filesystem::is_directory(path) ? path
                                                   : path.filename() == "controlDict"  ? parent.parent_path()
                                                                                       : parent);
  return {static_cast<int>(parts.times.size()),
          [parts](int step) { return read_regions(parts, parts.times[static_cast<std::size_t>(step)]); }};
}

}  // namespace

const std::vector<MeshFormat>& mesh_formats() {
  static const std::vector<MeshFormat> formats = {
      {"a legacy VTK file", "", {".vtk"}, open_legacy},
      {"a VTK image", "ImageData", {".vti"}, open_xml},
      {"a VTK rectilinear grid", "RectilinearGrid", {".vtr"}, open_xml},
      {"a VTK structured grid", "StructuredGrid", {".vts"}, open_xml},
      {"a VTK unstructured grid", "UnstructuredGrid", {".vtu"}, open_unstructured},
      {"a VTK image in pieces", "PImageData", {".pvti"}, open_xml, true},
      {"a VTK rectilinear grid in pieces", "PRectilinearGrid", {".pvtr"}, open_xml, true},
      {"a VTK structured grid in pieces", "PStructuredGrid", {".pvts"}, open_xml, true},
      {"a VTK unstructured grid in pieces", "PUnstructuredGrid", {".pvtu"}, open_unstructured_pieces, true},
      {"an ExodusII file", "", {".ex2", ".exo", ".e", ".g"}, open_exodus},
      {"a CGNS file", "", {".cgns"}, open_cgns},
      {"an OpenFOAM case", "", {".foam"}, open_openfoam, true},
      {"a case of EnSight", "", {".case", ".encas"}, open_ensight, true},
      {"an XDMF file", "", {".xdmf", ".xmf", ".xdmf2", ".xdmf3"}, open_xdmf, true},
      {"a VTKHDF file", "", {".vtkhdf", ".hdf"}, open_vtkhdf, true},
      {"a VTK multi-block file", "vtkMultiBlockDataSet", {".vtm"}},
      {"a VTK file of adaptive refinement", "vtkOverlappingAMR", {".vth", ".vthb"}},
      {"a ParaView collection", "Collection", {".pvd"}},
      {"a series of files", "", {".series"}},
  };
  return formats;
}

const MeshFormat* format_with_ending(const std::string& ending) {
  for (const MeshFormat& format : mesh_formats())
    if (std::count(format.endings.begin(), format.endings.end(), ending) > 0) return &format;
  return nullptr;
}

std::vector<Path> piece_files(const Path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  std::vector<Path> pieces;
  std::size_t position = 0;
  for (std::string name; !(name = attribute(text, "Source", position)).empty();)
    pieces.push_back(path.parent_path() / name);
  return pieces;
}

}  // namespace tensorray
