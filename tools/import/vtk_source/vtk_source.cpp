#include "tools/import/vtk_source/vtk_source.h"

#include <algorithm>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <vtkDataSet.h>
#include <vtkSmartPointer.h>

#include "base/errors.h"
#include "base/process/process_limits.h"
#include "base/text/text.h"
#include "tools/import/vtk/vtk_geometry.h"
#include "tools/import/vtk/vtk_messages.h"
#include "tools/import/vtk/vtk_pieces.h"
#include "tools/import/vtk_formats/array_names.h"
#include "tools/import/vtk_formats/vtk_tags.h"
#include "tools/import/vtk_source/find_format.h"
#include "tools/import/vtk_source/vtk_collection.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

int steps_in(const MeshFormat& format, const Path& path) { return format.steps ? std::max(1, format.steps(path)) : 1; }

/// Checks a number that the user gives. @return the step, from 0 on.
int chosen_step(const MeshFormat& format, const Path& path, std::optional<int> step) {
  const int steps = steps_in(format, path);
  if (step && *step >= steps)
    throw std::invalid_argument("--steps " + std::to_string(*step + 1) + ": there are " + std::to_string(steps) +
                                " steps of time");
  return step.value_or(steps - 1);
}

/// The sound data sets with cells of a file, or of the files that it names.
DataSets read_data_sets(const MeshFormat& format, const Path& path, const VtkMessages& messages,
                        std::optional<int> step) {
  DataSets sets;
  const int chosen = chosen_step(format, path, step);
  if (format.read) {
    std::optional<ExtraMemoryLimit> limit;
    if (!format.has_other_files) limit.emplace(max_memory_of(path));
    sets = data_sets_in(format.read(path, chosen));
    messages.throw_error(path);
    for (vtkDataSet* const set : sets) {
      check_geometry(*set, path);
      name_active_tensors(*set);
    }
    return sets;
  }
  std::vector<Path> files;  // Of the data sets.
  const std::vector<std::vector<Path>> steps = collection_steps(path);
  for (const Path& file : steps[static_cast<std::size_t>(chosen)]) {
    const MeshFormat& of_file = find_format(file);
    if (&of_file >= &format) fail(path, "names the collection " + escaped(file.string()) + "; import that one");
    for (const auto& set : read_data_sets(of_file, file, messages, std::nullopt)) {
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
  const MeshFormat& format = find_format(path);
  const VtkMessages messages;
  vtkSmartPointer<vtkDataSet> result;
  try {
    result = one_data_set(read_data_sets(format, path, messages, step));
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
  const MeshFormat& format = find_format(path);
  const VtkMessages messages;
  const int steps = steps_in(format, path);
  messages.throw_error(path);
  return steps;
}

}  // namespace tensorray
