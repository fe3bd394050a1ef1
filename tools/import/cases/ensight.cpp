#include "tools/import/cases/ensight.h"

#include <algorithm>
#include <array>

#include <vtkDataArray.h>
#include <vtkDataArrayCollection.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkGenericEnSightReader.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>

#include "tools/import/cases/ensight_files.h"
#include "tools/import/vtk/vtk_pieces.h"

namespace tensorray {
namespace {

/// @param path  ensight_case has accepted it: with some damaged cases the reader never ends.
std::vector<double> open_ensight(const std::filesystem::path& path, vtkGenericEnSightReader& reader) {
  reader.SetCaseFileName(std::filesystem::absolute(path).c_str());
  reader.UpdateInformation();
  std::vector<double> times;
  vtkDataArrayCollection* const sets = reader.GetTimeSets();
  for (int i = 0; sets && i < sets->GetNumberOfItems(); ++i)
    for (vtkIdType k = 0; k < sets->GetItem(i)->GetNumberOfTuples(); ++k)
      times.push_back(sets->GetItem(i)->GetComponent(k, 0));
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

void name_components(vtkDataSetAttributes& data) {
  constexpr std::array names{"XX", "YY", "ZZ", "XY", "YZ", "XZ"};  // VTK has reordered them.
  for (int i = 0; i < data.GetNumberOfArrays(); ++i) {
    vtkDataArray* const array = data.GetArray(i);
    if (!array || array->GetNumberOfComponents() != 6) continue;
    for (int component = 0; component < 6; ++component)
      array->SetComponentName(component, names[static_cast<std::size_t>(component)]);
  }
}

}  // namespace

std::vector<double> ensight_times(const std::filesystem::path& path) {
  ensight_case(path, std::nullopt);
  return open_ensight(path, *vtkNew<vtkGenericEnSightReader>());
}

vtkSmartPointer<vtkDataObject> read_ensight(const std::filesystem::path& path, std::optional<double> time) {
  const EnSightCase given = ensight_case(path, time);
  vtkNew<vtkGenericEnSightReader> reader;
  open_ensight(path, *reader);
  reader->ReadAllVariablesOn();
  if (time) reader->SetTimeValue(static_cast<float>(*time));
  reader->Update();
  const vtkSmartPointer<vtkDataObject> result = reader->GetOutputDataObject(0);
  if (result) check_ensight_ends(given, *result);
  for (vtkDataSet* const part : data_sets_in(result))
    for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL}) name_components(*part->GetAttributes(type));
  return result;
}

}  // namespace tensorray
