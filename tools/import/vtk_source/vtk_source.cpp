#include "tools/import/vtk_source/vtk_source.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <new>
#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>
#include <vtkDataSet.h>
#include <vtkSmartPointer.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLUtilities.h>

#include "base/errors.h"
#include "base/process/process_limits.h"
#include "base/text/text.h"
#include "tools/import/vtk/vtk_data_sets.h"
#include "tools/import/vtk/vtk_messages.h"
#include "tools/import/vtk_formats/array_names.h"
#include "tools/import/vtk_source/mesh_formats.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;
using FilesByTime = std::map<double, std::vector<Path>>;

double time_of(vtkXMLDataElement& element, const Path& path) {
  const char* const text = element.GetAttribute("timestep");
  double time = 0;
  if (text && (!element.GetScalarAttribute("timestep", time) || !std::isfinite(time)))
    fail(path, "its time '" + escaped(text) + "' is not a number; write it again");
  return time;
}

/// A file that is named twice for one time counts once.
void add(std::vector<Path>& files, const Path& file) {
  if (std::find(files.begin(), files.end(), file) == files.end()) files.push_back(file);
}

/// Collects the <DataSet file="..."> of volumes in a tree of blocks.
void collect(vtkXMLDataElement& element, const Path& path, FilesByTime& steps) {
  for (int i = 0; i < element.GetNumberOfNestedElements(); ++i) {
    vtkXMLDataElement& nested = *element.GetNestedElement(i);
    const char* const file = nested.GetAttribute("file");
    if (nested.GetName() == std::string("DataSet") && file && lower_case_ending(file) != ".vtp")
      add(steps[time_of(nested, path)], (path.parent_path() / file).lexically_normal());
    collect(nested, path, steps);
  }
}

/// The files of a series (.series), in the order of their times.
std::vector<std::vector<Path>> series_steps(const Path& path) {
  std::ifstream file(path, std::ios::binary);
  const auto json = nlohmann::json::parse(file, nullptr, false);
  std::multimap<double, Path> files;
  try {
    for (const auto& each : json.at("files"))
      files.emplace(each.value("time", static_cast<double>(files.size())), each.at("name").get<std::string>());
  } catch (const nlohmann::json::exception&) {
    files.clear();
  }
  if (files.empty()) fail(path, "is damaged, or names no files; write it again");
  std::vector<std::vector<Path>> steps;
  for (const auto& [time, name] : files) steps.push_back({(path.parent_path() / name).lexically_normal()});
  return steps;
}

/// The files of volumes, each once, that a collection (.vtm, .pvd, .series) names for each step of time, in the order
/// of times. A .vtm has one step, with all of its blocks. Surfaces (.vtp) are left out, because exporters put a body's
/// patches beside its volume.
std::vector<std::vector<Path>> collection_steps(const Path& path) {
  if (lower_case_ending(path) == ".series") return series_steps(path);
  const auto root = vtkSmartPointer<vtkXMLDataElement>::Take(vtkXMLUtilities::ReadElementFromFile(path.c_str()));
  if (!root) fail(path, "is damaged: it is no XML; write it again");
  FilesByTime by_time;
  collect(*root, path, by_time);
  if (by_time.empty()) fail(path, "names no file of a volume; save the volume's grid");
  std::vector<std::vector<Path>> steps;
  for (auto& [time, files] : by_time) steps.push_back(std::move(files));
  return steps;
}

/// A step, from 0 on: the user's, or the last one.
std::size_t chosen_step(std::size_t steps, std::optional<int> step) {
  if (step && static_cast<std::size_t>(*step) >= steps)
    throw std::invalid_argument("--steps " + std::to_string(*step + 1) + ": there are " + std::to_string(steps) +
                                " steps of time");
  return step ? static_cast<std::size_t>(*step) : steps - 1;
}

std::size_t steps_in(const MeshFile& file) { return static_cast<std::size_t>(std::max(1, file.steps)); }

/// What a file is read for: VTK's errors, and notes for the user.
struct Reading {
  VtkMessages messages;
  std::vector<std::string> notes;
};

/// Reads the chosen step, or the last one that can be read. An error that stays the same from a step to the one before
/// is not one of the step.
template <class Read>
DataSets read_step(const Path& path, std::size_t steps, std::optional<int> step, Reading& reading, const Read& read) {
  const std::size_t last = chosen_step(steps, step);
  std::string first_error, error_after;
  for (std::size_t at = last;; --at) {
    try {
      DataSets sets = read(at);
      reading.messages.throw_error(path);
      if (steps > 1 && !step)
        reading.notes.push_back(
            "step " + std::to_string(at + 1) + " of " + std::to_string(steps) + " is taken" +
            (at < last ? ", as those after it are not complete: " + first_error : "; --steps chooses another one"));
      return sets;
    } catch (const std::runtime_error& error) {
      if (first_error.empty()) first_error = error.what();
      if (step || at == 0 || error.what() == error_after) throw std::runtime_error(first_error);
      error_after = error.what();
      reading.messages.forget();
    }
  }
}

DataSets read_data_sets(const Path& path, const MeshFormat& format, Reading& reading, std::optional<int> step);

/// Those of all files that a collection names for a step.
DataSets read_collection(const Path& path, const MeshFormat& format, const std::vector<Path>& named, Reading& reading) {
  DataSets sets;
  std::vector<Path> files;  // Of the data sets.
  for (const Path& file : named) {
    const MeshFormat& of_file = find_format(file);
    if (&of_file >= &format) fail(path, "names the collection " + escaped(file.string()) + "; import that one");
    for (const auto& set : read_data_sets(file, of_file, reading, std::nullopt)) {
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

/// The sound data sets with cells of a file, or of the files that it names.
DataSets read_data_sets(const Path& path, const MeshFormat& format, Reading& reading, std::optional<int> step) {
  if (!format.open) {
    const std::vector<std::vector<Path>> steps = collection_steps(path);
    return read_step(path, steps.size(), step, reading,
                     [&](std::size_t at) { return read_collection(path, format, steps[at], reading); });
  }
  std::optional<ExtraMemoryLimit> limit;
  if (!format.has_other_files) limit.emplace(max_memory_of(path));
  const MeshFile file = format.open(path);
  reading.notes.insert(reading.notes.end(), file.notes.begin(), file.notes.end());
  return read_step(path, steps_in(file), step, reading, [&](std::size_t at) {
    const DataSets sets = data_sets_in(file.read(static_cast<int>(at)));
    reading.messages.throw_error(path);
    for (vtkDataSet* const set : sets) {
      check_geometry(*set, path);
      name_active_tensors(*set);
    }
    return sets;
  });
}

}  // namespace

vtkSmartPointer<vtkDataSet> read_vtk_source(const Path& path, std::optional<int> step,
                                            std::vector<std::string>* notes) {
  const MeshFormat& format = find_format(path);
  Reading reading;
  vtkSmartPointer<vtkDataSet> result;
  try {
    result = one_data_set(read_data_sets(path, format, reading, step));
  } catch (const std::bad_alloc&) {
    throw std::runtime_error(path.string() + ": is damaged, or too large: it announces more than memory holds");
  }
  if (notes) *notes = reading.notes;
  reading.messages.throw_error(path);
  if (!result) {
    const std::string& warning = reading.messages.first_warning();
    throw std::runtime_error(path.string() + ": holds no cells" + (warning.empty() ? "" : ": " + warning));
  }
  return result;
}

int time_steps(const Path& path) {
  const MeshFormat& format = find_format(path);
  const VtkMessages messages;
  const std::size_t steps = format.open ? steps_in(format.open(path)) : collection_steps(path).size();
  messages.throw_error(path);
  return static_cast<int>(steps);
}

}  // namespace tensorray
