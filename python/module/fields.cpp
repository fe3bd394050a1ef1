#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "base/errors.h"
#include "base/files/output_file.h"
#include "base/process/archive.h"
#include "integrators/methods/read_scene.h"
#include "python/module/arrays.h"
#include "python/module/scene_request.h"
#include "python/module/work.h"
#include "scenes/scene/turning.h"
#include "volumes/files/tensor_files.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {

std::string Field::source() const { return keys_.contains("file") ? keys_["file"] : keys_["generate"]["kind"]; }

LoadedField Field::loaded(const FieldChoices& choices, const Eigen::Matrix3d& turn) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!loaded_ || choices_ != choices || turn_ != turn) {
    loaded_.reset();  // Its memory is needed.
    const bool is_turned = turn != Eigen::Matrix3d::Identity() && !keys_.contains("generate");
    loaded_ = prepare_field(is_turned ? turned(blocks_, turn) : blocks_, choices, source());
    choices_ = choices;
    turn_ = turn;
  }
  return *loaded_;
}

namespace {

constexpr int block_floats = 9 * TensorBlock::voxels;

using Numbers = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

/// @param points, triangles  (n, 3); without rows: there is no surface.
TriangleMesh surface_of_arrays(const Doubles& points, const Numbers& triangles) {
  require(points.ndim() == 2 && points.shape(1) == 3 && triangles.ndim() == 2 && triangles.shape(1) == 3,
          "surface: give points and triangles, arrays of the shapes (n, 3) and (m, 3)");
  TriangleMesh surface;
  for (py::ssize_t i = 0; i < points.shape(0); ++i) {
    surface.vertices.emplace_back(points.data(i, 0));
    require(surface.vertices.back().allFinite(), "surface: points must be finite");
  }
  for (py::ssize_t i = 0; i < triangles.size(); ++i) {
    const std::int64_t corner = triangles.data()[i];
    require(corner >= 0 && corner < points.shape(0), "surface: triangles have numbers of points that are not there");
    if (i % 3 == 0) surface.triangles.emplace_back();
    surface.triangles.back()[static_cast<std::size_t>(i % 3)] = static_cast<std::uint32_t>(corner);
  }
  return surface;
}

/// The points and the triangles of the field's surface.
py::tuple surface_of(const Field& field) {
  const TriangleMesh& surface = field.surface();
  const auto points = static_cast<py::ssize_t>(surface.vertices.size()),
             triangles = static_cast<py::ssize_t>(surface.triangles.size());
  return py::make_tuple(taken_matrices(surface.vertices, {points, 3}),
                        taken<std::array<std::uint32_t, 3>, std::uint32_t>(surface.triangles, {triangles, 3}));
}

/// A field of an array (nz, ny, nx, 3, 3) of floats or doubles with any strides. The array is not copied: the field
/// keeps it, and reads it when its bricks are made.
template <class Number>
std::shared_ptr<Field> field_of_array(const py::array_t<Number, 0>& tensors, const Doubles& to_world,
                                      const std::string& text, const Doubles& points, const Numbers& triangles) {
  require(tensors.ndim() == 5 && tensors.shape(3) == 3 && tensors.shape(4) == 3,
          "the tensors must be an array of shape (nz, ny, nx, 3, 3)");
  require(tensors.size() > 0, "the array of tensors is empty");
  Eigen::Vector3i size;
  for (int axis = 0; axis < 3; ++axis) {
    require(tensors.shape(axis) < std::numeric_limits<int>::max() / 2, "the array of tensors is too large");
    size[2 - axis] = static_cast<int>(tensors.shape(axis));
  }
  Eigen::Affine3d transform(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(to_world.data()));
  require(transform.matrix().allFinite() && transform.matrix().row(3) == Eigen::RowVector4d(0, 0, 0, 1) &&
              std::abs(transform.linear().determinant()) > 0,
          "voxel_size, origin or to_world: not an affine transform that can be inverted");
  const auto* const data = reinterpret_cast<const char*>(tensors.data());
  const Eigen::Matrix<std::ptrdiff_t, 5, 1> strides =
      Eigen::Map<const Eigen::Matrix<py::ssize_t, 5, 1>>(tensors.strides()).template cast<std::ptrdiff_t>();
  const auto tensor = [data, strides](const Eigen::Vector3i& at) {
    const char* const voxel = data + at.z() * strides[0] + at.y() * strides[1] + at.x() * strides[2];
    Eigen::Matrix3d result;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        result(i, j) = *reinterpret_cast<const Number*>(voxel + i * strides[3] + j * strides[4]);
    return result;
  };
  BlockSource blocks = dense_source({Eigen::Vector3i::Zero(), size - Eigen::Vector3i::Ones()}, transform, tensor);
  Json keys = parse_value(text);
  blocks.name = keys.value("name", blocks.name);
  blocks.surface = surface_of_arrays(points, triangles);
  return std::make_shared<Field>(std::move(keys), std::move(blocks), tensors);
}

std::shared_ptr<Field> read_field(const std::filesystem::path& file, const std::string& keys, const std::string& name,
                                  const std::string& derive, const py::object& report) {
  TensorGrid grid;
  run(report, 0, [&](const Progress& progress) {
    progress.update("reading", 0, 1);
    grid = read_tensor_vdb(file, name, value_of<Derive>("derive", derive));
  });
  return std::make_shared<Field>(parse_value(keys), source_of(std::move(grid)));
}

/// @param generator  `field.generate` of a scene, as JSON.
std::shared_ptr<Field> make_field(const std::string& generator, const py::object& report) {
  Json keys = {{"generate", parse_value(generator)}};
  const SceneDescription description =
      read_scene_json({{"field", keys}, {"integrator", {{"type", "photon_distribution"}}}}, "make");
  TensorGrid grid;
  run(report, 0, [&](const Progress& progress) {
    progress.update("making", 0, 1);
    grid = generate(description.field.generate->generator, description.field.generate->grid);
  });
  return std::make_shared<Field>(std::move(keys), source_of(std::move(grid)));
}

/// The voxels of a grid as an array (nz, ny, nx, ...) over the box of its active voxels. `set(from, to)` copies one.
template <class Blocks, class Set>
py::array dense_array(const Blocks& blocks, const Eigen::AlignedBox3i& box, Shape inner, float fill, const Set& set) {
  const Eigen::Vector3i size = box.sizes() + Eigen::Vector3i::Ones();
  Shape shape{size.z(), size.y(), size.x()};
  std::size_t numbers = 1;
  for (const py::ssize_t count : inner) numbers *= static_cast<std::size_t>(count);
  shape.insert(shape.end(), inner.begin(), inner.end());
  std::vector<float> values(size.cast<std::size_t>().prod() * numbers, fill);
  for (const auto& block : blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      if (!block.active[static_cast<std::size_t>(offset)]) continue;
      const Eigen::Vector3i at = block.origin + TensorBlock::position(offset) - box.min();
      const std::size_t row = static_cast<std::size_t>(at.z()) * size.y() + at.y();
      set(block.values[static_cast<std::size_t>(offset)], &values[(row * size.x() + at.x()) * numbers]);
    }
  return taken(std::move(values), shape);
}

/// The tensors of level 0 over the box of the active voxels, and the transform of its indices (x, y, z) to the world.
py::tuple tensors_of(const Field& field) {
  TensorGrid grid;
  run(py::none(), 0, [&](const Progress&) { grid = field.grid(); });
  const Eigen::AlignedBox3i box = grid.active_box();
  const Eigen::Affine3d to_world = grid.to_world * Eigen::Translation3d(box.min().cast<double>());
  const py::array tensors = dense_array(grid.blocks, box, {3, 3}, 0, [](const Eigen::Matrix3f& tensor, float* to) {
    Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>{to} = tensor;
  });
  return py::make_tuple(tensors, rows_first(to_world.matrix()), grid.name, grid.metadata);
}

void copy_blocks(TensorBlocks& blocks, Archive& archive) {
  std::size_t count = blocks.size();
  archive.copy(count);
  if (archive.reads()) {
    archive.require(count, block_floats * sizeof(float));
    blocks = make_blocks(count);
  }
  for (TensorBlock& block : blocks) {
    archive.copy(block.origin.data(), sizeof block.origin);
    archive.copy(block.active);
    archive.copy(block.values.front().data(), block_floats * sizeof(float));
  }
}

/// All that a grid holds, to or from the bytes that another process gets.
void copy_grid(TensorGrid& grid, Archive& archive) {
  std::string metadata = Json(grid.metadata).dump();
  std::size_t finer = grid.finer.size();
  archive.copy_list(grid.name);
  archive.copy(grid.to_world.data(), sizeof grid.to_world.matrix());
  archive.copy_list(metadata);
  archive.copy_list(grid.surface.vertices);
  archive.copy_list(grid.surface.triangles);
  archive.copy(finer);
  if (archive.reads()) {
    grid.metadata = parse_value(metadata).get<std::map<std::string, std::string>>();
    archive.require(finer, sizeof(std::size_t));
    grid.finer.resize(finer);
  }
  for (TensorBlocks* blocks : levels_of(grid)) copy_blocks(*blocks, archive);
}

py::bytes voxels_of(const Field& field) {
  Archive archive;
  run(py::none(), 0, [&](const Progress&) {
    TensorGrid grid = field.grid();
    copy_grid(grid, archive);
  });
  return archive.take();
}

/// @param voxels  Of `voxels_of`.
std::shared_ptr<Field> field_of_voxels(const std::string& keys, const std::string& voxels) {
  TensorGrid grid;
  Archive archive(voxels);
  copy_grid(grid, archive);
  archive.finish();
  return std::make_shared<Field>(parse_value(keys), source_of(std::move(grid)));
}

py::array invariant_of_field(const Field& field, const std::string& name, const py::object& report) {
  const Invariant which = invariant_of(name);
  ScalarGrid invariant;
  Eigen::AlignedBox3i box;
  run(report, 0, [&](const Progress& progress) {
    progress.update("deriving", 0, 1);
    TensorGrid grid = field.grid();
    box = grid.active_box();
    remove_non_finite(grid);
    invariant = invariant_grid(which, grid);
  });
  const float none = std::numeric_limits<float>::quiet_NaN();
  return dense_array(invariant.blocks, box, {}, none, [](float value, float* to) { *to = value; });
}

void write_field(const Field& field, const std::filesystem::path& path, bool half, const py::object& report) {
  require(path.extension() == ".vdb", path.string() + " must end in .vdb");
  run(report, 0, [&](const Progress& progress) {
    progress.update("writing", 0, 1);
    OutputFile file(path);
    TensorGrid grid = field.grid();
    if (remove_non_finite(grid) > 0 && grid.blocks.empty())
      throw std::runtime_error(path.string() + ": no voxel of the field is finite");
    file.write([&](const std::filesystem::path& temporary) { write_tensor_vdb(temporary, grid, half); });
    file.commit();
  });
}

}  // namespace

void add_fields(py::module_& module) {
  py::class_<Field, std::shared_ptr<Field>>(module, "Field");
  module.def("field_of_floats", &field_of_array<float>);
  module.def("field_of_doubles", &field_of_array<double>);
  module.def("read_field", &read_field);
  module.def("make_field", &make_field);
  module.def("write_field", &write_field);
  module.def("tensors_of", &tensors_of);
  module.def("surface_of", &surface_of);
  module.def("voxels_of", &voxels_of);
  module.def("field_of_voxels", &field_of_voxels);
  module.def("invariant", &invariant_of_field);
  module.def("invariant_names", &invariant_names);
}

}  // namespace tensorray
