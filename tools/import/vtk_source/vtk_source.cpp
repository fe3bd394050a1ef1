#include "tools/import/vtk_source/vtk_source.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include <vtkCGNSReader.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkDataSetReader.h>
#include <vtkDoubleArray.h>
#include <vtkExodusIIReader.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkOpenFOAMReader.h>
#include <vtkSmartPointer.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLPImageDataReader.h>
#include <vtkXMLPRectilinearGridReader.h>
#include <vtkXMLPStructuredGridReader.h>
#include <vtkXMLRectilinearGridReader.h>
#include <vtkXMLStructuredGridReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include "base/errors.h"
#include "base/files/temporary_folder.h"
#include "base/text/text.h"
#include "tools/import/cases/ensight.h"
#include "tools/import/cases/openfoam_fields.h"
#include "tools/import/cases/openfoam_parts.h"
#include "tools/import/hdf5/vtkhdf.h"
#include "tools/import/hdf5/xdmf.h"
#include "tools/import/vtk/silent_stderr.h"
#include "tools/import/vtk/vtk_geometry.h"
#include "tools/import/vtk/vtk_messages.h"
#include "tools/import/vtk/vtk_pieces.h"
#include "tools/import/vtk_formats/exodus_names.h"
#include "tools/import/vtk_formats/symmetric_names.h"
#include "tools/import/vtk_source/vtk_collection.h"
#include "tools/import/vtk_source/vtk_kind.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

template <typename Reader>
vtkSmartPointer<vtkDataObject> read_xml(const Path& path) {
  vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutputDataObject(0);
}

/// Reads piece by piece, because VTK's own reader of pieces duplicates the points on every seam.
vtkSmartPointer<vtkDataObject> read_unstructured_pieces(const Path& path) {
  auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
  unsigned int index = 0;
  for (const Path& piece : piece_files(path)) {
    blocks->SetBlock(index++, read_xml<vtkXMLUnstructuredGridReader>(piece));
  }
  return blocks;
}

/// Requests all arrays of each kind; by default VTK reads only the first one.
vtkSmartPointer<vtkDataObject> read_legacy(const Path& path) {
  vtkNew<vtkDataSetReader> reader;
  reader->SetFileName(path.c_str());
  reader->ReadAllScalarsOn();
  reader->ReadAllVectorsOn();
  reader->ReadAllNormalsOn();
  reader->ReadAllTensorsOn();
  reader->ReadAllFieldsOn();
  reader->Update();
  return reader->GetOutputDataObject(0);
}

/// Checks a number that the user gives. @return the step, from 0 on.
int chosen_step(std::optional<int> step, int steps) {
  if (step && *step >= steps)
    throw std::invalid_argument("--steps " + std::to_string(*step + 1) + ": there are " + std::to_string(steps) +
                                " steps of time");
  return step.value_or(steps - 1);
}

/// Reads the undisplaced mesh. By default VTK moves its points by any array that looks like a displacement.
vtkSmartPointer<vtkDataObject> read_exodus(const Path& path, std::optional<int> step) {
  vtkNew<vtkExodusIIReader> reader;
  reader->SetFileName(path.c_str());
  reader->ApplyDisplacementsOff();
  reader->UpdateInformation();
  for (const auto kind : {vtkExodusIIReader::NODAL, vtkExodusIIReader::ELEM_BLOCK}) {
    for (int i = 0; i < reader->GetNumberOfObjectArrays(kind); ++i) {
      reader->SetObjectArrayStatus(kind, reader->GetObjectArrayName(kind, i), 1);
    }
  }
  for (int i = 0; i < reader->GetNumberOfObjects(vtkExodusIIReader::ELEM_BLOCK); ++i) {
    reader->SetObjectStatus(vtkExodusIIReader::ELEM_BLOCK, i, 1);
  }
  if (const int steps = reader->GetNumberOfTimeSteps(); steps > 0 || step)
    reader->SetTimeStep(chosen_step(step, std::max(steps, 1)));
  reader->Update();
  for (vtkDataSet* const set : data_sets_in(reader->GetOutputDataObject(0))) name_components(*set, *reader, path);
  return reader->GetOutputDataObject(0);
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
vtkSmartPointer<vtkDataObject> read_cgns(const Path& path, std::optional<int> step) {
  vtkNew<vtkCGNSReader> reader;
  const std::vector<double> times = open_cgns(path, *reader);
  reader->LoadBndPatchOff();
  reader->EnableAllBases();
  reader->EnableAllFamilies();
  reader->EnableAllPointArrays();
  reader->EnableAllCellArrays();
  const int count = static_cast<int>(times.size()), chosen = chosen_step(step, std::max(count, 1));
  if (count > 0) reader->UpdateTimeStep(times[static_cast<std::size_t>(chosen)]);
  reader->Update();
  return reader->GetOutputDataObject(0);
}

/// The times of a whole OpenFOAM case, in order.
std::vector<double> open_case(const Path& folder, vtkOpenFOAMReader& reader) {
  const Path dictionary = folder / "system" / "controlDict";
  reader.SetFileName(dictionary.c_str());
  reader.SkipZeroTimeOff();
  reader.UpdateInformation();
  std::vector<double> times;
  if (vtkDoubleArray* const values = reader.GetTimeValues())
    for (vtkIdType i = 0; i < values->GetNumberOfTuples(); ++i) times.push_back(values->GetValue(i));
  std::sort(times.begin(), times.end());
  return times;
}

/// The folder in a case that has the fields of a time; the case itself if none has.
Path time_folder(const Path& folder, double time) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    char* end = nullptr;
    if (entry.is_directory() && std::strtod(name.c_str(), &end) == time && end != name.c_str() && *end == '\0')
      return entry.path();
  }
  return folder;
}

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
vtkSmartPointer<vtkDataObject> read_case(const Path& folder, std::optional<int> step) {
  vtkNew<vtkOpenFOAMReader> reader;
  const std::vector<double> times = open_case(folder, *reader);
  for (int i = 0; i < reader->GetNumberOfPatchArrays(); ++i) {
    const std::string name = reader->GetPatchArrayName(i);
    reader->SetPatchArrayStatus(name.c_str(), name == "internalMesh" || ends_with(name, "/internalMesh"));
  }
  reader->EnableAllCellArrays();
  reader->EnableAllPointArrays();
  // The file has values at cells; they are averaged to points where cells are known to be finite.
  reader->CreateCellToPointOff();
  const int count = static_cast<int>(times.size());
  double time = 0;
  if (count > 0 || step) {
    time = times.at(static_cast<std::size_t>(chosen_step(step, count)));
    reader->UpdateTimeStep(time);
  }
  reader->Update();
  complete_fields(*reader->GetOutput(), time_folder(folder, time));
  return reader->GetOutputDataObject(0);
}

/// One grid for each region; of a decomposed case, of the parts of all processors.
vtkSmartPointer<vtkDataObject> read_openfoam(const Path& path, std::optional<int> step) {
  const OpenFoamParts parts = openfoam_parts(path, openfoam_case(path));
  if (parts.processors.empty()) return read_case(parts.folder, step);
  const auto chosen = static_cast<std::size_t>(chosen_step(step, static_cast<int>(parts.times.size())));
  const TemporaryFolder folder;
  std::map<std::string, DataSets> regions;  // Of each region, the parts. A processor may have no part of a region.
  for (const Path& one : processor_cases(parts, parts.times[chosen], folder / "")) {
    const vtkSmartPointer<vtkDataObject> data = read_case(one, std::nullopt);
    auto* const blocks = vtkMultiBlockDataSet::SafeDownCast(data);
    for (unsigned int i = 0; blocks && i < blocks->GetNumberOfBlocks(); ++i) {
      for (const auto& set : data_sets_in(blocks->GetBlock(i))) {
        check_geometry(*set, path);
        regions[block_name(*blocks, i)].push_back(set);
      }
    }
  }
  auto result = vtkSmartPointer<vtkMultiBlockDataSet>::New();
  for (const auto& [name, sets] : regions) result->SetBlock(result->GetNumberOfBlocks(), one_data_set(sets));
  return result;
}

vtkSmartPointer<vtkDataObject> read_ensight_step(const Path& path, std::optional<int> step) {
  const std::vector<double> times = ensight_times(path);
  const int chosen = chosen_step(step, std::max(static_cast<int>(times.size()), 1));
  return read_ensight(path, times.empty() ? std::nullopt : std::optional(times[static_cast<std::size_t>(chosen)]));
}

vtkSmartPointer<vtkDataObject> read_kind(VtkKind kind, const Path& path, std::optional<int> step) {
  constexpr std::array with_steps{VtkKind::exodus,  VtkKind::cgns, VtkKind::openfoam,
                                  VtkKind::ensight, VtkKind::xdmf, VtkKind::vtkhdf};
  if (std::find(with_steps.begin(), with_steps.end(), kind) == with_steps.end())
    chosen_step(step, 1);  // The others have one.
  switch (kind) {
    case VtkKind::legacy:
      return read_legacy(path);
    case VtkKind::image:
      return read_xml<vtkXMLImageDataReader>(path);
    case VtkKind::rectilinear:
      return read_xml<vtkXMLRectilinearGridReader>(path);
    case VtkKind::structured:
      return read_xml<vtkXMLStructuredGridReader>(path);
    case VtkKind::unstructured:
      return read_xml<vtkXMLUnstructuredGridReader>(path);
    case VtkKind::image_pieces:
      return read_xml<vtkXMLPImageDataReader>(path);
    case VtkKind::rectilinear_pieces:
      return read_xml<vtkXMLPRectilinearGridReader>(path);
    case VtkKind::structured_pieces:
      return read_xml<vtkXMLPStructuredGridReader>(path);
    case VtkKind::unstructured_pieces:
      return read_unstructured_pieces(path);
    case VtkKind::exodus:
      return read_exodus(path, step);
    case VtkKind::cgns:
      return read_cgns(path, step);
    case VtkKind::openfoam:
      return read_openfoam(path, step);
    case VtkKind::ensight:
      return read_ensight_step(path, step);
    case VtkKind::xdmf:
      return read_xdmf(path, chosen_step(step, xdmf_steps(path)));
    case VtkKind::vtkhdf:
      return read_vtkhdf(path, chosen_step(step, vtkhdf_steps(path)));
    case VtkKind::blocks:
    case VtkKind::time_series:
      break;  // read_data_sets reads them file by file.
  }
  throw std::logic_error("read_kind: unknown kind");
}

/// The sound data sets with cells of a file, or of the files that it names.
DataSets read_data_sets(VtkKind kind, const Path& path, const VtkMessages& messages, std::optional<int> step) {
  DataSets sets;
  if (kind != VtkKind::blocks && kind != VtkKind::time_series) {
    sets = data_sets_in(read_kind(kind, path, step));
    messages.throw_error(path);
    for (vtkDataSet* const set : sets) {
      check_geometry(*set, path);
      if (kind == VtkKind::legacy) name_tensors6(*set, path);
      name_active_tensors(*set);
    }
    return sets;
  }
  const std::vector<std::vector<Path>> steps = collection_steps(path);
  std::vector<Path> files;  // Of the data sets.
  for (const Path& file : steps[static_cast<std::size_t>(chosen_step(step, static_cast<int>(steps.size())))]) {
    const VtkKind kind_of_file = vtk_kind(file);
    if (kind_of_file >= kind) fail(path, "names the collection " + escaped(file.string()) + "; import that one");
    for (const auto& set : read_data_sets(kind_of_file, file, messages, std::nullopt)) {
      for (std::size_t i = 0; i < sets.size(); ++i)
        if (files[i] != file && is_same_mesh(*sets[i], *set))
          fail(path, "names the same mesh twice for one time, as " + escaped(files[i].filename().string()) +
                         " and as " + escaped(file.filename().string()) + "; remove one of the two");
      sets.push_back(set);
      files.push_back(file);
    }
  }
  return sets;
}

}  // namespace

vtkSmartPointer<vtkDataSet> read_vtk_source(const Path& path, std::optional<int> step) {
  const VtkKind kind = vtk_kind(path);
  const VtkMessages messages;
  const SilentStderr silent;
  vtkSmartPointer<vtkDataSet> result;
  try {
    result = one_data_set(read_data_sets(kind, path, messages, step), kind != VtkKind::openfoam);
  } catch (const std::bad_alloc&) {
    throw std::runtime_error(path.string() + ": is damaged, or too large: it announces more than memory holds");
  }
  messages.throw_error(path);
  if (!result) {
    const std::string& warning = messages.first_warning();
    throw std::runtime_error(path.string() + ": holds no cells" + (warning.empty() ? "" : ": " + warning));
  }
  return result;
}

int time_steps(const Path& path) {
  const VtkKind kind = vtk_kind(path);
  const VtkMessages messages;
  const SilentStderr silent;
  int steps = 1;
  if (kind == VtkKind::openfoam) steps = static_cast<int>(openfoam_parts(path, openfoam_case(path)).times.size());
  if (kind == VtkKind::cgns) steps = static_cast<int>(open_cgns(path, *vtkNew<vtkCGNSReader>()).size());
  if (kind == VtkKind::ensight) steps = static_cast<int>(ensight_times(path).size());
  if (kind == VtkKind::xdmf) steps = xdmf_steps(path);
  if (kind == VtkKind::vtkhdf) steps = vtkhdf_steps(path);
  if (kind == VtkKind::exodus) {
    vtkNew<vtkExodusIIReader> reader;
    reader->SetFileName(path.c_str());
    reader->UpdateInformation();
    steps = reader->GetNumberOfTimeSteps();
  }
  if (kind == VtkKind::time_series) steps = static_cast<int>(collection_steps(path).size());
  messages.throw_error(path);
  return std::max(steps, 1);
}

}  // namespace tensorray
