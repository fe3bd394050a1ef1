#include "tools/import/vtk/vtk_collection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <vtkSmartPointer.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLUtilities.h>

#include "base/errors.h"
#include "base/text.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

struct Member {
  fs::path file;
  double time = 0;
};

double time_of(vtkXMLDataElement& element, const fs::path& path) {
  const char* const text = element.GetAttribute("timestep");
  double time = 0;
  if (text && (!element.GetScalarAttribute("timestep", time) || !std::isfinite(time)))
    fail(path, "its time '" + escaped(text) + "' is not a number; write it again");
  return time;
}

/// Collects the <DataSet file="..."> in a tree of blocks.
void collect(vtkXMLDataElement& element, const fs::path& path, std::vector<Member>& members) {
  for (int i = 0; i < element.GetNumberOfNestedElements(); ++i) {
    vtkXMLDataElement& nested = *element.GetNestedElement(i);
    const char* const file = nested.GetAttribute("file");
    if (nested.GetName() == std::string("DataSet") && file)
      members.push_back({path.parent_path() / file, time_of(nested, path)});
    collect(nested, path, members);
  }
}

}  // namespace

std::vector<fs::path> collection_files(const fs::path& path) {
  const auto root = vtkSmartPointer<vtkXMLDataElement>::Take(vtkXMLUtilities::ReadElementFromFile(path.c_str()));
  if (!root) fail(path, "is damaged: it is no XML; write it again");
  std::vector<Member> members;
  collect(*root, path, members);
  members.erase(std::remove_if(members.begin(), members.end(),
                               [](const Member& member) { return lower_case_ending(member.file) == ".vtp"; }),
                members.end());
  if (members.empty()) fail(path, "names no file of a volume; save the volume's grid");
  double last = -std::numeric_limits<double>::infinity();
  for (const Member& member : members) last = std::max(last, member.time);
  std::vector<fs::path> files;
  for (const Member& member : members)
    if (member.time == last) files.push_back(member.file);
  return files;
}

}  // namespace tensorray
