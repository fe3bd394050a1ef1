#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <regex>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkDataSetAttributes.h>
#include <vtkExodusIIReader.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkSmartPointer.h>
#include <vtk_exodusII.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/cases/case_files.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

/// What netCDF has where nothing was written; of float, it is the same number.
bool is_fill(double value) { return value == NC_FILL_DOUBLE; }

/// Numbers of a variable at each step: of all nodes, or of the elements of a block.
struct VariablePart {
  ex_entity_type kind;
  int variable;  ///< From 1 on.
  ex_entity_id block;
  std::size_t count;
  std::string name;
};

using Kind = vtkExodusIIReader::ObjectType;

/// A file, which may be one of several pieces.
struct Piece {
  Path path;
  std::shared_ptr<const int> file;  ///< Of the library of ExodusII, and of netCDF's.
  vtkSmartPointer<vtkExodusIIReader> reader = vtkSmartPointer<vtkExodusIIReader>::New();
  std::vector<std::pair<Kind, std::vector<std::string>>> variables;  ///< That it announces, in its order.
  std::vector<VariablePart> parts;                                   ///< That are in the file.
  std::set<std::string> missing;
};

std::vector<std::string> variables_of(int file, ex_entity_type kind) {
  constexpr int longest = 256;
  ex_set_max_name_length(file, longest);
  int count = 0;
  if (ex_get_variable_param(file, kind, &count) < 0) return {};
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) {
    std::array<char, longest + 1> name{};
    ex_get_variable_name(file, kind, i + 1, name.data());
    names.emplace_back(name.data());
  }
  return names;
}

/// Calls `visit(kind, name, variables)` for each array of the reader, which joins variables that follow each other:
/// stress_xx, stress_xy, stress_xz become a vector stress_x.
template <class Visit>
void for_each_exodus_array(const Piece& piece, const Visit& visit) {
  for (const auto& [kind, names] : piece.variables) {
    auto next = names.begin();
    for (int i = 0; i < piece.reader->GetNumberOfObjectArrays(kind); ++i) {
      const auto end =
          next + std::min<std::ptrdiff_t>(names.end() - next, piece.reader->GetNumberOfObjectArrayComponents(kind, i));
      visit(kind, piece.reader->GetObjectArrayName(kind, i), std::vector<std::string>(next, end));
      next = end;
    }
  }
}

/// @param step  From 0 on. @return whether so many numbers are there.
bool read_numbers(int file, const VariablePart& part, int step, std::vector<double>& values) {
  return ex_get_var(file, step + 1, part.kind, part.variable, part.block, static_cast<std::int64_t>(values.size()),
                    values.data()) >= 0;
}

/// Whether the file has a variable, and as many numbers as there are nodes or elements.
bool is_there(int file, const VariablePart& part) {
  std::vector<double> values(part.count), more(part.count + 1);
  return read_numbers(file, part, 0, values) && !read_numbers(file, part, 0, more);
}

std::vector<VariablePart> announced_parts(const Piece& piece, const ex_init_params& sizes) {
  const int file = *piece.file;
  std::vector<VariablePart> all;
  for (const std::string& name : piece.variables[0].second)
    all.push_back({EX_NODAL, static_cast<int>(all.size()) + 1, 1, static_cast<std::size_t>(sizes.num_nodes), name});
  const std::vector<std::string>& names = piece.variables[1].second;
  const auto blocks = static_cast<std::size_t>(sizes.num_elem_blk);
  std::vector<int> ids(blocks), table(blocks * names.size());
  ex_get_ids(file, EX_ELEM_BLOCK, ids.data());
  if (!table.empty())
    ex_get_truth_table(file, EX_ELEM_BLOCK, static_cast<int>(blocks), static_cast<int>(names.size()), table.data());
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::size_t block = i / names.size(), variable = i % names.size();
    ex_block facts{};
    facts.type = EX_ELEM_BLOCK;
    facts.id = ids[block];
    if (table[i] == 0 || ex_get_block_param(file, &facts) < 0 || facts.num_entry == 0) continue;
    all.push_back({EX_ELEM_BLOCK, static_cast<int>(variable) + 1, facts.id, static_cast<std::size_t>(facts.num_entry),
                   names[variable]});
  }
  return all;
}

std::size_t holes_in(int file, const VariablePart& part, int step) {
  std::vector<double> values(part.count, NC_FILL_DOUBLE);
  read_numbers(file, part, step, values);
  return static_cast<std::size_t>(std::count_if(values.begin(), values.end(), is_fill));
}

/// What was announced for a step after the first, and not written; empty if there is nothing.
std::string unwritten(const Piece& piece, int step) {
  const int file = *piece.file;
  double time = 0, before = 0;
  if (ex_get_time(file, step, &before) >= 0 && ex_get_time(file, step + 1, &time) >= 0 &&
      (is_fill(time) || !std::isfinite(time) || (time == 0 && before > 0)))
    return "its time";
  for (const VariablePart& part : piece.parts) {
    const std::size_t holes = holes_in(file, part, step);
    if (holes > 0 && holes > holes_in(file, part, 0) && holes > holes_in(file, part, step - 1))
      return "\"" + part.name + "\"";
  }
  return {};
}

/// Requests all variables that are there, in all blocks.
void enable(const Piece& piece) {
  for_each_exodus_array(piece, [&](Kind kind, const char* array, const std::vector<std::string>& variables) {
    const bool is_whole = std::none_of(variables.begin(), variables.end(),
                                       [&](const std::string& one) { return piece.missing.count(one) > 0; });
    piece.reader->SetObjectArrayStatus(kind, array, is_whole ? 1 : 0);
  });
  for (int i = 0; i < piece.reader->GetNumberOfObjects(Kind::ELEM_BLOCK); ++i)
    piece.reader->SetObjectStatus(Kind::ELEM_BLOCK, i, 1);
}

Piece open_piece(const Path& path) {
  require_whole_netcdf(path);
  int word = sizeof(double), stored = 0;
  float version = 0;
  ex_init_params sizes{};
  Piece piece;
  piece.path = path;
  piece.file = {new int(ex_open(path.c_str(), EX_READ, &word, &stored, &version)), [](const int* id) {
                  if (*id >= 0) ex_close(*id);
                  delete id;
                }};
  const int file = *piece.file;
  if (file < 0 || ex_get_init_ext(file, &sizes) < 0)
    fail(path, "is damaged, or no ExodusII file but netCDF or HDF5 of another kind");
  piece.variables = {{Kind::NODAL, variables_of(file, EX_NODAL)},
                     {Kind::ELEM_BLOCK, variables_of(file, EX_ELEM_BLOCK)}};
  const bool has_steps = ex_inquire_int(file, EX_INQ_TIME) > 0;
  for (const VariablePart& part : announced_parts(piece, sizes)) {
    if (!has_steps || is_there(file, part))
      piece.parts.push_back(part);
    else
      piece.missing.insert(part.name);
  }
  piece.reader->SetFileName(path.c_str());
  piece.reader->ApplyDisplacementsOff();
  piece.reader->UpdateInformation();
  enable(piece);
  return piece;
}

/// Names the components of joined variables as these are called in the file.
void name_components(const Piece& piece, vtkDataSet& data) {
  for_each_exodus_array(piece, [&](Kind kind, const char* name, const std::vector<std::string>& variables) {
    const auto type = kind == Kind::NODAL ? vtkDataObject::POINT : vtkDataObject::CELL;
    vtkDataArray* const array = data.GetAttributes(type)->GetArray(name);
    const auto count = static_cast<vtkIdType>(variables.size());
    if (!array || count < 2 || array->GetNumberOfComponents() != count) return;
    for (vtkIdType k = 0; k < count; ++k) array->SetComponentName(k, variables[static_cast<std::size_t>(k)].c_str());
  });
}

void hide_fill_values(vtkDataSet& block) {
  for (const auto type : {vtkDataObject::POINT, vtkDataObject::CELL})
    for (int i = 0; i < block.GetAttributes(type)->GetNumberOfArrays(); ++i) {
      vtkDataArray* const array = block.GetAttributes(type)->GetArray(i);
      for (vtkIdType tuple = 0; array && tuple < array->GetNumberOfTuples(); ++tuple)
        for (int k = 0; k < array->GetNumberOfComponents(); ++k)
          if (is_fill(array->GetComponent(tuple, k)))
            array->SetComponent(tuple, k, std::numeric_limits<double>::quiet_NaN());
    }
}

/// @param steps  Of the file, or of the piece that has most.
vtkSmartPointer<vtkDataObject> read_piece(const Piece& piece, int step, int steps) {
  const int own_steps = piece.reader->GetNumberOfTimeSteps();
  const std::string lack = step == 0 ? "" : step >= own_steps ? "this piece" : unwritten(piece, step);
  if (!lack.empty())
    fail(piece.path, fmt::format("step {} of {} is not complete: {} was not written; --steps chooses another one",
                                 step + 1, steps, lack));
  if (own_steps > 0) piece.reader->SetTimeStep(step);
  piece.reader->Update();
  for (vtkDataSet* const block : data_sets_in(piece.reader->GetOutputDataObject(0))) {
    name_components(piece, *block);
    hide_fill_values(*block);
  }
  return piece.reader->GetOutputDataObject(0);
}

void require_pieces(const Path& given, const std::vector<Path>& paths) {
  std::string missing;
  for (const Path& path : paths)
    if (!std::filesystem::is_regular_file(path)) missing += " " + escaped(path.filename().string());
  if (!missing.empty())
    fail(given, fmt::format("is one of {} pieces of a mesh, of which are missing:{}; copy them there too", paths.size(),
                            missing));
}

}  // namespace

std::vector<Path> nemesis_pieces(const Path& path) {
  static const std::regex form(R"((.+\.(\d{1,6})\.)(\d{1,6}))");
  const std::string name = path.filename().string();
  std::smatch parts;
  if (!std::regex_match(name, parts, form)) return {path};
  const int count = std::stoi(parts[2]), number = std::stoi(parts[3]);
  if (count < 2 || number >= count) return {path};
  std::vector<Path> pieces;
  for (int i = 0; i < count; ++i)
    pieces.push_back(path.parent_path() / fmt::format("{}{:0{}}", parts[1].str(), i, parts[3].length()));
  return pieces;
}

MeshFile open_exodus(const Path& path) {
  const std::vector<Path> paths = nemesis_pieces(path);
  require_pieces(path, paths);
  const auto pieces = std::make_shared<std::vector<Piece>>();
  MeshFile result{0, nullptr, {}};
  std::set<std::string> missing;
  for (const Path& one : paths) {
    const Piece& piece = pieces->emplace_back(open_piece(one));
    result.steps = std::max(result.steps, piece.reader->GetNumberOfTimeSteps());
    missing.insert(piece.missing.begin(), piece.missing.end());
  }
  if (!missing.empty())
    result.notes.push_back(fmt::format(
        "left out: \"{}\", which the file announces, and does not hold as ExodusII does; write it again, or "
        "convert what meshio wrote: meshio convert {} FILE.vtu",
        fmt::join(missing, "\", \""), path.filename().string()));
  if (paths.size() > 1)
    result.notes.push_back(fmt::format("one of {} pieces of a mesh (Nemesis): all are read", paths.size()));
  result.read = [pieces, steps = result.steps](int step) -> vtkSmartPointer<vtkDataObject> {
    if (pieces->size() == 1) return read_piece(pieces->front(), step, steps);
    auto blocks = vtkSmartPointer<vtkMultiBlockDataSet>::New();
    for (const Piece& piece : *pieces) blocks->SetBlock(blocks->GetNumberOfBlocks(), read_piece(piece, step, steps));
    return blocks;
  };
  return result;
}

}  // namespace tensorray
