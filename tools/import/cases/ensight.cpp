#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <vtkDataSet.h>
#include <vtkGenericEnSightReader.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>

#include "base/errors.h"
#include "base/files/temporary_folder.h"
#include "base/text/text.h"
#include "tools/import/cases/case_files.h"
#include "tools/import/vtk_formats/array_names.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;
using Numbers = std::vector<double>;

/// An entry of a case, "NAME: VALUE". Lists may go on in the next lines.
struct Entry {
  std::string section, name, value;
};

/// The steps of a time set, and the numbers in the names of their files.
struct TimeSet {
  Numbers times, numbers;
  double start = 0, increment = 1;
};

bool begins_with_number(const std::string& text) {
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  return end != text.c_str();
}

std::vector<Entry> entries_of(const fs::path& path) {
  const std::set<std::string> sections{"FORMAT", "GEOMETRY", "VARIABLE", "TIME", "FILE", "MATERIAL", "SCRIPTS"};
  std::ifstream file(path, std::ios::binary);
  std::vector<Entry> entries;
  std::string section, line;
  for (int number = 1; std::getline(file, line); ++number) {
    line = trimmed(line.substr(0, line.find('#')));
    const std::size_t colon = line.find(':');
    if (line.empty()) continue;
    if (sections.count(line) > 0)
      section = line;
    else if (colon != std::string::npos && !section.empty())
      entries.push_back({section, lower_case(trimmed(line.substr(0, colon))), trimmed(line.substr(colon + 1))});
    else if (!entries.empty() && (begins_with_number(line) || section == "SCRIPTS" || section == "MATERIAL"))
      entries.back().value += " " + line;
    else
      fail(path, fmt::format("its line {} is neither a section of EnSight nor an entry: '{}'; copy or write it again",
                             number, escaped(line)));
  }
  return entries;
}

Numbers numbers_in(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<double>(stream), {}};
}

std::map<int, TimeSet> time_sets(const std::vector<Entry>& entries) {
  std::map<int, TimeSet> sets;
  int current = 0;
  for (const Entry& entry : entries) {
    if (entry.section != "TIME") continue;
    const Numbers numbers = numbers_in(entry.value);
    if (numbers.empty()) continue;
    if (entry.name == "time set") current = static_cast<int>(std::clamp(numbers[0], 0.0, 1e6));
    if (entry.name == "time values") sets[current].times = numbers;
    if (entry.name == "filename numbers") sets[current].numbers = numbers;
    if (entry.name == "filename start number") sets[current].start = numbers[0];
    if (entry.name == "filename increment") sets[current].increment = numbers[0];
  }
  return sets;
}

/// The number in the name of a file at a time: of the last step until then.
double file_number(const TimeSet& set, float time) {
  std::size_t step = 0;
  for (std::size_t i = 0; i < set.times.size(); ++i)
    if (static_cast<float>(set.times[i]) <= time) step = i;
  if (set.numbers.empty()) return set.start + set.increment * static_cast<double>(step);
  return set.numbers[std::min(step, set.numbers.size() - 1)];
}

/// Removes the numbers of sets in front of the words of a value. @return the first of these numbers, or 1.
int take_set(std::vector<std::string>& words) {
  int set = 0;
  while (words.size() > 1 && words[0].find_first_not_of("0123456789") == std::string::npos) {
    if (set == 0) set = std::atoi(words[0].c_str());
    words.erase(words.begin());
  }
  return set == 0 ? 1 : set;
}

/// The words of a value. Those in quotes may have blanks.
std::vector<std::string> words_of(const std::string& value) {
  std::istringstream stream(value);
  std::vector<std::string> words;
  for (std::string word; stream >> std::quoted(word, '"', '\0');) words.push_back(word);
  return words;
}

/// The file of an entry "[TIME SET] [FILE SET] [DESCRIPTION] FILE"; empty if its name is not known.
fs::path file_of(const Entry& entry, const std::map<int, TimeSet>& sets, float time) {
  std::vector<std::string> words = words_of(entry.value);
  const int set = take_set(words);
  const bool has_description = entry.section == "VARIABLE";
  if (words.size() < (has_description ? 2u : 1u)) return {};
  std::string name = words[has_description ? 1 : 0];
  const std::size_t begin = name.find('*'), count = static_cast<std::size_t>(std::count(name.begin(), name.end(), '*'));
  if (count == 0) return name;
  const auto found = sets.find(set);
  const double number = found == sets.end() ? -1 : file_number(found->second, time);
  if (!(number >= 0 && number < 1e9) || name.substr(begin, count) != std::string(count, '*')) return {};
  return name.replace(begin, count, fmt::format("{:0{}d}", static_cast<int>(number), count));
}

/// The components of a kind of variables; 0 if the kind has other contents than numbers of parts.
int components_of(const std::string& kind) {
  for (const auto& [what, count] : {std::pair("scalar", 1), {"vector", 3}, {"tensor symm", 6}, {"tensor asym", 9}})
    for (const char* where : {" per node", " per element"})
      if (kind == std::string(what) + where) return count;
  return 0;
}

/// How many numbers follow the last line of words in a text; none if these words say that not all have one, or end a
/// step of several in the file.
std::optional<std::uint64_t> numbers_at_end(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line, words;
  std::uint64_t count = 0;
  std::getline(file, line);  // A description.
  while (std::getline(file, line)) {
    line = trimmed(line);
    if (begins_with_number(line)) {
      ++count;
    } else if (!line.empty()) {
      words = line;
      count = 0;
    }
  }
  for (const char* exception : {"undef", "partial", "END TIME STEP"})
    if (words.find(exception) != std::string::npos) return {};
  return count;
}

/// The numbers of points, of cells, and of cells of each type, of each part.
std::set<std::uint64_t> sizes_in(vtkDataObject& read) {
  std::set<std::uint64_t> sizes;
  auto* const blocks = vtkMultiBlockDataSet::SafeDownCast(&read);
  for (unsigned int i = 0; blocks && i < blocks->GetNumberOfBlocks(); ++i) {
    auto* const part = vtkDataSet::SafeDownCast(blocks->GetBlock(i));
    if (!part) continue;
    std::map<int, std::uint64_t> of_type;  // Blocks of other kinds have cells of one type.
    if (part->IsA("vtkUnstructuredGrid"))
      for (vtkIdType id = 0; id < part->GetNumberOfCells(); ++id) ++of_type[part->GetCellType(id)];
    for (const auto& [type, count] : of_type) sizes.insert(count);
    sizes.insert(static_cast<std::uint64_t>(part->GetNumberOfPoints()));
    sizes.insert(static_cast<std::uint64_t>(part->GetNumberOfCells()));
  }
  return sizes;
}

bool begins_with(const fs::path& path, const std::string& text) {
  std::string head(240, '\0');
  std::ifstream(path, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
  return head.find(text) != std::string::npos;
}

/// The names of files that a word may mean: asterisks stand for a number.
std::vector<std::string> names_like(const fs::path& folder, const std::string& word) {
  const std::size_t first = word.find('*'), last = word.rfind('*');
  if (first == std::string::npos) return {word};
  const fs::path parent = fs::path(word).parent_path();
  std::vector<std::string> names;
  std::error_code none;
  for (fs::directory_iterator file(fs::absolute(folder / word).parent_path(), none), end; file != end; ++file) {
    const std::string name = (parent / file->path().filename()).string();
    if (starts_with(name, word.substr(0, first)) && ends_with(name, word.substr(last + 1))) names.push_back(name);
  }
  return names;
}

/// VTK also opens files of kinds that are not imported: of measured points, and of complex numbers.
void require_no_devices(const Entry& entry, const fs::path& folder) {
  for (const std::string& word : words_of(entry.value))
    for (const std::string& name : names_like(folder, word)) require_no_device(folder / name);
}

/// A word without quotes, blanks and folders.
std::string plain_word(std::string word) {
  const auto is_other = [](char c) { return c == '"' || c == ' ' || c == '\t' || c == '/' || c == '\\'; };
  std::replace_if(word.begin(), word.end(), is_other, '_');
  return word;
}

/// The case for VTK, which does not read names in quotes: a copy with plain ones, and with links to the files, in
/// `folder`.
fs::path plain_case(const fs::path& path, const fs::path& folder) {
  std::ifstream given(path, std::ios::binary);
  if (std::find(std::istreambuf_iterator<char>(given), {}, '"') == std::istreambuf_iterator<char>())
    return fs::absolute(path);
  given.clear();
  given.seekg(0);
  std::ofstream copy(folder / "plain.case", std::ios::binary);
  const fs::path parent = fs::absolute(path).parent_path();
  bool has_names = false;
  for (std::string line; std::getline(given, line);) {
    const std::string text = trimmed(line.substr(0, line.find('#')));
    const std::size_t colon = text.find(':');
    if (colon == std::string::npos) has_names = text == "GEOMETRY" || text == "VARIABLE" || (has_names && text.empty());
    if (!has_names || colon == std::string::npos) {
      copy << line << "\n";
      continue;
    }
    copy << text.substr(0, colon + 1);
    for (const std::string& word : words_of(text.substr(colon + 1))) {
      copy << " " << plain_word(word);
      std::error_code none;
      for (const std::string& name : names_like(parent, word))
        if (fs::is_regular_file(parent / name, none))
          fs::create_symlink(parent / name, folder / plain_word(name), none);
    }
    copy << "\n";
  }
  return folder / "plain.case";
}

/// The readers of text take time, and memory, for as many points and cells as a part announces. @throw
/// std::runtime_error naming the file, if a line after the name of a type announces more than there are bytes.
void check_counts(const fs::path& path) {
  static const std::set<std::string> types{"coordinates", "point",   "bar2",   "bar3",    "tria3",    "tria6",
                                           "quad4",       "quad8",   "tetra4", "tetra10", "pyramid5", "pyramid13",
                                           "penta6",      "penta15", "hexa8",  "hexa20",  "nsided",   "nfaced"};
  const auto most = static_cast<double>(fs::file_size(path));
  std::string before;
  int left_out = 2;  // Lines of a description, or of a part's number and description.
  for_each_short_line(path, 80, [&](const std::string& line) {
    if (left_out-- > 0) return true;
    const std::string text = trimmed(line);
    if (types.count(before) > 0 && std::strtod(text.c_str(), nullptr) > most)
      fail(path, "is damaged or cut off: it announces \"" + before + " " + escaped(text) +
                     "\", which it cannot hold; copy or write it again");
    left_out = text == "part" ? 2 : 0;
    before = starts_with(text, "g_") ? text.substr(2) : text;
    return true;
  });
}

/// In a case with file sets VTK seeks the steps in all files, and goes on for ever in one without.
void check_file_sets(const std::vector<Entry>& entries, const EnSightCase& given) {
  const auto is_set = [](const Entry& entry) { return entry.section == "FILE" && entry.name == "file set"; };
  if (std::none_of(entries.begin(), entries.end(), is_set)) return;
  for (const auto& [kind, file] : given.files)
    if (!begins_with(file, "BEGIN TIME STEP"))
      fail(file,
           "has no steps of time, and other files of its case have several (FILE), which is not read; write a "
           "file for each step");
}

/// Checks that texts of EnSight Gold have as many numbers in their last part as a part of `read` has points or cells.
/// @throw std::runtime_error naming the file.
void check_ends(const EnSightCase& given, vtkDataObject& read) {
  const auto is_binary_model = [](const EnSightFile& file) {
    return file.kind == "model" && begins_with(file.file, "inary");
  };
  if (!given.is_gold || std::any_of(given.files.begin(), given.files.end(), is_binary_model)) return;
  const std::set<std::uint64_t> sizes = sizes_in(read);
  for (const auto& [kind, file] : given.files) {
    const auto components = static_cast<std::uint64_t>(components_of(kind));
    const std::optional<std::uint64_t> count = components > 0 ? numbers_at_end(file) : std::nullopt;
    if (count && (*count % components != 0 || sizes.count(*count / components) == 0))
      fail(file,
           fmt::format("is cut off, or of another mesh: its last part has {} numbers; copy or write it again", *count));
  }
}

vtkSmartPointer<vtkDataObject> read_step(const fs::path& path, std::size_t step) {
  const EnSightCase given = ensight_case(path, step);
  const TemporaryFolder folder;
  vtkNew<vtkGenericEnSightReader> reader;
  reader->SetCaseFileName(plain_case(path, folder / "").c_str());
  reader->UpdateInformation();
  reader->ReadAllVariablesOn();
  if (!given.times.empty()) reader->SetTimeValue(given.times[step]);
  reader->Update();
  const vtkSmartPointer<vtkDataObject> result = reader->GetOutputDataObject(0);
  if (result) check_ends(given, *result);
  for (vtkDataSet* const part : data_sets_in(result)) name_symmetric_components(*part);
  return result;
}

}  // namespace

EnSightCase ensight_case(const fs::path& path, std::size_t step) {
  const std::vector<Entry> entries = entries_of(path);
  constexpr double max_steps = 1e6;
  for (const Entry& entry : entries)
    if (entry.name == "number of steps" && !(std::strtod(entry.value.c_str(), nullptr) <= max_steps))
      fail(path, "has more than a million steps of time; it may be damaged: copy or write it again");
  const std::map<int, TimeSet> sets = time_sets(entries);
  EnSightCase result;
  std::set<float> times;
  for (const auto& [number, set] : sets) times.insert(set.times.begin(), set.times.end());
  result.times.assign(times.begin(), times.end());
  const float time = step < result.times.size() ? result.times[step] : -std::numeric_limits<float>::infinity();
  for (const Entry& entry : entries) {
    if (entry.section == "FORMAT" && entry.name == "type")
      result.is_gold = lower_case(entry.value).find("gold") != std::string::npos;
    if (entry.section == "GEOMETRY" || entry.section == "VARIABLE") require_no_devices(entry, path.parent_path());
    const bool is_model = entry.section == "GEOMETRY" && entry.name == "model";
    if (!is_model && (entry.section != "VARIABLE" || components_of(entry.name) == 0)) continue;
    const fs::path name = file_of(entry, sets, time), file = path.parent_path() / name;
    if (name.empty()) continue;
    if (!fs::is_regular_file(file))
      fail(file, "is missing, which " + path.filename().string() + " names; copy it there too");
    if (is_model) check_counts(file);
    result.files.push_back({entry.name, file});
  }
  check_file_sets(entries, result);
  return result;
}

MeshFile open_ensight(const fs::path& path) {
  return {static_cast<int>(ensight_case(path, 0).times.size()),
          [path](int step) { return read_step(path, static_cast<std::size_t>(step)); }};
}

}  // namespace tensorray
