#include "volumes/files/vdb_tree_check.h"

#include <algorithm>
#include <cstring>
#include <map>

#include <openvdb/Exceptions.h>
#include <openvdb/points/StreamCompression.h>

#include "base/byte_order.h"

namespace tensorray {
namespace {

constexpr int blosc_header = 16;

/// Voxels along an edge of the nodes.
constexpr int leaf_width = TensorBlock::size, lower_width = 16 * leaf_width, upper_width = 32 * lower_width;

// Topology is read as it stands; of values only the beginnings are.
constexpr std::size_t topology_window = 1 << 16, values_window = 96;

constexpr std::int64_t greatest_chunk = 1 << 20;  // More than leaves have.

/// One bit for each value of a node.
template <std::size_t Count>
std::bitset<Count> read_mask(const char* bytes) {
  std::bitset<Count> bits;
  if (std::all_of(bytes, bytes + Count / 8, [](char byte) { return byte == '\xff'; })) return bits.set();
  for (std::size_t i = Count / 64; i-- > 0;)
    bits = bits << 64 | std::bitset<Count>(read_number<std::uint64_t>(bytes + 8 * i, ByteOrder::little));
  return bits;
}

std::int64_t bytes_before_chunk(int flag, const ValueSize& size) {
  return 1 + bytes_behind_flag(flag, size, TensorBlock::voxels);
}

class Walker {
 public:
  Walker(const FileBytes& file, std::int64_t at, const StoredTree& tree, const ValueSize& size, StoredLeaves& result)
      : in_(file, at, topology_window), tree_(tree), size_(size), result_(result) {}

  /// Finds the leaves, with their masks.
  void walk_topology() {
    result_.complete = true;
    if (in_.number<std::int32_t>() != 1) throw Misfit();  // Buffers.
    in_.skip(size_.full);                                 // The background.
    const std::int64_t tiles = in_.number<std::uint32_t>(), children = in_.number<std::uint32_t>();
    for (std::int64_t i = 0; i < tiles; ++i) {
      in_.skip(origin_bytes + size_.full);
      if (in_.number<std::int8_t>() != 0) result_.complete = false;
    }
    for (std::int64_t i = 0; i < children; ++i) {
      const std::int32_t x = in_.number<std::int32_t>(), y = in_.number<std::int32_t>(), z = in_.number<std::int32_t>();
      walk_upper_node(Eigen::Vector3i(x, y, z).unaryExpr([](int index) { return index & ~(upper_width - 1); }));
    }
  }

  /// Finds the leaves' values by reading through them.
  void walk_values() {
    in_.set_window(values_window);
    for (StoredLeaf& leaf : result_.leaves) {
      leaf.active = mask<TensorBlock::voxels>();
      leaf.at = in_.at();
      leaf.flag = static_cast<std::int8_t>(skip_values(leaf.active));
      leaf.bytes = static_cast<std::int32_t>(in_.at() - leaf.at);
    }
  }

  /// Finds the leaves' values by a table. @return whether they end at `end`.
  bool follow(const LeafTable& table, std::int64_t end) {
    std::vector<StoredLeaf>& leaves = result_.leaves;
    if (table.flags.size() != leaves.size() || table.chunks.size() != leaves.size()) return false;
    std::int64_t at = in_.at();
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      StoredLeaf& leaf = leaves[i];
      leaf.flag = table.flags[i];
      if (leaf.flag < no_mask || leaf.flag > all_values) return false;
      if (table.chunks[i] < 0 || table.chunks[i] > greatest_chunk) return false;
      leaf.at = at + StoredLeaf::mask_bytes;
      leaf.bytes = static_cast<std::int32_t>(bytes_before_chunk(leaf.flag, size_) + table.chunks[i]);
      at = leaf.at + leaf.bytes;
    }
    return at == end;
  }

 private:
  static constexpr std::int64_t origin_bytes = 12;

  template <std::size_t Count>
  std::bitset<Count> mask() {
    return read_mask<Count>(in_.next(Count / 8));
  }

  /// Calls visit(i) for the bits of a mask, in order.
  template <std::size_t Count, class Visit>
  static void for_each(const std::bitset<Count>& bits, const Visit& visit) {
    for (std::size_t i = 0; i < Count; ++i)
      if (bits[i]) visit(static_cast<int>(i));
  }

  void walk_upper_node(const Eigen::Vector3i& origin) {
    const auto children = node_masks<1 << 15>();
    for_each(children,
             [&](int i) { walk_lower_node(origin + lower_width * Eigen::Vector3i(i >> 10, i >> 5 & 31, i & 31)); });
  }

  void walk_lower_node(const Eigen::Vector3i& origin) {
    const auto children = node_masks<1 << 12>();
    for_each(children, [&](int i) {
      StoredLeaf leaf;
      leaf.origin = origin + leaf_width * Eigen::Vector3i(i >> 8, i >> 4 & 15, i & 15);
      leaf.active = mask<TensorBlock::voxels>();
      result_.leaves.push_back(leaf);
    });
  }

  /// Which values of a node are children; the others are tiles.
  template <std::size_t Count>
  std::bitset<Count> node_masks() {
    const auto children = mask<Count>(), active = mask<Count>();
    if (active.any()) result_.complete = false;
    skip_values(active);
    return children;
  }

  /// @return the flag before them.
  template <std::size_t Count>
  int skip_values(const std::bitset<Count>& active) {
    const int flag = in_.number<std::int8_t>();
    if (flag < no_mask || flag > all_values) throw Misfit();
    in_.skip(bytes_behind_flag(flag, size_, Count));
    const bool all = flag == all_values || !tree_.active_only;
    const auto count = static_cast<std::int64_t>(all ? Count : active.count());
    if (!tree_.half || count > 0) skip_chunk(count * (tree_.half ? size_.half : size_.full));
    return flag;
  }

  /// @param expected  Bytes that its values have.
  void skip_chunk(std::int64_t expected) {
    if (!tree_.blosc && !tree_.zip) return in_.skip(expected);
    const std::int64_t stored = in_.number<std::int64_t>();
    if (stored <= 0) {  // The chunk is not compressed.
      if (stored != -expected) throw Misfit();
      return in_.skip(expected);
    }
    if (stored > greatest_chunk) throw Misfit();
    if (!tree_.blosc) return in_.skip(stored);
    if (stored < blosc_header || !blosc_fits(in_.next(blosc_header), stored, expected)) throw Misfit();
    in_.skip(stored - blosc_header);
  }

  ByteCursor in_;
  const StoredTree& tree_;
  const ValueSize size_;
  StoredLeaves& result_;
};

}  // namespace

std::optional<ValueSize> value_size(const std::string& type) {
  static const std::map<std::string, ValueSize> sizes{{"Tree_float_5_4_3", {4, 2}},
                                                      {"Tree_double_5_4_3", {8, 2}},
                                                      {"Tree_vec3s_5_4_3", {12, 6}},
                                                      {"Tree_vec3d_5_4_3", {24, 6}}};
  const auto found = sizes.find(type);
  return found == sizes.end() ? std::nullopt : std::optional(found->second);
}

std::int64_t bytes_behind_flag(int flag, const ValueSize& size, std::size_t count) {
  std::int64_t bytes = 0;
  if (flag == no_mask_one_value || flag == mask_one_value) bytes += size.full;
  if (flag == mask_two_values) bytes += 2 * size.full;
  const bool has_mask = flag == mask_no_value || flag == mask_one_value || flag == mask_two_values;
  return bytes + (has_mask ? static_cast<std::int64_t>(count / 8) : 0);
}

bool blosc_fits(const char* header, std::int64_t stored, std::int64_t expected) {
  return read_number<std::uint32_t>(header + 4, ByteOrder::little) == expected &&
         read_number<std::uint32_t>(header + 12, ByteOrder::little) == stored;
}

std::string leaf_table_text(const LeafTable& table) {
  std::string text;
  const auto add = [&](const auto* numbers, std::size_t count) {
    text.append(reinterpret_cast<const char*>(numbers), count * sizeof *numbers);
  };
  const auto count = static_cast<std::uint32_t>(table.flags.size());
  constexpr std::uint32_t not_packed = 0;
  add(&count, 1);
  add(&not_packed, 1);
  add(table.flags.data(), count);
  add(&not_packed, 1);
  add(table.chunks.data(), count);
  return text;
}

std::optional<LeafTable> read_leaf_table(const std::string& value) {
  std::size_t at = 0;
  const auto take = [&](std::size_t bytes) {
    if (bytes > value.size() - at) throw Misfit();
    at += bytes;
    return value.data() + (at - bytes);
  };
  const auto number = [&] { return read_number<std::uint32_t>(take(4), ByteOrder::little); };
  const auto read = [&](auto& numbers, std::size_t count) {
    const std::size_t stored = number(), bytes = count * sizeof numbers[0];
    if (stored > value.size()) throw Misfit();  // There is no list.
    numbers.resize(count);
    if (stored == 0) {
      std::memcpy(numbers.data(), take(bytes), bytes);
      return;
    }
    const char* const packed = take(stored);
    if (stored < blosc_header) throw Misfit();
    std::vector<char> unpacked(openvdb::compression::bloscUncompressedSize(packed) + blosc_header);
    openvdb::compression::bloscDecompress(unpacked.data(), bytes, unpacked.size(), packed);
    std::memcpy(numbers.data(), unpacked.data(), bytes);
  };
  try {
    LeafTable table;
    const std::size_t count = number();
    read(table.flags, count);
    read(table.chunks, count);
    return table;
  } catch (const Misfit&) {
    return std::nullopt;
  } catch (const openvdb::Exception&) {
    return std::nullopt;
  }
}

bool delayed_load_fits(const std::string& value, std::int64_t file_size) {
  // The format: the number of leaves; one byte for each leaf; eight bytes for each leaf's length. A length precedes
  // each of the two lists, which is packed if that length is not 0.
  std::size_t at = 4;
  const auto number = [&](std::size_t offset) {
    return offset + 4 > value.size() ? 0 : read_number<std::uint32_t>(value.data() + offset, ByteOrder::little);
  };
  const std::int64_t leaves = number(0);
  if (leaves > file_size / 64) return false;  // A leaf has a mask of 64 bytes.
  for (const std::int64_t bytes_each : {1, 8}) {
    constexpr std::int64_t rounding = 1 << 16;
    constexpr std::uint32_t absent = 0xffffffff;
    const std::uint32_t stored = number(at);
    at += 4;
    if (stored == absent) continue;
    if (stored == 0) {
      at += static_cast<std::size_t>(leaves * bytes_each);
      continue;
    }
    if (stored < blosc_header || at + stored > value.size()) return false;
    const std::int64_t unpacked = number(at + 4);
    if (unpacked > leaves * bytes_each + rounding || !blosc_fits(value.data() + at, stored, unpacked)) return false;
    at += stored;
  }
  return true;
}

namespace {

bool walk(const FileBytes& file, std::int64_t at, const StoredTree& tree, StoredLeaves& leaves, const LeafTable* table,
          std::int64_t end) {
  const std::optional<ValueSize> size = value_size(tree.type);
  if (!size) return true;
  try {
    if (table) leaves.leaves.reserve(table->flags.size());
    Walker walker(file, at, tree, *size, leaves);
    walker.walk_topology();
    // OpenVDB gives the leaves of trees with all values other flags in the table.
    if (!table || !tree.active_only || !walker.follow(*table, end)) walker.walk_values();
    return true;
  } catch (const Misfit&) {
    return false;
  }
}

}  // namespace

bool tree_fits(const FileBytes& file, std::int64_t at, const StoredTree& tree, StoredLeaves& leaves) {
  return walk(file, at, tree, leaves, nullptr, 0);
}

bool tree_fits(const FileBytes& file, std::int64_t at, std::int64_t end, const LeafTable& table, const StoredTree& tree,
               StoredLeaves& leaves) {
  return walk(file, at, tree, leaves, &table, end);
}

bool agrees(const LeafTable& table, const StoredTree& tree, const std::vector<StoredLeaf>& leaves) {
  const LeafTable found = table_of(tree, leaves);
  if (table.flags.size() != leaves.size() || table.chunks.size() != leaves.size()) return false;
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    if (tree.half && leaves[i].active.none()) continue;
    if (tree.active_only && table.flags[i] != found.flags[i]) return false;
    if (table.chunks[i] != found.chunks[i]) return false;
  }
  return true;
}

LeafTable table_of(const StoredTree& tree, const std::vector<StoredLeaf>& leaves) {
  const ValueSize size = value_size(tree.type).value();
  LeafTable table;
  for (const StoredLeaf& leaf : leaves) {
    table.flags.push_back(leaf.flag);
    table.chunks.push_back(leaf.bytes - bytes_before_chunk(leaf.flag, size));
  }
  return table;
}

std::bitset<TensorBlock::voxels> voxel_mask(const char* bytes) { return read_mask<TensorBlock::voxels>(bytes); }

}  // namespace tensorray
