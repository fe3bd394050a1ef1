#include "volumes/files/vdb_leaves.h"

#include <istream>
#include <streambuf>

#include <openvdb/io/Compression.h>

namespace tensorray {
namespace {

constexpr int voxels = TensorBlock::voxels;

/// Bytes in memory as a stream, which OpenVDB's functions need.
class MemoryBuffer : public std::streambuf {
 public:
  MemoryBuffer(char* begin, char* end) { setg(begin, begin, end); }
};

}  // namespace

LeafReader::LeafReader(const FileBytes& file, const StoredTree& tree)
    : file_(file), tree_(tree), size_(value_size(tree.type).value()) {}

void LeafReader::read(const StoredLeaf& leaf, const std::vector<TensorEntry>& entries, TensorBlock& block) {
  stored_.resize(static_cast<std::size_t>(leaf.bytes));
  if (stored_.empty() || !file_.read(leaf.at, stored_.data(), stored_.size())) throw Misfit();
  const int flag = static_cast<signed char>(stored_[0]);
  const auto before = static_cast<std::size_t>(1 + bytes_behind_flag(flag, size_, voxels));
  const bool has_all = flag == all_values || !tree_.active_only;
  const std::size_t count = has_all ? voxels : leaf.active.count();
  values_.resize(count * static_cast<std::size_t>(tree_.half ? size_.half : size_.full));
  if (before > stored_.size()) throw Misfit();
  if (count == 0) return;
  MemoryBuffer buffer(stored_.data() + before, stored_.data() + stored_.size());
  std::istream stream(&buffer);
  if (tree_.blosc)
    openvdb::io::bloscFromStream(stream, values_.data(), values_.size());
  else if (tree_.zip)
    openvdb::io::unzipFromStream(stream, values_.data(), values_.size());
  else
    stream.read(values_.data(), static_cast<std::streamsize>(values_.size()));
  if (!stream) throw Misfit();
  const bool is_double = size_.full % 8 == 0;
  if (tree_.half)
    put<openvdb::math::half>(leaf, has_all, entries, block);
  else if (is_double)
    put<double>(leaf, has_all, entries, block);
  else
    put<float>(leaf, has_all, entries, block);
}

template <class Number>
void LeafReader::put(const StoredLeaf& leaf, bool has_all, const std::vector<TensorEntry>& entries,
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
      if (is_active || has_all) from += components;
    }
  }
}

}  // namespace tensorray
