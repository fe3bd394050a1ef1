#include "volumes/files/vdb_tree_check.h"

#include <map>

#include "base/byte_order.h"

namespace tensorray {
namespace {

constexpr int blosc_header = 16;

/// Voxels along an edge of the nodes.
constexpr int leaf_width = TensorBlock::size, lower_width = 16 * leaf_width, upper_width = 32 * lower_width;

// Topology is read as it stands; of values only the beginnings are.
constexpr std::size_t topology_window = 1 << 16, values_window = 96;

class Walker {
 public:
  Walker(const FileBytes& file, std::int64_t at, const StoredTree& tree, const ValueSize& size, StoredLeaves& result)
      : in_(file, at, topology_window), tree_(tree), size_(size), result_(result) {}

  void walk() {
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
    in_.set_window(values_window);
    for (StoredLeaf& leaf : result_.leaves) {
      leaf.active = mask<TensorBlock::voxels>();
      leaf.at = in_.at();
      skip_values(leaf.active);
      leaf.bytes = static_cast<std::int32_t>(in_.at() - leaf.at);
    }
  }

 private:
  static constexpr std::int64_t origin_bytes = 12;

  /// One bit for each value of a node.
  template <std::size_t Count>
  std::bitset<Count> mask() {
    const char* const bytes = in_.next(Count / 8);
    std::bitset<Count> bits;
    for (std::size_t i = Count / 64; i-- > 0;)
      bits = bits << 64 | std::bitset<Count>(read_number<std::uint64_t>(bytes + 8 * i, ByteOrder::little));
    return bits;
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
      result_.leaves.push_back(leaf);
    });
    in_.skip(static_cast<std::int64_t>(children.count()) * TensorBlock::voxels / 8);  // Their masks, which come again.
  }

  /// Which values of a node are children; the others are tiles.
  template <std::size_t Count>
  std::bitset<Count> node_masks() {
    const auto children = mask<Count>(), active = mask<Count>();
    if (active.any()) result_.complete = false;
    skip_values(active);
    return children;
  }

  template <std::size_t Count>
  void skip_values(const std::bitset<Count>& active) {
    const int flag = in_.number<std::int8_t>();
    if (flag < no_mask || flag > all_values) throw Misfit();
    in_.skip(bytes_behind_flag(flag, size_, Count));
    const bool all = flag == all_values || !tree_.active_only;
    const auto count = static_cast<std::int64_t>(all ? Count : active.count());
    if (tree_.half && count == 0) return;
    skip_chunk(count * (tree_.half ? size_.half : size_.full));
  }

  /// @param expected  Bytes that its values have.
  void skip_chunk(std::int64_t expected) {
    if (!tree_.blosc && !tree_.zip) return in_.skip(expected);
    const std::int64_t stored = in_.number<std::int64_t>();
    if (stored <= 0) {  // The chunk is not compressed.
      if (stored != -expected) throw Misfit();
      return in_.skip(expected);
    }
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

bool tree_fits(const FileBytes& file, std::int64_t at, const StoredTree& tree, StoredLeaves& leaves) {
  const std::optional<ValueSize> size = value_size(tree.type);
  if (!size) return true;
  try {
    Walker(file, at, tree, *size, leaves).walk();
    return true;
  } catch (const Misfit&) {
    return false;
  }
}

}  // namespace tensorray
