#include "volumes/files/vdb_tree_check.h"

#include <array>
#include <bitset>
#include <map>
#include <optional>
#include <vector>

#include "base/byte_order.h"

namespace tensorray {
namespace {

constexpr int blosc_header = 16;

struct Misfit {};

/// Bytes of a value in memory, and in a file with 16-bit floats.
struct ValueSize {
  std::int64_t full, half;
};

std::optional<ValueSize> value_size(const std::string& type) {
  static const std::map<std::string, ValueSize> sizes{{"Tree_float_5_4_3", {4, 2}},
                                                      {"Tree_double_5_4_3", {8, 2}},
                                                      {"Tree_vec3s_5_4_3", {12, 6}},
                                                      {"Tree_vec3d_5_4_3", {24, 6}}};
  const auto found = sizes.find(type);
  return found == sizes.end() ? std::nullopt : std::optional(found->second);
}

/// The flag before each chunk: which values of a node the chunk leaves out, and what replaces them.
enum NodeFlag : int {
  no_mask = 0,
  no_mask_minus_background = 1,
  no_mask_one_value = 2,
  mask_no_value = 3,
  mask_one_value = 4,
  mask_two_values = 5,
  all_values = 6
};

class Walker {
 public:
  Walker(std::istream& in, const StoredTree& tree, const ValueSize& size) : in_(in), tree_(tree), size_(size) {}

  void walk() {
    if (number<std::int32_t>() != 1) throw Misfit();  // Buffers.
    skip(size_.full);                                 // The background.
    const std::int64_t tiles = number<std::uint32_t>(), children = number<std::uint32_t>();
    skip(tiles * (origin_bytes + size_.full + 1));
    for (std::int64_t i = 0; i < children; ++i) {
      skip(origin_bytes);
      walk_upper_node();
    }
    for (std::int64_t i = 0; i < leaves_; ++i) skip_values<512>(mask<512>());
  }

 private:
  static constexpr std::int64_t origin_bytes = 12;

  template <class Number>
  Number number() {
    std::array<char, sizeof(Number)> bytes;
    in_.read(bytes.data(), bytes.size());
    return read_number<Number>(bytes.data(), ByteOrder::little);
  }

  void skip(std::int64_t bytes) {
    if (bytes < 0 || bytes > tree_.file_size) throw Misfit();
    in_.ignore(bytes);
    if (in_.gcount() != bytes) throw Misfit();
  }

  /// One bit for each value of a node.
  template <std::size_t Count>
  std::bitset<Count> mask() {
    std::array<char, Count / 8> bytes;
    in_.read(bytes.data(), bytes.size());
    std::bitset<Count> bits;
    for (std::size_t i = 0; i < Count; ++i) bits[i] = bytes[i / 8] >> (i % 8) & 1;
    return bits;
  }

  void walk_upper_node() {
    constexpr std::size_t count = 1 << 15;
    const auto children = mask<count>();
    skip_values<count>(mask<count>());
    for (std::size_t i = 0; i < children.count(); ++i) walk_lower_node();
  }

  void walk_lower_node() {
    constexpr std::size_t count = 1 << 12;
    const auto children = mask<count>();
    skip_values<count>(mask<count>());
    const auto leaves = static_cast<std::int64_t>(children.count());
    skip(leaves * 64);  // The masks of the leaves, which are repeated before the leaves' values.
    leaves_ += leaves;
  }

  template <std::size_t Count>
  void skip_values(const std::bitset<Count>& active) {
    const int flag = number<std::int8_t>();
    if (flag < no_mask || flag > all_values) throw Misfit();
    if (flag == no_mask_one_value || flag == mask_one_value || flag == mask_two_values) skip(size_.full);
    if (flag == mask_two_values) skip(size_.full);
    if (flag == mask_no_value || flag == mask_one_value || flag == mask_two_values) skip(Count / 8);
    const bool all = flag == all_values || !tree_.active_only;
    const auto count = static_cast<std::int64_t>(all ? Count : active.count());
    if (tree_.half && count == 0) return;
    skip_chunk(count * (tree_.half ? size_.half : size_.full));
  }

  /// @param expected  Bytes that OpenVDB has allocated.
  void skip_chunk(std::int64_t expected) {
    if (!tree_.blosc && !tree_.zip) return skip(expected);
    std::int64_t stored = number<std::int64_t>();
    if (stored <= 0) {  // The chunk is not compressed.
      if (stored != -expected) throw Misfit();
      return skip(expected);
    }
    if (tree_.blosc) {
      std::array<char, blosc_header> header;
      if (stored < blosc_header) throw Misfit();
      in_.read(header.data(), header.size());
      if (!blosc_fits(header.data(), stored, expected)) throw Misfit();
      stored -= blosc_header;
    }
    skip(stored);
  }

  std::istream& in_;
  const StoredTree& tree_;
  const ValueSize size_;
  std::int64_t leaves_ = 0;
};

}  // namespace

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

bool tree_fits(std::istream& in, const StoredTree& tree) {
  const std::optional<ValueSize> size = value_size(tree.type);
  if (!size) return true;
  try {
    Walker(in, tree, *size).walk();
    return true;
  } catch (const Misfit&) {
    return false;
  }
}

}  // namespace tensorray
