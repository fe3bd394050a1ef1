#include "volumes/files/vdb_leaves.h"

#include <array>
#include <istream>
#include <streambuf>

#include <openvdb/io/Compression.h>

namespace tensorray {
namespace {

constexpr int voxels = TensorBlock::voxels;

/// Bytes in memory as a stream, which OpenVDB's functions need.
class MemoryBuffer : public std::streambuf {
 public:
  void set(const char* begin, const char* end) {
    char* const first = const_cast<char*>(begin);  // Nobody writes to it.
    setg(first, first, first + (end - begin));
  }
};

constexpr std::size_t greatest_value = 24;  // Bytes.

/// What a thread needs to unpack leaves. Making a stream takes as long as half of a leaf.
struct Unpacking {
  MemoryBuffer buffer;
  std::istream stream{&buffer};
  alignas(8) std::array<char, voxels * greatest_value> values;
};

}  // namespace

LeafReader::LeafReader(const FileBytes& file, const StoredTree& tree)
    : file_(file), tree_(tree), size_(value_size(tree.type).value()) {}

void LeafReader::read(const StoredLeaf& leaf, const std::vector<TensorEntry>& entries, TensorBlock& block) {
  thread_local Unpacking unpacking;
  const auto bytes = static_cast<std::size_t>(leaf.bytes);
  stored_.resize(bytes);
  if (bytes == 0 || !file_.read(leaf.at, stored_.data(), bytes)) throw Misfit();
  const char* const stored = stored_.data();
  const int flag = static_cast<signed char>(stored[0]);
  const auto before = static_cast<std::size_t>(1 + bytes_behind_flag(flag, size_, voxels));
  const bool has_all = flag == all_values || !tree_.active_only;
  const std::size_t count = has_all ? voxels : leaf.active.count();
  const std::size_t unpacked = count * static_cast<std::size_t>(tree_.half ? size_.half : size_.full);
  if (before > bytes) throw Misfit();
  if (count == 0) return;
  auto& [buffer, stream, values] = unpacking;
  buffer.set(stored + before, stored + bytes);
  stream.clear();
  if (tree_.blosc)
    openvdb::io::bloscFromStream(stream, values.data(), unpacked);
  else if (tree_.zip)
    openvdb::io::unzipFromStream(stream, values.data(), unpacked);
  else
    stream.read(values.data(), static_cast<std::streamsize>(unpacked));
  if (!stream) throw Misfit();
  const bool is_double = size_.full % 8 == 0;
  if (tree_.half)
    put<openvdb::math::half>(values.data(), leaf, has_all, entries, block);
  else if (is_double)
    put<double>(values.data(), leaf, has_all, entries, block);
  else
    put<float>(values.data(), leaf, has_all, entries, block);
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
