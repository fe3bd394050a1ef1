#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

#include "base/files/temporary_folder.h"
#include "base/process/archive.h"
#include "base/text/content_hash.h"
#include "scenes/scene/scene.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

/// What a process needs of a file besides the field's bricks, which are at its beginning.
struct FieldRest {
  FieldParts parts;
  std::size_t stride = 0;
  int components = 0;
  EigenvalueReport eigenvalues;
  std::size_t non_finite = 0;
  std::vector<std::string> notes;
  FieldUnits units;

  void copy(Archive& archive) {
    archive.copy(parts.interpolant);
    archive.copy(parts.to_world.data(), 16 * sizeof(double));
    archive.copy(parts.voxels.min());
    archive.copy(parts.voxels.max());
    archive.copy(parts.max_norm);
    std::size_t levels = parts.levels.size();
    archive.copy(levels);
    parts.levels.resize(levels);
    for (BrickList& level : parts.levels) {
      archive.copy_list(level.places);
      archive.copy_list(level.strongest);
    }
    archive.copy_list(parts.surface.vertices);
    archive.copy_list(parts.surface.triangles);
    archive.copy(stride);
    archive.copy(components);
    archive.copy(eigenvalues);
    archive.copy(non_finite);
    std::size_t count = notes.size();
    archive.copy(count);
    notes.resize(count);
    for (std::string& note : notes) archive.copy_list(note);
    archive.copy_list(units.length);
    archive.copy_list(units.tensor);
    archive.copy(units.is_anatomical);
  }
};

/// The end of the file.
struct FieldEnd {
  std::uint64_t rest = 0;  ///< Bytes of FieldRest, which are before it.
  std::array<char, 16> mark{};
};

constexpr std::array<char, 16> field_mark{"tensorray field"};

std::uint64_t size_of(const Descriptor& file) {
  struct stat status {};
  return fstat(file.get(), &status) == 0 ? static_cast<std::uint64_t>(status.st_size) : 0;
}

/// Writes to the file of a field's bricks what else another process needs. @return false if there is no such file, or
/// the disk has no space for it.
bool complete_file(const LoadedField& loaded) {
  const TensorField& field = loaded.field;
  const BrickMemory& memory = field.memory();
  if (!memory.file) return false;
  FieldRest rest;
  rest.parts.interpolant = field.interpolant();
  rest.parts.to_world = field.to_world();
  rest.parts.voxels = field.voxels().cast<int>();
  rest.parts.max_norm = field.max_norm();
  rest.parts.levels = field.bricks_of_levels();
  rest.parts.surface = field.surface();
  rest.stride = memory.stride;
  rest.components = memory.components;
  rest.eigenvalues = loaded.eigenvalues;
  rest.non_finite = loaded.non_finite;
  rest.notes = loaded.notes;
  rest.units = loaded.units;
  Archive archive;
  rest.copy(archive);
  std::string bytes = archive.take();
  const FieldEnd end{bytes.size(), field_mark};
  bytes.append(reinterpret_cast<const char*>(&end), sizeof end);
  return write_whole_at(memory.file->get(), bytes, size_of(*memory.file));
}

/// The field of a file, with its bricks where they are; nothing if the file is not complete.
std::optional<LoadedField> field_of_file(Descriptor file) {
  const std::uint64_t size = size_of(file);
  FieldEnd end;
  if (size < sizeof end || !read_whole_at(file.get(), &end, sizeof end, size - sizeof end) || end.mark != field_mark ||
      end.rest > size - sizeof end)
    return {};
  std::string bytes(end.rest, '\0');
  if (!read_whole_at(file.get(), bytes.data(), bytes.size(), size - sizeof end - bytes.size())) return {};
  Archive archive(bytes);
  FieldRest rest;
  rest.copy(archive);
  std::size_t count = 0;
  for (const BrickList& level : rest.parts.levels) count += level.places.size();
  rest.parts.memory = bricks_of_file(std::move(file), count, rest.stride, rest.components);
  rest.notes.emplace_back("the field is that of another process, which has loaded it");
  return LoadedField{TensorField(std::move(rest.parts)), rest.eigenvalues, rest.non_finite, std::move(rest.notes),
                     std::move(rest.units)};
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
