#include "scenes/scene/shared_field.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "base/files/shared_file.h"
#include "base/text/content_hash.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

/// What ends a file, for processes of the same program. Before it are, from the end to the beginning: notes,
/// `strongest` and the places of all bricks, what is unused, and bricks.
struct FileEnding {
  std::array<double, 16> to_world;
  std::array<int, 6> voxels;
  Interpolant interpolant;
  double max_norm;
  std::size_t bricks, stride;
  int components;
  EigenvalueReport eigenvalues;
  std::size_t non_finite, notes;  ///< `notes`: their bytes.
  std::array<char, 16> mark;
};

constexpr std::array<char, 16> field_mark{"tensorray field"};

FileEnding ending_of(const LoadedField& loaded, std::size_t notes) {
  const TensorField& field = loaded.field;
  FileEnding ending{};
  std::copy_n(field.to_world().data(), 16, ending.to_world.begin());
  const Eigen::AlignedBox3i voxels = field.voxels().cast<int>();
  std::copy_n(voxels.min().data(), 3, ending.voxels.begin());
  std::copy_n(voxels.max().data(), 3, ending.voxels.begin() + 3);
  ending.interpolant = field.interpolant();
  ending.max_norm = field.max_norm();
  ending.bricks = field.memory().count;
  ending.stride = field.memory().stride;
  ending.components = field.memory().components;
  ending.eigenvalues = loaded.eigenvalues;
  ending.non_finite = loaded.non_finite;
  ending.notes = notes;
  ending.mark = field_mark;
  return ending;
}

template <class T>
std::string_view raw_bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::uint64_t size_of(const Descriptor& file) {
  struct stat status {};
  return fstat(file.get(), &status) == 0 ? static_cast<std::uint64_t>(status.st_size) : 0;
}

/// Writes to the file of a field's bricks what else another process needs. @return false if there is no such file, or
/// the disk has no space for it.
bool complete_file(const LoadedField& loaded) {
  const BrickMemory& memory = loaded.field.memory();
  if (!memory.file) return false;
  std::vector<float> strongest;
  for (const Eigen::Vector3i& brick : loaded.field.bricks()) strongest.push_back(loaded.field.brick(brick).strongest);
  std::string notes;
  for (const std::string& note : loaded.notes) notes += note + '\0';
  const FileEnding ending = ending_of(loaded, notes.size());
  std::uint64_t at = size_of(*memory.file);
  for (const std::string_view bytes : {raw_bytes(loaded.field.bricks()), raw_bytes(strongest), std::string_view(notes),
                                       std::string_view(reinterpret_cast<const char*>(&ending), sizeof ending)}) {
    if (!write_whole_at(memory.file->get(), bytes, at)) return false;
    at += bytes.size();
  }
  return true;
}

/// The field of a file, with its bricks where they are; nothing if the file is not complete.
std::optional<LoadedField> field_of_file(Descriptor file) {
  std::uint64_t at = size_of(file);
  const auto read_before = [&](void* bytes, std::size_t count) {
    return count <= at && read_whole_at(file.get(), bytes, count, at -= count);
  };
  FileEnding ending{};
  if (!read_before(&ending, sizeof ending) || ending.mark != field_mark) return {};
  FieldParts parts;
  std::copy_n(ending.to_world.begin(), 16, parts.to_world.data());
  std::copy_n(ending.voxels.begin(), 3, parts.voxels.min().data());
  std::copy_n(ending.voxels.begin() + 3, 3, parts.voxels.max().data());
  parts.interpolant = ending.interpolant;
  parts.max_norm = ending.max_norm;
  std::string notes(ending.notes, '\0');
  parts.strongest.resize(ending.bricks);
  parts.bricks.resize(ending.bricks);
  if (!read_before(notes.data(), notes.size()) ||
      !read_before(parts.strongest.data(), raw_bytes(parts.strongest).size()) ||
      !read_before(parts.bricks.data(), raw_bytes(parts.bricks).size()))
    return {};
  parts.memory = bricks_of_file(std::move(file), ending.bricks, ending.stride, ending.components);
  LoadedField loaded{TensorField(std::move(parts)), ending.eigenvalues, ending.non_finite, {}};
  for (std::size_t first = 0; first < notes.size(); first += loaded.notes.back().size() + 1)
    loaded.notes.emplace_back(notes.c_str() + first);
  loaded.notes.emplace_back("the field is that of another process, which has loaded it");
  return loaded;
}

}  // namespace

LoadedField share_field(const std::string& key, const std::function<LoadedField()>& load, const Progress& progress) {
  if (!memory_bound()) return load();
  const auto shared = std::make_shared<SharedFile>(fmt::format("{:016x}", content_hash(key)), [&] {
    progress.update("waiting for the process that loads the field", 0, 1);
  });
  std::optional<LoadedField> found;
  if (shared->file().is_open()) found = field_of_file(duplicate(shared->file()));
  LoadedField loaded = found ? std::move(*found) : load();
  if (!found && !complete_file(loaded)) return loaded;  // Others need not wait.
  if (!found) shared->offer(*loaded.field.memory().file);
  loaded.field.keep_with_bricks(shared);
  return loaded;
}

}  // namespace tensorray
