#include "volumes/files/vdb_leaves.h"

#include <cstring>
#include <sstream>
#include <string>

#include <openvdb/io/Compression.h>
#include <openvdb/points/StreamCompression.h>

#include "base/byte_order.h"
#include "volumes/grids/four_floats.h"

namespace tensorray {
namespace {

constexpr int voxels = TensorBlock::voxels;

}  // namespace

LeafReader::LeafReader(const FileBytes& file, const StoredTree& tree)
    : file_(file), tree_(tree), size_(value_size(tree.type).value()) {}

void LeafReader::fetch(const StoredLeaf& leaf, const StoredLeaf& last) {
  first_ = leaf.at - StoredLeaf::mask_bytes;
  stored_.resize(static_cast<std::size_t>(last.at + last.bytes - first_));
  if (file_.read(first_, stored_.data(), stored_.size())) return;
  stored_.clear();
  throw Misfit();
}

void LeafReader::unpack(const StoredLeaf& leaf) {
  const auto bytes = static_cast<std::size_t>(leaf.bytes);
  if (bytes == 0) throw Misfit();
  const char* const stored = stored_.data() + (leaf.at - first_);
  const int flag = static_cast<signed char>(stored[0]);
  if (flag != leaf.flag || voxel_mask(stored - StoredLeaf::mask_bytes) != leaf.active) throw Misfit();
  const auto before = static_cast<std::size_t>(1 + bytes_behind_flag(flag, size_, voxels));
  has_all_ = flag == all_values || !tree_.active_only;
  const std::size_t count = has_all_ ? voxels : leaf.active.count();
  if (before > bytes) throw Misfit();
  if (count > 0)
    unpack(stored + before, bytes - before, count * static_cast<std::size_t>(tree_.half ? size_.half : size_.full));
}

/// @param bytes  Of the chunk. @param expected  Bytes that its values have.
void LeafReader::unpack(const char* chunk, std::size_t bytes, std::size_t expected) {
  constexpr std::size_t length_bytes = 8, blosc_header = 16;
  if (tree_.blosc || tree_.zip) {
    if (bytes < length_bytes) throw Misfit();
    const auto stored = read_number<std::int64_t>(chunk, ByteOrder::little);
    if (stored > 0 && static_cast<std::size_t>(stored) != bytes - length_bytes) throw Misfit();
    if (stored > 0 && !tree_.blosc) {
      std::istringstream stream(std::string(chunk, bytes));
      openvdb::io::unzipFromStream(stream, values_.data(), expected);
      if (!stream) throw Misfit();
      return;
    }
    chunk += length_bytes;
    bytes -= length_bytes;
    if (stored > 0) {
      if (bytes < blosc_header || !blosc_fits(chunk, stored, static_cast<std::int64_t>(expected))) throw Misfit();
      openvdb::compression::bloscDecompress(values_.data(), expected, values_.size(), chunk);
      return;
    }
  }
  if (bytes != expected) throw Misfit();
  std::memcpy(values_.data(), chunk, expected);
}

const float* LeafReader::vectors(const StoredLeaf& leaf) const {
  constexpr std::int64_t vector_bytes = 3 * sizeof(float);
  const bool are_vectors = !tree_.half && size_.full == vector_bytes && leaf.active.all();
  return are_vectors ? reinterpret_cast<const float*>(values_.data()) : nullptr;
}

void LeafReader::put(const StoredLeaf& leaf, const std::vector<TensorEntry>& entries, TensorBlock& block) const {
  const bool is_double = size_.full % 8 == 0;
  if (tree_.half)
    put_numbers<openvdb::math::half>(leaf, entries, block);
  else if (is_double)
    put_numbers<double>(leaf, entries, block);
  else
    put_numbers<float>(leaf, entries, block);
}

template <class Number>
void LeafReader::put_numbers(const StoredLeaf& leaf, const std::vector<TensorEntry>& entries,
                             TensorBlock& block) const {
  const auto* const numbers = reinterpret_cast<const Number*>(values_.data());
  const int components = static_cast<int>((tree_.half ? size_.half : size_.full) / std::int64_t{sizeof(Number)});
  for (const TensorEntry& entry : entries) {
    const Number* from = numbers + entry.component;
    float* to = block.values[0].data() + (3 * entry.column + entry.row);
    if (leaf.active.all()) {
      for (int i = 0; i < voxels; ++i) to[9 * i] = static_cast<float>(from[i * components]);
      continue;
    }
    for (int i = 0; i < voxels; ++i, to += 9) {
      const bool is_active = leaf.active[static_cast<std::size_t>(i)];
      if (is_active) *to = static_cast<float>(*from);
      if (is_active || has_all_) from += components;
    }
  }
}

void put_rows(const std::array<const float*, 3>& rows, TensorBlock& block) {
  for (int i = 0; i < voxels; ++i) {
    const Four a = read_four(rows[0] + 3 * i), b = read_four(rows[1] + 3 * i), c = read_four(rows[2] + 3 * i);
    float* const T = block.values[i].data();
    write_four(__builtin_shufflevector(low_pairs(a, b), low_pairs(c, a), 0, 1, 4, 7), T);       // a₀ b₀ c₀ a₁
    write_four(__builtin_shufflevector(low_pairs(b, c), high_pairs(a, b), 2, 3, 4, 5), T + 4);  // b₁ c₁ a₂ b₂
    T[8] = c[2];
  }
}

}  // namespace tensorray
