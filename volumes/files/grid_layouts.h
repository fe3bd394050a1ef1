#pragma once
/// Which grids of an OpenVDB file are a field, by their names and types. Does not include OpenVDB.

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace tensorray {

/// The tensor entry that a component of a grid's value is stored in. Of a vector, `row` is the component.
struct TensorEntry {
  int component, row, column;
};

/// How a tensor is computed from a grid that does not store tensors.
enum class Derive {
  none,      ///< The grids are the tensor's components.
  gradient,  ///< A Vec3 grid v, or three scalar grids: T(i, j) = ∂v_i/∂x_j, finite differences, world axes.
  hessian,   ///< A scalar grid f: T(i, j) = ∂²f/∂x_i∂x_j, finite differences, world axes.
  /// The stress of a fluid of viscosity 1, G + Gᵀ − ⅔ tr G I: of a vector's gradient G, or of the tensor field G.
  viscous_stress,
  negative_viscous_stress,  ///< What bends light of −p I + (viscous stress) with Eq. 7: p I bends none.
};

inline bool is_stress(Derive derive) {
  return derive == Derive::viscous_stress || derive == Derive::negative_viscous_stress;
}

/// What a VDB file contains, apart from voxel values.
struct GridInfo {
  std::string name;     ///< Unique in the file: the second of two grids "T" is "T[1]".
  std::string type;     ///< "vec3s", "float", ...
  std::string storage;  ///< "full", or "half" where the file stores 16-bit floats.
};

/// The names of scalar grids that a user gives as the components of a field. Either all nine of a tensor, or six of a
/// symmetric one (of yx and xy, zx and xz, zy and yz only one), or with Derive::gradient the three of a vector.
struct ComponentGrids {
  std::array<std::string, 9> tensor;  ///< Row by row; empty: not given.
  std::array<std::string, 3> vector;

  bool empty() const;
};

/// A grid of a field, and the entries that its values are stored in.
struct FieldPart {
  std::string grid;
  std::vector<TensorEntry> entries;
};

/// The grids of a field. `name` is what their names begin with.
struct FieldGrids {
  std::string name;
  std::vector<FieldPart> parts;
  std::vector<std::vector<FieldPart>> finer;  ///< Of each finer level.
  Derive derive = Derive::none;               ///< What makes tensors of their values: not a stress, but its gradient.
};

/// What the names of the grids of a level end in: "", "@1", "@2", "@3".
std::string level_suffix(std::size_t level);

/// The names of the tensor fields among the grids of a file.
std::vector<std::string> tensor_names(const std::vector<GridInfo>& grids);

/// The grids of the field called `name`; if it is empty, of the only one. With `components`, the grids that they name;
/// `name`, or the first grid's name, is then that of the field.
/// A tensor is three Vec3 grids NAME_row0, NAME_row1, NAME_row2 (the rows); or nine scalar grids, numbered row by row
/// (NAME_0, NAME.0, NAME[0] … 8); or nine, or the six of a symmetric tensor, named by their axes (NAMExx, NAME_xx,
/// NAME.xx, also in capitals, or by numbers from 1, or from 0: NAME11, NAME_11, ...). A vector is a Vec3 grid, or
/// three scalar grids NAME.x, NAME_x, NAMEx, NAME[0], NAME.0, NAME_0, ...
/// Of a stress, a tensor counts before a vector.
/// The grids of finer levels have the names of level 0, with "@1", "@2" or "@3" behind them.
/// @throw std::runtime_error, one line that names the file, lists its grids or fields, and names the fix.
FieldGrids field_grids(const std::filesystem::path& path, const std::vector<GridInfo>& grids, const std::string& name,
                       Derive derive, const ComponentGrids& components);

}  // namespace tensorray
