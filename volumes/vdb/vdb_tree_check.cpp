#include "volumes/vdb/vdb_tree_check.h"

#include <algorithm>
#include <cerrno>
#include <map>
#include <system_error>

#include <fcntl.h>

#include "base/errors.h"
#include "base/text/byte_order.h"

namespace tensorray {
namespace {

constexpr int blosc_header = 16;

/// What a node leaves out, and what follows the flag before its values.
enum NodeFlag : int {
  no_mask = 0,
  no_mask_minus_background = 1,
  no_mask_one_value = 2,
  mask_no_value = 3,
  mask_one_value = 4,
  mask_two_values = 5,
  all_values = 6
};

constexpr std::size_t window = 1 << 16;  // Bytes that are read at once.

constexpr std::int64_t max_chunk = 1 << 20;  // More than leaves have.

/// Reads a file from front to back, and ahead. (Streams copy what they skip.)
class ByteCursor {
 public:
  ByteCursor(const FileBytes& file, std::int64_t at) : file_(file), at_(at) {}

  std::int64_t at() const { return at_; }

  /// @throw FormatError if the file does not have them.
  void skip(std::int64_t bytes) {
    if (bytes < 0 || bytes > file_.size() - at_) throw FormatError();
    at_ += bytes;
  }

  /// The next `count` bytes, which stay valid until the next call. @throw FormatError as above.
  const char* next(std::size_t count) {
    const auto wanted = static_cast<std::int64_t>(count);
    if (wanted > file_.size() - at_) throw FormatError();
    if (at_ < first_ || at_ + wanted > first_ + static_cast<std::int64_t>(bytes_.size())) {
      first_ = at_;
      bytes_.resize(std::min(std::max(count, window), static_cast<std::size_t>(file_.size() - at_)));
      if (!file_.read(first_, bytes_.data(), bytes_.size())) throw FormatError();
    }
    at_ += wanted;
    return bytes_.data() + (at_ - wanted - first_);
  }

  template <class Number>
  Number number() {
    return read_number<Number>(next(sizeof(Number)), ByteOrder::little);
  }

 private:
  const FileBytes& file_;
  std::int64_t at_, first_ = 0;  ///< The next byte, and that of `bytes_`.
  std::vector<char> bytes_;
};

/// One bit for each value of a node.
template <std::size_t Count>
std::bitset<Count> read_mask(const char* bytes) {
  std::bitset<Count> bits;
  if (std::all_of(bytes, bytes + Count / 8, [](char byte) { return byte == '\xff'; })) return bits.set();
  for (std::size_t i = Count / 64; i-- > 0;)
    bits = bits << 64 | std::bitset<Count>(read_number<std::uint64_t>(bytes + 8 * i, ByteOrder::little));
  return bits;
}

/// Bytes between the flag before the values of a node of `count` values and these values.
std::int64_t bytes_behind_flag(int flag, const ValueSize& size, std::size_t count) {
  std::int64_t bytes = 0;
  if (flag == no_mask_one_value || flag == mask_one_value) bytes += size.full;
  if (flag == mask_two_values) bytes += 2 * size.full;
  const bool has_mask = flag == mask_no_value || flag == mask_one_value || flag == mask_two_values;
  return bytes + (has_mask ? static_cast<std::int64_t>(count / 8) : 0);
}

std::int64_t bytes_before_chunk(int flag, const ValueSize& size) {
  return 1 + bytes_behind_flag(flag, size, TensorBlock::voxels);
}

/// Whether a Blosc chunk that begins with `header` (16 bytes) has a length of `stored` bytes, and unpacks to
/// `expected` bytes.
bool blosc_fits(const char* header, std::int64_t stored, std::int64_t expected) {
  return read_number<std::uint32_t>(header + 4, ByteOrder::little) == expected &&
         read_number<std::uint32_t>(header + 12, ByteOrder::little) == stored;
}

/// Reads through a tree. Throws FormatError where a length does not fit.
class TreeParser {
 public:
  TreeParser(const FileBytes& file, std::int64_t at, const StoredTree& tree, const ValueSize& size)
      : in_(file, at), tree_(tree), size_(size) {}

  std::vector<StoredLeaf> leaves() {
    std::vector<StoredLeaf> leaves(parse_topology());
    for (StoredLeaf& leaf : leaves) {
      leaf.active = mask<TensorBlock::voxels>();
      leaf.at = in_.at();
      leaf.flag = static_cast<std::int8_t>(skip_values(leaf.active));
      leaf.bytes = static_cast<std::int32_t>(in_.at() - leaf.at);
    }
    return leaves;
  }

 private:
  static constexpr std::int64_t origin_bytes = 12, mask_bytes = TensorBlock::voxels / 8;

  template <std::size_t Count>
  std::bitset<Count> mask() {
    return read_mask<Count>(in_.next(Count / 8));
  }

  /// @return the number of leaves.
  std::size_t parse_topology() {
    if (in_.number<std::int32_t>() != 1) throw FormatError();  // Buffers.
    in_.skip(size_.full);                                      // The background.
    const std::int64_t tiles = in_.number<std::uint32_t>(), children = in_.number<std::uint32_t>();
    in_.skip(tiles * (origin_bytes + size_.full + 1));
    std::size_t leaves = 0;
    for (std::int64_t i = 0; i < children; ++i) {
      in_.skip(origin_bytes);
      for (std::size_t lower = child_count<1 << 15>(); lower > 0; --lower) {
        const std::size_t count = child_count<1 << 12>();
        in_.skip(static_cast<std::int64_t>(count) * mask_bytes);
        leaves += count;
      }
    }
    return leaves;
  }

  /// How many values of a node are children; the others are tiles.
  template <std::size_t Count>
  std::size_t child_count() {
    const auto children = mask<Count>(), active = mask<Count>();
    skip_values(active);
    return children.count();
  }

  /// @return the flag before them.
  template <std::size_t Count>
  int skip_values(const std::bitset<Count>& active) {
    const int flag = in_.number<std::int8_t>();
    if (flag < no_mask || flag > all_values) throw FormatError();
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
      if (stored != -expected) throw FormatError();
      return in_.skip(expected);
    }
    if (stored > max_chunk) throw FormatError();
    if (!tree_.blosc) return in_.skip(stored);
    if (stored < blosc_header || !blosc_fits(in_.next(blosc_header), stored, expected)) throw FormatError();
    in_.skip(stored - blosc_header);
  }

  ByteCursor in_;
  const StoredTree& tree_;
  const ValueSize size_;
};

}  // namespace

FileBytes::FileBytes(const std::filesystem::path& path) : file_(open_file(path, O_RDONLY)) {
  if (!file_.is_open()) fail(path, "cannot be opened: " + std::generic_category().message(errno) + "; check the path");
  size_ = static_cast<std::int64_t>(std::filesystem::file_size(path));
}

bool FileBytes::read(std::int64_t at, void* bytes, std::size_t count) const {
  return read_whole_at(file_.get(), bytes, count, static_cast<std::uint64_t>(at));
}

std::optional<ValueSize> value_size(const std::string& type) {
  static const std::map<std::string, ValueSize> sizes{{"Tree_float_5_4_3", {4, 2}},
                                                      {"Tree_double_5_4_3", {8, 2}},
                                                      {"Tree_vec3s_5_4_3", {12, 6}},
                                                      {"Tree_vec3d_5_4_3", {24, 6}}};
  const auto found = sizes.find(type);
  return found == sizes.end() ? std::nullopt : std::optional(found->second);
}

bool tree_fits(const FileBytes& file, std::int64_t at, const StoredTree& tree, std::vector<StoredLeaf>& leaves) {
  try {
    leaves = TreeParser(file, at, tree, value_size(tree.type).value()).leaves();
    return true;
  } catch (const FormatError&) {
    return false;
  }
}

bool is_same(const StoredLeaf& leaf, const StoredTree& tree, const char* bytes) {
  if (static_cast<std::int8_t>(bytes[0]) != leaf.flag) return false;
  const std::int64_t before = bytes_before_chunk(leaf.flag, value_size(tree.type).value());
  const std::int64_t chunk = leaf.bytes - before - static_cast<std::int64_t>(sizeof(std::int64_t));
  if ((!tree.blosc && !tree.zip) || chunk < 0) return true;
  const auto stored = read_number<std::int64_t>(bytes + before, ByteOrder::little);
  return stored == chunk || stored == -chunk;
}

}  // namespace tensorray
