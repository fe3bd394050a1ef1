#include "tools/import/vtk/vtk_source.h"

#include <algorithm>
#include <array>
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
#include "base/temporary_folder.h"
#include "base/text.h"
#include "tools/import/vtk/ensight.h"
#include "tools/import/vtk/openfoam_parts.h"
#include "tools/import/vtk/point_seams.h"
#include "tools/import/vtk/silent_stderr.h"
#include "tools/import/vtk/vtk_collection.h"
#include "tools/import/vtk/vtk_geometry.h"
#include "tools/import/vtk/vtk_kind.h"
#include "tools/import/vtk/vtk_messages.h"
#include "tools/import/vtk/vtk_pieces.h"
#include "tools/import/vtk/vtkhdf.h"
#include "tools/import/vtk/xdmf.h"

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
  const int count = static_cast<int>(times.size());
  if (count > 0 || step) reader->UpdateTimeStep(times.at(static_cast<std::size_t>(chosen_step(step, count))));
  reader->Update();
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
      const char* const name =
          blocks->HasMetaData(i) ? blocks->GetMetaData(i)->Get(vtkCompositeDataSet::NAME()) : nullptr;
      for (const auto& set : data_sets_in(blocks->GetBlock(i))) {
        check_geometry(*set, path);
        regions[name ? name : ""].push_back(set);
      }
    }
  }
  auto result = vtkSmartPointer<vtkMultiBlockDataSet>::New();
  for (const auto& [name, sets] : regions) {
    share_point_values(sets);
    result->SetBlock(result->GetNumberOfBlocks(), one_data_set(sets));
  }
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
    for (vtkDataSet* const set : sets) check_geometry(*set, path);
    return sets;
  }
  const std::vector<std::vector<Path>> steps = collection_steps(path);
  for (const Path& file : steps[static_cast<std::size_t>(chosen_step(step, static_cast<int>(steps.size())))]) {
    const VtkKind kind_of_file = vtk_kind(file);
    if (kind_of_file >= kind) fail(path, "names the collection " + escaped(file.string()) + "; import that one");
    const DataSets more = read_data_sets(kind_of_file, file, messages, std::nullopt);
    sets.insert(sets.end(), more.begin(), more.end());
  }
  return sets;
}

/// Names the components, so that the user need not give the order. VTK has already reordered OpenFOAM's symmTensors.
void name_symmetric_components(vtkDataSet& data) {
  const char* const names[] = {"XX", "YY", "ZZ", "XY", "YZ", "XZ"};
  for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL}) {
    for (int i = 0; i < data.GetAttributes(type)->GetNumberOfArrays(); ++i) {
      vtkDataArray* const array = data.GetAttributes(type)->GetArray(i);
      if (!array || array->GetNumberOfComponents() != 6) continue;
      for (int component = 0; component < 6; ++component) array->SetComponentName(component, names[component]);
    }
  }
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
  if (kind == VtkKind::openfoam) name_symmetric_components(*result);
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
