#include "tools/import/cases/openfoam.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <optional>
#include <utility>

#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <zlib.h>

#include "base/errors.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

std::optional<double> time_value(const std::string& name) {
  const bool begins = !name.empty() && (std::isdigit(static_cast<unsigned char>(name[0])) || name[0] == '-');
  return begins ? parse_number(name) : std::nullopt;
}

/// The number after "processor", or the first one of collated files in "processorsN" and "processorsN_FIRST-LAST".
struct ProcessorName {
  bool is_collated = false;
  int first = 0;
};

std::optional<ProcessorName> processor_name(const std::string& name) {
  const std::string word = "processor";
  if (name.compare(0, word.size(), word) != 0) return {};
  const bool is_collated = name.size() > word.size() && name[word.size()] == 's';
  const std::string numbers = name.substr(word.size() + (is_collated ? 1 : 0));
  if (numbers.empty() || numbers.find_first_not_of("0123456789_-") != std::string::npos) return {};
  const std::size_t underscore = numbers.find('_');
  if (!is_collated) return ProcessorName{false, std::atoi(numbers.c_str())};
  return ProcessorName{true, underscore == std::string::npos ? 0 : std::atoi(numbers.substr(underscore + 1).c_str())};
}

std::vector<fs::path> folders_in(const fs::path& folder) {
  std::vector<fs::path> folders;
  if (!fs::is_directory(folder)) return folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_directory()) folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  return folders;
}

/// The meshes of a case or of a processor: its only one, or those of its regions.
std::vector<fs::path> meshes_in(const fs::path& folder) {
  std::vector<fs::path> meshes;
  if (fs::is_directory(folder / "constant" / "polyMesh")) meshes.push_back(folder / "constant" / "polyMesh");
  for (const fs::path& region : folders_in(folder / "constant"))
    if (fs::is_directory(region / "polyMesh")) meshes.push_back(region / "polyMesh");
  return meshes;
}

void find_processors(OpenFoamParts& parts) {
  std::vector<std::pair<int, fs::path>> plain, collated;
  for (const fs::path& folder : folders_in(parts.folder)) {
    const std::optional<ProcessorName> name = processor_name(folder.filename().string());
    if (name && !meshes_in(folder).empty()) (name->is_collated ? collated : plain).emplace_back(name->first, folder);
  }
  parts.is_collated = plain.empty();
  std::vector<std::pair<int, fs::path>>& found = plain.empty() ? collated : plain;
  std::sort(found.begin(), found.end());
  for (const auto& [number, folder] : found) parts.processors.push_back(folder);
}

/// VTK opens what it finds in the folders of meshes and times.
void require_no_devices(const fs::path& folder) {
  std::error_code none;
  for (fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, none), end;
       entry != end; entry.increment(none))
    if (entry->is_other(none)) require_no_device(entry->path());
}

void check_mesh(const fs::path& mesh) {
  require_no_devices(mesh);
  for (const char* name : {"points", "faces", "owner", "neighbour"})
    if (!fs::is_regular_file(mesh / name) && !fs::is_regular_file((mesh / name).string() + ".gz"))
      fail(mesh / name, "is missing; run blockMesh again");
}

std::vector<OpenFoamTime> times_in(const fs::path& folder) {
  std::vector<OpenFoamTime> times;
  for (const fs::path& time : folders_in(folder))
    if (const std::optional<double> value = time_value(time.filename().string())) {
      require_no_devices(time);
      times.push_back({time.filename().string(), *value});
    }
  std::sort(times.begin(), times.end(), [](const auto& a, const auto& b) { return a.value < b.value; });
  return times;
}

/// The times that all processors have: of a run that goes on, some have one that others have not yet.
std::vector<OpenFoamTime> common_times(const std::vector<fs::path>& processors) {
  std::vector<OpenFoamTime> times = times_in(processors.front());
  for (const fs::path& processor : processors) {
    const auto is_missing = [&](const OpenFoamTime& time) { return !fs::is_directory(processor / time.folder); };
    times.erase(std::remove_if(times.begin(), times.end(), is_missing), times.end());
  }
  return times;
}

/// Without one of the processors, a part of the body would be missing.
void check_processors(const OpenFoamParts& parts) {
  for (std::size_t i = 0; i < parts.processors.size() && !parts.is_collated; ++i)
    if (const fs::path folder = parts.folder / ("processor" + std::to_string(i)); parts.processors[i] != folder)
      fail(folder, "is missing; copy it there too, with its constant/polyMesh");
}

bool is_later(const std::vector<OpenFoamTime>& times, const std::vector<OpenFoamTime>& other) {
  return !times.empty() && (other.empty() || times.back().value > other.back().value);
}

[[noreturn]] void fail_collated(const fs::path& file) {
  fail(file, "is damaged or cut off: it announces more bytes than it has; copy or write it again");
}

/// A file of parts in OpenFOAM's class decomposedBlockData: after the header, for each part a comment, the number of
/// its bytes, and these in parentheses. Only the first part has a header of its own, which is that of all.
class BlockFile {
 public:
  explicit BlockFile(const fs::path& path) : path_(path), file_(path, std::ios::binary) {
    std::string head(4096, '\0');
    file_.read(head.data(), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(file_.gcount()));
    file_.clear();
    const std::size_t end = head.find('}');
    has_parts_ = head.substr(0, std::min(end, head.size())).find("decomposedBlockData") != std::string::npos;
    if (has_parts_) file_.seekg(static_cast<std::streamoff>(end + 1));
  }

  bool has_parts() const { return has_parts_; }

  /// Copies the next part to `target`. @return false at the end.
  bool copy_next(const fs::path& target) {
    if (!skip_to_number()) return false;
    std::uint64_t count = 0;
    char parenthesis = 0;
    file_ >> count >> parenthesis;
    const std::uint64_t left =
        fs::file_size(path_) - static_cast<std::uint64_t>(std::max<std::streamoff>(0, file_.tellg()));
    if (!file_ || parenthesis != '(' || count > left) fail_collated(path_);
    std::ofstream out(target, std::ios::binary);
    out << header_;
    std::vector<char> buffer(1 << 20);
    for (std::uint64_t done = 0; done < count && file_;) {
      file_.read(buffer.data(), static_cast<std::streamsize>(std::min<std::uint64_t>(buffer.size(), count - done)));
      out.write(buffer.data(), file_.gcount());
      if (header_.empty()) header_ = header_in(std::string(buffer.data(), static_cast<std::size_t>(file_.gcount())));
      done += static_cast<std::uint64_t>(file_.gcount());
    }
    if (!(file_ >> parenthesis) || parenthesis != ')') fail_collated(path_);
    if (!out.flush()) fail(target, "cannot be written; is the disk full?");
    return true;
  }

 private:
  /// The text to the end of the entry FoamFile.
  static std::string header_in(const std::string& part) {
    const std::size_t name = part.find("FoamFile"), end = part.find('}', std::min(name, part.size()));
    return name == std::string::npos || end == std::string::npos ? "" : part.substr(name, end + 1 - name) + "\n";
  }

  bool skip_to_number() {
    constexpr auto any_number = std::numeric_limits<std::streamsize>::max();
    while (file_ >> std::ws && file_.peek() == '/') file_.ignore(any_number, '\n');
    return file_ && std::isdigit(file_.peek());
  }

  fs::path path_;
  std::ifstream file_;
  bool has_parts_ = false;
  std::string header_;  ///< Of the first part, once it has been read.
};

/// Distributes the files of `from` and of the folders in it to as many cases as there are parts.
void split_folder(const fs::path& from, const fs::path& relative, int first, const fs::path& target,
                  std::vector<fs::path>& cases) {
  const auto case_of = [&](int processor) {
    const fs::path folder = target / ("processor" + std::to_string(processor));
    if (std::find(cases.begin(), cases.end(), folder) == cases.end()) cases.push_back(folder);
    fs::create_directories(folder / relative);
    return folder;
  };
  for (const fs::directory_entry& entry : fs::directory_iterator(from)) {
    const fs::path name = relative / entry.path().filename();
    if (entry.is_directory()) split_folder(entry.path(), name, first, target, cases);
    if (!entry.is_regular_file()) continue;
    BlockFile file(entry.path());
    if (!file.has_parts()) continue;
    for (int processor = first;; ++processor) {
      const fs::path part = target / "part";
      if (!file.copy_next(part)) break;
      fs::rename(part, case_of(processor) / name);
    }
  }
}

/// Whether a file says that its values are a list: neither one for all cells, nor elsewhere (in a macro, or in another
/// file that it includes).
bool has_list(const std::string& head) {
  // Fields with patches have internalField, those without have value.
  const bool has_patches =
      head.find("internalField") != std::string::npos || head.find("boundaryField") != std::string::npos;
  for (const std::string& word : words_after(head, has_patches ? "internalField" : "value"))
    if (word == "uniform" || word == "nonuniform") return word == "nonuniform";
  return false;
}

bool is_same_everywhere(vtkDataArray& array) {
  for (int component = 0; component < array.GetNumberOfComponents(); ++component) {
    const double first = array.GetComponent(0, component);
    for (vtkIdType i = 1; i < array.GetNumberOfTuples(); ++i)
      if (array.GetComponent(i, component) != first) return false;
  }
  return true;
}

void reorder(vtkDataArray& array) {
  constexpr std::array<std::size_t, 6> order{0, 3, 5, 1, 4, 2};  // Of VTK's components among OpenFOAM's.
  std::array<double, 6> theirs{}, ours{};
  for (vtkIdType i = 0; i < array.GetNumberOfTuples(); ++i) {
    array.GetTuple(i, theirs.data());
    for (std::size_t component = 0; component < 6; ++component) ours[component] = theirs[order[component]];
    array.SetTuple(i, ours.data());
  }
}

}  // namespace

OpenFoamParts openfoam_parts(const fs::path& path, const fs::path& folder) {
  OpenFoamParts parts{fs::absolute(folder), {}, false, {}};
  if (!fs::is_regular_file(folder / "system" / "controlDict"))
    fail(path, "is no OpenFOAM case: " + (folder / "system/controlDict").string() + " is missing");
  std::vector<fs::path> meshes = meshes_in(folder);
  parts.times = times_in(folder);
  find_processors(parts);
  const std::vector<OpenFoamTime> times_of_parts =
      parts.processors.empty() ? std::vector<OpenFoamTime>() : common_times(parts.processors);
  if (!parts.processors.empty() && (meshes.empty() || is_later(times_of_parts, parts.times))) {
    check_processors(parts);
    parts.times = times_of_parts;
    meshes.clear();
    for (const fs::path& processor : parts.processors)
      for (const fs::path& mesh : meshes_in(processor)) meshes.push_back(mesh);
  } else {
    parts.processors.clear();
  }
  if (meshes.empty())
    fail(path, "has no mesh: " + (folder / "constant/polyMesh").string() + " is missing; run blockMesh first");
  for (const fs::path& mesh : meshes) check_mesh(mesh);
  if (parts.times.empty())
    fail(path, parts.processors.empty() ? "has no time folder; run the case's solver first"
                                        : "has no time folder that all of its processors have; run the case's solver");
  return parts;
}

std::vector<fs::path> processor_cases(const OpenFoamParts& parts, const OpenFoamTime& time, const fs::path& target) {
  std::vector<fs::path> cases;
  for (const fs::path& processor : parts.processors) {
    if (parts.is_collated) {
      const int first = processor_name(processor.filename().string())->first;
      for (const std::string& name : {std::string("constant"), time.folder})
        if (fs::is_directory(processor / name)) split_folder(processor / name, name, first, target, cases);
      continue;
    }
    cases.push_back(target / processor.filename());
    fs::create_directories(cases.back());
    for (const std::string& name : {std::string("constant"), time.folder})
      if (fs::is_directory(processor / name)) fs::create_directory_symlink(processor / name, cases.back() / name);
  }
  for (const fs::path& one : cases) fs::create_directory_symlink(parts.folder / "system", one / "system");
  return cases;
}

std::string openfoam_text(const fs::path& path, std::size_t size) {
  std::string text;
  std::vector<char> buffer(std::min<std::size_t>(size, 1 << 20));
  const gzFile file = gzopen(path.c_str(), "rb");
  if (!file) return {};
  for (int count = 1; count > 0 && text.size() < size;
       text.append(buffer.data(), static_cast<std::size_t>(std::max(count, 0))))
    count = gzread(file, buffer.data(), static_cast<unsigned>(buffer.size()));
  gzclose(file);
  return text;
}

std::string without_comments(const std::string& text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const bool is_line = text.compare(i, 2, "//") == 0;
    if (is_line || text.compare(i, 2, "/*") == 0) {
      const std::size_t end = is_line ? text.find('\n', i) : text.find("*/", i + 2);
      if (end == std::string::npos) break;
      result += ' ';
      i = end + (is_line ? 1 : 2);
    } else {
      result += text[i++];
    }
  }
  return result;
}

std::vector<std::string> words_after(const std::string& text, const std::string& key) {
  const auto is_of_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  std::vector<std::string> words;
  for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
    const std::size_t end_of_key = at + key.size();
    std::size_t begin = text.find_first_not_of(" \t\r\n\v\f", end_of_key);
    if ((at > 0 && is_of_word(text[at - 1])) || begin == std::string::npos || begin == end_of_key) continue;
    if (text[begin] == '"') ++begin;
    const std::size_t end = std::min(text.find_first_of(" \t\r\n\v\f;\"", begin), text.size());
    if (end > begin) words.push_back(text.substr(begin, end - begin));
  }
  return words;
}

void correct_uniform_tensors(vtkDataSet& data, const fs::path& time) {
  for (const auto& entry : fs::directory_iterator(time)) {
    constexpr std::size_t size = 1 << 16;  // The value of a uniform field stands before its patches.
    const std::string head = entry.is_regular_file() ? without_comments(openfoam_text(entry.path(), size)) : "";
    const std::vector<std::string> names = words_after(head, "object");  // VTK's arrays have them.
    if (names.empty() || has_list(head)) continue;
    for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL}) {
      vtkDataArray* const array = data.GetAttributes(type)->GetArray(names.front().c_str());
      if (!array || array->GetNumberOfComponents() != 6 || array->HasAComponentName()) continue;
      if (is_same_everywhere(*array)) reorder(*array);
    }
  }
}

}  // namespace tensorray
