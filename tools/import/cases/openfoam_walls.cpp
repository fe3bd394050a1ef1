#include <algorithm>
#include <optional>
#include <regex>

#include <vtkCell.h>
#include <vtkCellData.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataArray.h>
#include <vtkInformation.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkOpenFOAMReader.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>

#include "tools/import/cases/openfoam.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

/// What a file says of a patch.
struct PatchEntry {
  std::string name;  ///< In quotation marks: a regular expression.
  std::optional<Wall::Kind> kind;
  bool has_value = false;
};

PatchEntry patch_entry(const std::string& name, const std::string& text) {
  const auto first = [&](const char* key) {
    const std::vector<std::string> words = words_after(text, key);
    return words.empty() ? std::string() : words.front();
  };
  PatchEntry entry{name, {}, false};
  const std::string type = first("type"), value = first("value");
  const bool is_joined =
      type == "empty" || type == "wedge" || type.rfind("cyclic", 0) == 0 || type.rfind("processor", 0) == 0;
  entry.has_value = type != "noSlip" && (value.rfind("uniform", 0) == 0 || value.rfind("nonuniform", 0) == 0);
  if (type == "zeroGradient")
    entry.kind = Wall::Kind::zero_gradient;
  else if (type == "symmetry" || type == "symmetryPlane" || type == "slip")
    entry.kind = Wall::Kind::slip;
  else if (type == "noSlip" || (entry.has_value && !is_joined))
    entry.kind = Wall::Kind::value;
  return entry;
}

/// The entries of boundaryField, each of which is a name and a group in braces.
std::vector<PatchEntry> patch_entries(const std::string& text) {
  constexpr const char* blanks = " \t\r\n";
  std::vector<PatchEntry> entries;
  std::size_t open = text.find('{');
  while (open != std::string::npos && (open = text.find('{', open + 1)) != std::string::npos) {
    const std::size_t end = text.find_last_not_of(blanks, open - 1),
                      close = std::min(text.find('}', open), text.size());
    const std::size_t begin = text.find_last_of(" \t\r\n{}", end) + 1;
    entries.push_back(patch_entry(text.substr(begin, end + 1 - begin), text.substr(open + 1, close - open - 1)));
  }
  return entries;
}

/// The entry of a patch: that of its name, or else the last expression that fits.
const PatchEntry* entry_of(const std::vector<PatchEntry>& entries, const std::string& patch) {
  const PatchEntry* found = nullptr;
  for (const PatchEntry& entry : entries) {
    if (entry.name == patch) return &entry;
    if (entry.name.size() < 2 || entry.name.front() != '"') continue;
    try {
      if (std::regex_match(patch, std::regex(entry.name.substr(1, entry.name.size() - 2), std::regex::extended)))
        found = &entry;
    } catch (const std::regex_error&) {
    }
  }
  return found;
}

using Entries = std::map<std::string, std::vector<PatchEntry>>;

/// Of all vectors in a folder.
Entries entries_in(const fs::path& folder) {
  Entries entries;
  for (const auto& file : fs::directory_iterator(folder)) {
    const std::string head = file.is_regular_file() ? without_comments(openfoam_text(file.path(), 1 << 16)) : "";
    const std::vector<std::string> kind = words_after(head, "class"), name = words_after(head, "object");
    if (kind.empty() || kind.front() != "volVectorField" || name.empty()) continue;
    const std::string text = openfoam_text(file.path(), std::string::npos);
    if (const std::size_t patches = text.rfind("boundaryField"); patches != std::string::npos)
      entries[name.front()] = patch_entries(text.substr(patches));
  }
  return entries;
}

void add_patch(vtkPolyData& patch, const std::string& field, const PatchEntry& entry, OpenFoamWalls& walls) {
  vtkDataArray* const values = patch.GetCellData()->GetArray(field.c_str());
  if (!entry.kind || (entry.has_value && *entry.kind == Wall::Kind::value && !values)) return;
  for (vtkIdType id = 0; id < patch.GetNumberOfCells(); ++id) {
    vtkCell& face = *patch.GetCell(id);
    Eigen::Matrix3Xd corners(3, face.GetNumberOfPoints());
    for (int i = 0; i < face.GetNumberOfPoints(); ++i) face.GetPoints()->GetPoint(i, corners.col(i).data());
    const FaceMeasure measure = face_measure(corners);
    Wall wall{measure.centre, measure.area.normalized(), *entry.kind};
    if (entry.has_value && wall.kind == Wall::Kind::value) values->GetTuple(id, wall.value.data());
    walls[field].push_back(wall);
  }
}

/// The entries of fields, by the folders of the time and of its regions.
using EntriesByFolder = std::map<fs::path, Entries>;

EntriesByFolder entries_by_folder(const fs::path& time) {
  EntriesByFolder entries{{time, entries_in(time)}};
  for (const auto& region : fs::directory_iterator(time))
    if (region.is_directory()) entries[region.path()] = entries_in(region.path());
  return entries;
}

/// Selects the vectors, and the patches of which all vectors say something. @return whether there are some.
bool select_patches(vtkOpenFOAMReader& reader, const fs::path& time, const EntriesByFolder& by_folder) {
  reader.DisableAllCellArrays();
  for (const auto& [folder, entries] : by_folder)
    for (const auto& [field, of_field] : entries) reader.SetCellArrayStatus(field.c_str(), 1);
  bool any = false;
  for (int i = 0; i < reader.GetNumberOfPatchArrays(); ++i) {
    const std::string name = reader.GetPatchArrayName(i), kind = "patch/";  // Perhaps after a region and a slash.
    const std::size_t at = name.find(kind);
    const auto found = by_folder.find(at == 0 || at == std::string::npos ? time : time / name.substr(0, at - 1));
    const bool is_wanted = at != std::string::npos && found != by_folder.end() && !found->second.empty() &&
                           std::all_of(found->second.begin(), found->second.end(), [&](const auto& field) {
                             return entry_of(field.second, name.substr(at + kind.size())) != nullptr;
                           });
    reader.SetPatchArrayStatus(name.c_str(), is_wanted);
    any = any || is_wanted;
  }
  return any;
}

/// @param folder  Of the fields, or of the folders of regions.
void add_blocks(vtkMultiBlockDataSet& blocks, const fs::path& folder, const EntriesByFolder& by_folder,
                OpenFoamWalls& walls) {
  for (unsigned int i = 0; i < blocks.GetNumberOfBlocks(); ++i) {
    const char* const given = blocks.HasMetaData(i) ? blocks.GetMetaData(i)->Get(vtkCompositeDataSet::NAME()) : nullptr;
    const std::string name = given ? given : "";
    if (auto* const group = vtkMultiBlockDataSet::SafeDownCast(blocks.GetBlock(i)))
      add_blocks(*group, by_folder.count(folder / name) ? folder / name : folder, by_folder, walls);
    if (auto* const patch = vtkPolyData::SafeDownCast(blocks.GetBlock(i)))
      for (const auto& [field, entries] : by_folder.at(folder))
        if (const PatchEntry* const entry = entry_of(entries, name)) add_patch(*patch, field, *entry, walls);
  }
}

}  // namespace

void add_openfoam_walls(const fs::path& folder, const OpenFoamTime& time, OpenFoamWalls& walls) {
  const EntriesByFolder entries = entries_by_folder(folder / time.folder);
  vtkNew<vtkOpenFOAMReader> reader;
  reader->SetFileName((folder / "system" / "controlDict").c_str());
  reader->SkipZeroTimeOff();
  reader->UpdateInformation();
  if (!select_patches(*reader, folder / time.folder, entries)) return;
  reader->CreateCellToPointOff();
  reader->UpdateTimeStep(time.value);
  reader->Update();
  add_blocks(*reader->GetOutput(), folder / time.folder, entries, walls);
}

}  // namespace tensorray
