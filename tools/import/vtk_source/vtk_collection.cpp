#include "tools/import/vtk_source/vtk_collection.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <vtkSmartPointer.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLUtilities.h>

#include "base/errors.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

using FilesByTime = std::map<double, std::vector<fs::path>>;

double time_of(vtkXMLDataElement& element, const fs::path& path) {
  const char* const text = element.GetAttribute("timestep");
  double time = 0;
  if (text && (!element.GetScalarAttribute("timestep", time) || !std::isfinite(time)))
    fail(path, "its time '" + escaped(text) + "' is not a number; write it again");
  return time;
}

/// A file that is named twice for one time counts once.
void add(std::vector<fs::path>& files, const fs::path& file) {
  if (std::find(files.begin(), files.end(), file) == files.end()) files.push_back(file);
}

/// Collects the <DataSet file="..."> of volumes in a tree of blocks.
void collect(vtkXMLDataElement& element, const fs::path& path, FilesByTime& steps) {
  for (int i = 0; i < element.GetNumberOfNestedElements(); ++i) {
    vtkXMLDataElement& nested = *element.GetNestedElement(i);
    const char* const file = nested.GetAttribute("file");
    if (nested.GetName() == std::string("DataSet") && file && lower_case_ending(file) != ".vtp")
      add(steps[time_of(nested, path)], (path.parent_path() / file).lexically_normal());
    collect(nested, path, steps);
  }
}

}  // namespace

std::vector<std::vector<fs::path>> collection_steps(const fs::path& path) {
  const auto root = vtkSmartPointer<vtkXMLDataElement>::Take(vtkXMLUtilities::ReadElementFromFile(path.c_str()));
  if (!root) fail(path, "is damaged: it is no XML; write it again");
  FilesByTime by_time;
  collect(*root, path, by_time);
  if (by_time.empty()) fail(path, "names no file of a volume; save the volume's grid");
  std::vector<std::vector<fs::path>> steps;
  for (auto& [time, files] : by_time) steps.push_back(std::move(files));
  return steps;
}

}  // namespace tensorray
