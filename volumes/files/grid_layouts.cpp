#include "volumes/files/grid_layouts.h"

#include <algorithm>

#include "base/errors.h"
#include "base/text/text.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {
namespace {

bool is_surface(const GridInfo& grid) {
  return ends_with(grid.name, "_surface_points") || ends_with(grid.name, "_surface_triangles");
}

bool is_vector(const GridInfo& grid) { return (grid.type == "vec3s" || grid.type == "vec3d") && !is_surface(grid); }
bool is_scalar(const GridInfo& grid) { return grid.type == "float" || grid.type == "double"; }

/// A grid of a layout: the ending of its name, and the entries that it holds.
struct Part {
  std::string suffix;
  std::vector<TensorEntry> entries;
};

/// One way to store a tensor, or a vector, in grids. `NAME` + the suffixes are the names of the grids.
struct Layout {
  bool (*suits)(const GridInfo&);
  std::vector<Part> parts;
  std::string
      not_before;  ///< Characters that NAME does not end in, as they would be a part of another layout's suffix.
};

using AxisNames = std::array<const char*, 3>;
constexpr std::array<AxisNames, 4> axis_names{{{"x", "y", "z"}, {"X", "Y", "Z"}, {"1", "2", "3"}, {"0", "1", "2"}}};
constexpr std::array separators{".", "_", ""};
const std::string separator_characters = "._-: ";

std::string not_before(const std::string& separator) { return separator.empty() ? separator_characters : ""; }

Layout rows_layout() {
  Layout layout{is_vector, {}, {}};
  for (int row = 0; row < 3; ++row)
    layout.parts.push_back({"_row" + std::to_string(row), {{0, row, 0}, {1, row, 1}, {2, row, 2}}});
  return layout;
}

/// Grids with the numbers from 0 to `count` − 1, each between `before` and `after`.
Layout numbered_layout(int count, const std::string& before, const std::string& after) {
  Layout layout{is_scalar, {}, {}};
  for (int i = 0; i < count; ++i) {
    const TensorEntry entry = count == 9 ? TensorEntry{0, i / 3, i % 3} : TensorEntry{0, i, 0};
    layout.parts.push_back({before + std::to_string(i) + after, {entry}});
  }
  return layout;
}

enum class Entries { all, upper, lower };

Layout tensor_layout(Entries which, const std::string& separator, const AxisNames& names) {
  Layout layout{is_scalar, {}, not_before(separator)};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) {
      if (which == Entries::upper ? row > column : which == Entries::lower && row < column) continue;
      layout.parts.push_back({separator + names[row] + names[column], {{0, row, column}}});
      if (which != Entries::all && column != row) layout.parts.back().entries.push_back({0, column, row});
    }
  return layout;
}

Layout vector_layout(const std::string& separator, const AxisNames& names) {
  Layout layout{is_scalar, {}, separator.empty() ? separator_characters + "xyzXYZ" : ""};  // T_xx is no vector of T_x.
  for (int i = 0; i < 3; ++i) layout.parts.push_back({separator + names[i], {{0, i, 0}}});
  return layout;
}

/// Sorted by preference, for names that fit several layouts.
const std::vector<Layout>& tensor_layouts() {
  static const std::vector<Layout> layouts = [] {
    std::vector<Layout> all{rows_layout(), numbered_layout(9, "_", ""), numbered_layout(9, ".", ""),
                            numbered_layout(9, "[", "]")};
    for (const Entries which : {Entries::all, Entries::upper, Entries::lower})
      for (const char* separator : separators)
        for (const AxisNames& names : axis_names) all.push_back(tensor_layout(which, separator, names));
    return all;
  }();
  return layouts;
}

const std::vector<Layout>& vector_layouts() {
  static const std::vector<Layout> layouts = [] {
    std::vector<Layout> all{{is_vector, {{"", {{0, 0, 0}, {1, 1, 0}, {2, 2, 0}}}}, {}}};
    for (const char* separator : separators)
      for (const AxisNames& names : {axis_names[0], axis_names[1]}) all.push_back(vector_layout(separator, names));
    for (const auto& [before, after] : {std::pair("[", "]"), {".", ""}, {"_", ""}})
      all.push_back(numbered_layout(3, before, after));
    return all;
  }();
  return layouts;
}

const std::vector<Layout>& scalar_layouts() {
  static const std::vector<Layout> layouts{{is_scalar, {{"", {{0, 0, 0}}}}, {}}};
  return layouts;
}

const std::vector<Layout>& layouts_for(Derive derive) {
  return derive == Derive::none ? tensor_layouts() : derive == Derive::gradient ? vector_layouts() : scalar_layouts();
}

const GridInfo* find(const std::vector<GridInfo>& grids, const std::string& name) {
  const auto found = std::find_if(grids.begin(), grids.end(), [&](const GridInfo& grid) { return grid.name == name; });
  return found == grids.end() ? nullptr : &*found;
}

bool has(const std::vector<GridInfo>& grids, const std::string& name, const Layout& layout) {
  if (name.empty() || layout.not_before.find(name.back()) != std::string::npos) return false;
  return std::all_of(layout.parts.begin(), layout.parts.end(), [&](const Part& part) {
    const GridInfo* const grid = find(grids, name + part.suffix);
    return grid && layout.suits(*grid);
  });
}

std::vector<std::string> names_in(const std::vector<GridInfo>& grids, const std::vector<Layout>& layouts) {
  std::vector<std::string> names;
  for (const GridInfo& grid : grids)
    for (const Layout& layout : layouts) {
      const std::string& first = layout.parts.front().suffix;
      if (!ends_with(grid.name, first)) continue;
      const std::string name = grid.name.substr(0, grid.name.size() - first.size());
      if (!has(grids, name, layout)) continue;
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  return names;
}

std::string joined_or_none(const std::vector<std::string>& words) { return words.empty() ? "none" : joined(words); }

std::string described(const std::vector<GridInfo>& grids) {
  std::vector<std::string> words;
  for (const GridInfo& grid : grids) words.push_back(grid.name + " (" + grid.type + ")");
  return joined_or_none(words);
}

/// How a tensor can be made of the grids of a file that has none.
std::string derivable(const std::vector<GridInfo>& grids) {
  const std::vector<std::string> vectors = names_in(grids, layouts_for(Derive::gradient));
  if (!vectors.empty()) return "; `--set field.derive=gradient` makes one of " + joined(vectors);
  const std::vector<std::string> scalars = names_in(grids, layouts_for(Derive::hessian));
  return scalars.empty() ? "" : "; `--set field.derive=hessian` makes one of " + joined(scalars);
}

std::string chosen_name(const std::filesystem::path& path, const std::vector<GridInfo>& grids, const std::string& name,
                        Derive derive) {
  const std::string kind = derive == Derive::none       ? "tensor field"
                           : derive == Derive::gradient ? "vector grid for a gradient"
                                                        : "scalar grid for a hessian";
  const std::vector<std::string> names = names_in(grids, layouts_for(derive));
  const bool has_scalars = std::count_if(grids.begin(), grids.end(), is_scalar) >= (derive == Derive::none ? 6 : 3);
  const std::string fix = derive != Derive::hessian && has_scalars
                              ? "; a scene's key `/field/components` says which scalar grids are the components"
                              : "";
  if (!name.empty()) {
    if (std::find(names.begin(), names.end(), name) != names.end()) return name;
    fail(path, "has no " + kind + " \"" + name + "\"; there are: " + joined_or_none(names) +
                   "; the grids are: " + described(grids) + fix);
  }
  if (names.size() == 1) return names.front();
  if (names.empty())
    fail(path, "has no " + kind + "; the grids are: " + described(grids) + fix +
                   (derive == Derive::none ? derivable(grids) : ""));
  fail(path, "has several of what could be the " + kind + "; `field.name` must be one of: " + joined(names));
}

const char* const entry_names[] = {"xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"};

[[noreturn]] void fail_components(const std::filesystem::path& path, const std::string& what) {
  fail(path, "`/field/components`: " + what);
}

void require_scalar(const std::filesystem::path& path, const std::vector<GridInfo>& grids, const std::string& name) {
  const GridInfo* const grid = find(grids, name);
  if (!grid) fail_components(path, "there is no grid \"" + name + "\"; the grids are: " + described(grids));
  if (!is_scalar(*grid)) fail_components(path, "grid \"" + name + "\" is not scalar, but " + grid->type);
}

/// Adds entries of a grid, which may be several components (the zero of a plane's xz and yz).
void add_part(std::vector<FieldPart>& parts, const std::string& grid, const TensorEntry& entry) {
  const auto same = std::find_if(parts.begin(), parts.end(), [&](const FieldPart& part) { return part.grid == grid; });
  if (same == parts.end())
    parts.push_back({grid, {entry}});
  else
    same->entries.push_back(entry);
}

/// A symmetric tensor's entry below the diagonal may be given instead of the one above it.
std::vector<FieldPart> tensor_parts(const std::filesystem::path& path, const std::array<std::string, 9>& names) {
  std::vector<FieldPart> parts;
  const auto given = std::count_if(names.begin(), names.end(), [](const std::string& name) { return !name.empty(); });
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) {
      const std::string& here = names[3 * row + column];
      const std::string& there = names[3 * column + row];
      if (!here.empty()) add_part(parts, here, {0, row, column});
      if (!here.empty() && there.empty()) add_part(parts, here, {0, column, row});
      if (here.empty() && there.empty())
        fail_components(path, std::string("`") + entry_names[3 * row + column] +
                                  "` is missing: give the nine of a "
                                  "tensor, or six of a symmetric one");
    }
  if (given != 6 && given != 9)
    fail_components(path, "has " + std::to_string(given) + " components: give nine, or six of a symmetric tensor");
  return parts;
}

std::vector<FieldPart> vector_parts(const std::filesystem::path& path, const std::array<std::string, 3>& names) {
  std::vector<FieldPart> parts;
  for (int i = 0; i < 3; ++i) {
    if (names[i].empty()) fail_components(path, "a gradient needs `x`, `y` and `z` of a vector");
    add_part(parts, names[i], {0, i, 0});
  }
  return parts;
}

FieldGrids given_grids(const std::filesystem::path& path, const std::vector<GridInfo>& grids, const std::string& name,
                       Derive derive, const ComponentGrids& given) {
  if (derive == Derive::hessian) fail_components(path, "a hessian is of one grid: give its `name` instead");
  const bool of_vector = derive == Derive::gradient;
  if (of_vector ? !ComponentGrids{given.tensor, {}}.empty() : !ComponentGrids{{}, given.vector}.empty())
    fail_components(path, of_vector ? "with `derive` \"gradient\", give `x`, `y` and `z`"
                                    : "`x`, `y` and `z` are of a vector: add `derive` \"gradient\"");
  FieldGrids field;
  field.name = name;
  field.parts = of_vector ? vector_parts(path, given.vector) : tensor_parts(path, given.tensor);
  for (const FieldPart& part : field.parts) require_scalar(path, grids, part.grid);
  if (field.name.empty()) field.name = field.parts.front().grid;
  return field;
}

/// How the gradient of a velocity is made of grids: not at all, if they are its components.
Derive gradient_in(const std::vector<GridInfo>& grids, const std::string& name, const ComponentGrids& given) {
  if (!given.empty()) return ComponentGrids{{}, given.vector}.empty() ? Derive::none : Derive::gradient;
  const std::vector<std::string> names = names_in(grids, tensor_layouts());
  const bool has_tensor = name.empty() ? !names.empty() : std::find(names.begin(), names.end(), name) != names.end();
  return has_tensor ? Derive::none : Derive::gradient;
}

/// The level that a grid's name has at its end; 0: none.
std::size_t level_in(const std::string& name) {
  const std::size_t at = name.rfind('@');
  if (at == std::string::npos || at + 2 != name.size() || name.back() < '1' || name.back() > '9') return 0;
  return static_cast<std::size_t>(name.back() - '0');
}

/// The grids without those of finer levels.
std::vector<GridInfo> coarsest(const std::vector<GridInfo>& grids) {
  std::vector<GridInfo> result;
  for (const GridInfo& grid : grids)
    if (level_in(grid.name) == 0 || !find(grids, grid.name.substr(0, grid.name.size() - 2))) result.push_back(grid);
  return result;
}

/// Adds the grids of finer levels.
void add_finer(const std::filesystem::path& path, const std::vector<GridInfo>& grids, FieldGrids& field) {
  for (std::size_t level = 1; level <= 9; ++level) {
    std::vector<FieldPart> parts;
    std::string missing;
    for (const FieldPart& part : field.parts) {
      const std::string name = part.grid + level_suffix(level);
      const GridInfo *const here = find(grids, name), *const before = find(grids, part.grid);
      if (!here)
        missing = name;
      else if (here->type != before->type)
        fail(path, "grid " + name + " is " + here->type + ", and " + part.grid + " is " + before->type);
      else
        parts.push_back({name, part.entries});
    }
    if (parts.empty()) continue;
    if (!missing.empty()) fail(path, "level " + std::to_string(level) + " of the field lacks grid " + missing);
    if (level >= max_levels)
      fail(path, "grid " + parts[0].grid + " is of a fifth level or more; a field has 4 at most");
    if (level != field.finer.size() + 1)
      fail(path, "has grid " + parts[0].grid + ", but no level " + std::to_string(level - 1) + " of the field");
    field.finer.push_back(std::move(parts));
  }
}

}  // namespace

std::string level_suffix(std::size_t level) { return level == 0 ? "" : "@" + std::to_string(level); }

bool ComponentGrids::empty() const {
  const auto none = [](const std::string& name) { return name.empty(); };
  return std::all_of(tensor.begin(), tensor.end(), none) && std::all_of(vector.begin(), vector.end(), none);
}

std::vector<std::string> tensor_names(const std::vector<GridInfo>& grids) {
  return names_in(coarsest(grids), tensor_layouts());
}

FieldGrids field_grids(const std::filesystem::path& path, const std::vector<GridInfo>& all, const std::string& name,
                       Derive wanted, const ComponentGrids& components) {
  const std::vector<GridInfo> grids = coarsest(all);
  const Derive derive = is_stress(wanted) ? gradient_in(grids, name, components) : wanted;
  FieldGrids field;
  if (!components.empty()) {
    field = given_grids(path, grids, name, derive, components);
    field.derive = derive;
    add_finer(path, all, field);
    return field;
  }
  field.derive = derive;
  field.name = chosen_name(path, grids, name, derive);
  const std::vector<Layout>& layouts = layouts_for(derive);
  const Layout& layout =
      *std::find_if(layouts.begin(), layouts.end(), [&](const Layout& l) { return has(grids, field.name, l); });
  for (const Part& part : layout.parts) field.parts.push_back({field.name + part.suffix, part.entries});
  add_finer(path, all, field);
  return field;
}

}  // namespace tensorray
