#include "volumes/making/field_file.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include <sys/stat.h>

namespace tensorray {
namespace {

constexpr std::array<char, 16> mark{"tensorray field"};

/// The end of the file. Before it are, from the end to the beginning: words, `strongest` and the places of all bricks,
/// what is unused, and bricks.
struct Ending {
  std::array<double, 16> to_world;
  std::array<std::int32_t, 6> voxels;
  std::array<std::int32_t, 3> between_border_components;
  double greatest_norm;
  std::uint64_t count, stride, words;
  std::array<char, 16> mark;
};

static_assert(sizeof(Eigen::Vector3i) == 3 * sizeof(std::int32_t));

std::uint64_t size_of(const Descriptor& file) {
  struct stat status {};
  return fstat(file.get(), &status) == 0 ? static_cast<std::uint64_t>(status.st_size) : 0;
}

template <class T>
std::string_view bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

Ending ending_of(const TensorField& field, std::uint64_t words) {
  const BrickMemory& memory = field.memory();
  Ending ending{};
  std::copy_n(field.to_world().data(), 16, ending.to_world.begin());
  const Eigen::AlignedBox3i voxels = field.voxels().cast<int>();
  std::copy_n(voxels.min().data(), 3, ending.voxels.begin());
  std::copy_n(voxels.max().data(), 3, ending.voxels.begin() + 3);
  ending.between_border_components = {static_cast<std::int32_t>(field.interpolant().between),
                                      static_cast<std::int32_t>(field.interpolant().border), memory.components};
  ending.greatest_norm = field.greatest_norm();
  ending.count = memory.count;
  ending.stride = memory.stride;
  ending.words = words;
  ending.mark = mark;
  return ending;
}

/// All but the bricks in memory.
FieldParts parts_of(const Ending& ending) {
  FieldParts parts;
  std::copy_n(ending.to_world.begin(), 16, parts.to_world.data());
  std::copy_n(ending.voxels.begin(), 3, parts.voxels.min().data());
  std::copy_n(ending.voxels.begin() + 3, 3, parts.voxels.max().data());
  parts.interpolant = {static_cast<Interpolation>(ending.between_border_components[0]),
                       static_cast<Border>(ending.between_border_components[1])};
  parts.greatest_norm = ending.greatest_norm;
  parts.bricks.resize(ending.count);
  parts.strongest.resize(ending.count);
  return parts;
}

}  // namespace

bool complete_field_file(const TensorField& field, const std::string& words) {
  const BrickMemory& memory = field.memory();
  if (!memory.file) return false;
  std::vector<float> strongest;
  for (const Eigen::Vector3i& brick : field.bricks()) strongest.push_back(field.brick(brick).strongest);
  const Ending ending = ending_of(field, words.size());
  std::uint64_t at = size_of(*memory.file);
  for (const std::string_view bytes : {bytes_of(field.bricks()), bytes_of(strongest), std::string_view(words),
                                       std::string_view(reinterpret_cast<const char*>(&ending), sizeof ending)}) {
    if (!write_whole_at(memory.file->get(), bytes, at)) return false;
    at += bytes.size();
  }
  return true;
}

std::optional<FieldOfFile> field_of_file(Descriptor file) {
  Ending ending{};
  const std::uint64_t size = size_of(file);
  if (size < sizeof ending || !read_whole_at(file.get(), &ending, sizeof ending, size - sizeof ending) ||
      ending.mark != mark || ending.words > size || ending.stride == 0 ||
      ending.count > size / (ending.stride * sizeof(float)))
    return {};
  FieldParts parts = parts_of(ending);
  std::string words(ending.words, '\0');
  const std::uint64_t of_words = size - sizeof ending - ending.words;
  const std::uint64_t of_strongest = of_words - bytes_of(parts.strongest).size();
  const std::uint64_t of_bricks = of_strongest - bytes_of(parts.bricks).size();
  if (!read_whole_at(file.get(), words.data(), words.size(), of_words) ||
      !read_whole_at(file.get(), parts.strongest.data(), bytes_of(parts.strongest).size(), of_strongest) ||
      !read_whole_at(file.get(), parts.bricks.data(), bytes_of(parts.bricks).size(), of_bricks))
    return {};
  parts.memory = bricks_of_file(std::move(file), ending.count, ending.stride, ending.between_border_components[2]);
  return FieldOfFile{TensorField(std::move(parts)), std::move(words)};
}

}  // namespace tensorray
