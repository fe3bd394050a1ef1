#include "volumes/files/vdb_leaves.h"

#include <cstring>
#include <sstream>
#include <string>

#include <openvdb/io/Compression.h>
#include <openvdb/points/StreamCompression.h>

#include "base/byte_order.h"

namespace tensorray {
namespace {

constexpr int voxels = TensorBlock::voxels;

}  // namespace

LeafReader::LeafReader(const FileBytes& file, const StoredTree& tree)
    : file_(file), tree_(tree), size_(value_size(tree.type).value()) {}

void LeafReader::fetch(const StoredLeaf& leaf, const StoredLeaf& last) {
  first_ = leaf.at - StoredLeaf::mask_bytes;
  stored_.resize(static_cast<std::size_t>(last.at + last.bytes - first_));
  if (!file_.read(first_, stored_.data(), stored_.size())) throw Misfit();
}

void LeafReader::read(const StoredLeaf& leaf, const std::vector<TensorEntry>& entries, TensorBlock& block) {
  const auto bytes = static_cast<std::size_t>(leaf.bytes);
  if (bytes == 0) throw Misfit();
  const char* const stored = stored_.data() + (leaf.at - first_);
  const int flag = static_cast<signed char>(stored[0]);
  if (flag != leaf.flag || voxel_mask(stored - StoredLeaf::mask_bytes) != leaf.active) throw Misfit();
  const auto before = static_cast<std::size_t>(1 + bytes_behind_flag(flag, size_, voxels));
  const bool has_all = flag == all_values || !tree_.active_only;
  const std::size_t count = has_all ? voxels : leaf.active.count();
  const std::size_t expected = count * static_cast<std::size_t>(tree_.half ? size_.half : size_.full);
  if (before > bytes) throw Misfit();
  if (count == 0) return;
  const char* const values = unpacked(stored + before, bytes - before, expected);
  const bool is_double = size_.full % 8 == 0;
  if (tree_.half)
    put<openvdb::math::half>(values, leaf, has_all, entries, block);
  else if (is_double)
    put<double>(values, leaf, has_all, entries, block);
  else
    put<float>(values, leaf, has_all, entries, block);
}

/// The values of a chunk of `bytes`.
const char* LeafReader::unpacked(const char* chunk, std::size_t bytes, std::size_t expected) {
  constexpr std::size_t length_bytes = 8, blosc_header = 16;
  if (tree_.blosc || tree_.zip) {
    if (bytes < length_bytes) throw Misfit();
    const auto stored = read_number<std::int64_t>(chunk, ByteOrder::little);
    if (stored > 0 && tree_.blosc) {
      chunk += length_bytes;
      if (static_cast<std::size_t>(stored) != bytes - length_bytes || bytes - length_bytes < blosc_header ||
          !blosc_fits(chunk, stored, static_cast<std::int64_t>(expected)))
        throw Misfit();
      openvdb::compression::bloscDecompress(values_.data(), expected, values_.size(), chunk);
      return values_.data();
    }
    if (stored > 0) {
      std::istringstream stream(std::string(chunk, bytes));
      openvdb::io::unzipFromStream(stream, values_.data(), expected);
      if (!stream) throw Misfit();
      return values_.data();
    }
    chunk += length_bytes;  // The chunk is not compressed.
    bytes -= length_bytes;
  }
  if (bytes != expected) throw Misfit();
  std::memcpy(values_.data(), chunk, expected);
  return values_.data();
}

template <class Number>
void LeafReader::put(const char* values, const StoredLeaf& leaf, bool has_all, const std::vector<TensorEntry>& entries,
                     TensorBlock& block) const {
  const auto* const numbers = reinterpret_cast<const Number*>(values);
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
      if (is_active || has_all) from += components;
    }
  }
}

}  // namespace tensorray
