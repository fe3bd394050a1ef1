#include "tools/import/vtk_source/mesh_formats.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <vtkCGNSReader.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataSet.h>
#include <vtkDataSetReader.h>
#include <vtkExodusIIReader.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkOpenFOAMReader.h>
#include <vtkSmartPointer.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkXMLGenericDataObjectReader.h>

#include "base/errors.h"
#include "base/files/temporary_folder.h"
#include "base/text/short_lines.h"
#include "base/text/text.h"
#include "tools/import/cases/ensight.h"
#include "tools/import/cases/openfoam_fields.h"
#include "tools/import/cases/openfoam_parts.h"
#include "tools/import/hdf5/vtkhdf.h"
#include "tools/import/hdf5/xdmf.h"
#include "tools/import/vtk/vtk_geometry.h"
#include "tools/import/vtk/vtk_pieces.h"
#include "tools/import/vtk_formats/array_names.h"
#include "tools/import/vtk_formats/netcdf_end.h"
#include "tools/import/vtk_formats/vtk_tags.h"
#include "tools/import/vtk_source/vtk_collection.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

vtkSmartPointer<vtkDataObject> read_xml(const Path& path, int) {
  vtkNew<vtkXMLGenericDataObjectReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutputDataObject(0);
}

/// Reads piece by piece, because VTK's own reader of pieces duplicates the points on every seam.
vtkSmartPointer<vtkDataObject> read_unstructured_pieces(const Path& path, int) {
  auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
  unsigned int index = 0;
  for (const Path& piece : piece_files(path)) blocks->SetBlock(index++, read_xml(piece, 0));
  return blocks;
}

/// Requests all arrays of each kind; by default VTK reads only the first one.
vtkSmartPointer<vtkDataObject> read_legacy(const Path& path, int) {
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
}

/// The title, on the second line, may be any text.
void check_legacy(const Path& path) {
  std::string head(4096, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  std::size_t position = head.find('\n');
  if (position != std::string::npos) position = head.find('\n', position + 1);
  const std::size_t start = position == std::string::npos ? position : head.find("DATASET", position);
  if (start == std::string::npos) fail(path, "is cut off, or no data set: it has no line DATASET ...");
  const std::string line = head.substr(start, head.find_first_of("\r\n", start) - start);
  if (line.find("POLYDATA") != std::string::npos)
    fail(path, "holds surfaces (POLYDATA), which have no volume to import; save the volume's grid");
  int number = 0;
  for_each_short_line(path, 254, [&](const std::string& text) {
    if (++number <= 2) return true;
    std::istringstream words(text);
    std::string keyword, name;
    double count = 0;
    words >> keyword >> name >> count;
    if (lower_case(keyword) == "field" && count > static_cast<double>(std::filesystem::file_size(path)))
      fail(path, "is damaged or cut off: it announces \"" + escaped(text) +
                     "\", and VTK would look for so many arrays; copy or write it again");
    return true;
  });
}

/// Reads the undisplaced mesh. By default VTK moves its points by any array that looks like a displacement.
vtkSmartPointer<vtkDataObject> read_exodus(const Path& path, int step) {
  vtkNew<vtkExodusIIReader> reader;
  reader->SetFileName(path.c_str());
  reader->ApplyDisplacementsOff();
  reader->UpdateInformation();
  for (const auto kind : {vtkExodusIIReader::NODAL, vtkExodusIIReader::ELEM_BLOCK})
    for (int i = 0; i < reader->GetNumberOfObjectArrays(kind); ++i)
      reader->SetObjectArrayStatus(kind, reader->GetObjectArrayName(kind, i), 1);
  for (int i = 0; i < reader->GetNumberOfObjects(vtkExodusIIReader::ELEM_BLOCK); ++i)
    reader->SetObjectStatus(vtkExodusIIReader::ELEM_BLOCK, i, 1);
  if (reader->GetNumberOfTimeSteps() > 0) reader->SetTimeStep(step);
  reader->Update();
  for (vtkDataSet* const set : data_sets_in(reader->GetOutputDataObject(0))) name_components(*set, *reader, path);
  return reader->GetOutputDataObject(0);
}

int exodus_steps(const Path& path) {
  vtkNew<vtkExodusIIReader> reader;
  reader->SetFileName(path.c_str());
  reader->UpdateInformation();
  return reader->GetNumberOfTimeSteps();
}

/// The times of a CGNS file, in order; none if it has no results in time.
std::vector<double> open_cgns(const Path& path, vtkCGNSReader& reader) {
  if (!reader.CanReadFile(path.c_str())) fail(path, "is damaged or cut off, or no CGNS file; copy or write it again");
  reader.SetFileName(path.c_str());
  reader.SetDoublePrecisionMesh(1);
  reader.UpdateInformation();
  vtkInformation& facts = *reader.GetOutputInformation(0);
  std::vector<double> times(
      static_cast<std::size_t>(std::max(0, facts.Length(vtkStreamingDemandDrivenPipeline::TIME_STEPS()))));
  if (!times.empty()) facts.Get(vtkStreamingDemandDrivenPipeline::TIME_STEPS(), times.data());
  return times;
}

/// Only volumes, with all arrays. By default VTK reads none.
vtkSmartPointer<vtkDataObject> read_cgns(const Path& path, int step) {
  vtkNew<vtkCGNSReader> reader;
  const std::vector<double> times = open_cgns(path, *reader);
  reader->LoadBndPatchOff();
  reader->EnableAllBases();
  reader->EnableAllFamilies();
  reader->EnableAllPointArrays();
  reader->EnableAllCellArrays();
  if (!times.empty()) reader->UpdateTimeStep(times[static_cast<std::size_t>(step)]);
  reader->Update();
  return reader->GetOutputDataObject(0);
}

int cgns_steps(const Path& path) { return static_cast<int>(open_cgns(path, *vtkNew<vtkCGNSReader>()).size()); }

/// The folder of the case of a path, which is that folder, a .foam file in it, or its system/controlDict.
OpenFoamParts parts_of(const Path& path) {
  const Path parent = std::filesystem::absolute(path).parent_path();
  if (std::filesystem::is_directory(path)) return openfoam_parts(path, path);
  return openfoam_parts(path, path.filename() == "controlDict" ? parent.parent_path() : parent);
}

void check_openfoam(const Path& path) { parts_of(path); }

int openfoam_steps(const Path& path) { return static_cast<int>(parts_of(path).times.size()); }

/// The name of a block; empty if it has none.
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
  reader->UpdateTimeStep(time.value);
  reader->Update();
  complete_fields(*reader->GetOutput(), folder / time.folder);
  return reader->GetOutput();
}

/// The regions, which share no points; of a decomposed case, each of the parts of all processors.
vtkSmartPointer<vtkDataObject> read_openfoam(const Path& path, int step) {
  const OpenFoamParts parts = parts_of(path);
  const OpenFoamTime& time = parts.times[static_cast<std::size_t>(step)];
  const TemporaryFolder folder;
  std::map<std::string, DataSets> regions;  // A processor may have no part of a region.
  for (const Path& one :
       parts.processors.empty() ? std::vector{parts.folder} : processor_cases(parts, time, folder / "")) {
    const vtkSmartPointer<vtkMultiBlockDataSet> blocks = read_case(one, time);
    for (unsigned int i = 0; i < blocks->GetNumberOfBlocks(); ++i)
      for (const auto& set : data_sets_in(blocks->GetBlock(i))) {
        check_geometry(*set, path);
        regions[block_name(*blocks, i)].push_back(set);
      }
  }
  DataSets merged;
  for (const auto& [name, sets] : regions) merged.push_back(one_data_set(sets));
  return one_data_set(merged, false);
}

vtkSmartPointer<vtkDataObject> read_ensight_case(const Path& path, int step) {
  const vtkSmartPointer<vtkDataObject> data = read_ensight(path, step);
  for (vtkDataSet* const part : data_sets_in(data)) name_symmetric_components(*part);
  return data;
}

int ensight_steps(const Path& path) { return static_cast<int>(ensight_times(path).size()); }

int collection_length(const Path& path) { return static_cast<int>(collection_steps(path).size()); }

}  // namespace

const std::vector<MeshFormat>& mesh_formats() {
  static const std::vector<MeshFormat> formats = {
      {"a legacy VTK file", "", {".vtk"}, read_legacy, nullptr, check_legacy},
      {"a VTK image", "ImageData", {".vti"}, read_xml},
      {"a VTK rectilinear grid", "RectilinearGrid", {".vtr"}, read_xml},
      {"a VTK structured grid", "StructuredGrid", {".vts"}, read_xml},
      {"a VTK unstructured grid", "UnstructuredGrid", {".vtu"}, read_xml},
      {"a VTK image in pieces", "PImageData", {".pvti"}, read_xml, nullptr, nullptr, true},
      {"a VTK rectilinear grid in pieces", "PRectilinearGrid", {".pvtr"}, read_xml, nullptr, nullptr, true},
      {"a VTK structured grid in pieces", "PStructuredGrid", {".pvts"}, read_xml, nullptr, nullptr, true},
      {"a VTK unstructured grid in pieces",
       "PUnstructuredGrid",
       {".pvtu"},
       read_unstructured_pieces,
       nullptr,
       nullptr,
       true},
      {"an ExodusII file", "", {".ex2", ".exo", ".e", ".g"}, read_exodus, exodus_steps, require_whole_netcdf},
      {"a CGNS file", "", {".cgns"}, read_cgns, cgns_steps},
      {"an OpenFOAM case", "", {".foam"}, read_openfoam, openfoam_steps, check_openfoam, true},
      {"a case of EnSight", "", {".case", ".encas"}, read_ensight_case, ensight_steps, nullptr, true},
      {"an XDMF file", "", {".xdmf", ".xmf", ".xdmf2", ".xdmf3"}, read_xdmf, xdmf_steps, nullptr, true},
      {"a VTKHDF file", "", {".vtkhdf", ".hdf"}, read_vtkhdf, vtkhdf_steps, nullptr, true},
      {"a VTK multi-block file", "vtkMultiBlockDataSet", {".vtm"}},
      {"a ParaView collection", "Collection", {".pvd"}, nullptr, collection_length},
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
