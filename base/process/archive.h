#pragma once
/// Values as bytes, and back: what is kept in files of results, and what ranks give each other. One function copies a
/// value both ways. Numbers have the byte order of the machine: all machines of a render must have the same.

#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace tensorray {

/// Bytes do not have the values that they should have. The caller that knows their file adds its name.
struct DamagedArchive : std::runtime_error {
  explicit DamagedArchive(const std::string& what = "what was kept of the render is damaged; render it again")
      : std::runtime_error(what) {}
};

class Archive {
 public:
  Archive() = default;  ///< Writes.

  /// Reads these bytes, which must outlive it.
  explicit Archive(std::string_view from) : rest_(from), reads_(true) {}

  bool reads() const { return reads_; }
  std::size_t left() const { return rest_.size(); }  ///< Bytes that were not read yet.

  /// Of numbers, or structs of them. @throw DamagedArchive if there are not so many bytes.
  void copy(void* values, std::size_t size) {
    if (!reads_) {
      bytes_.append(static_cast<const char*>(values), size);
      return;
    }
    require(size, 1);
    if (size > 0) std::memcpy(values, rest_.data(), size);  // Pointers of empty vectors may be null.
    rest_.remove_prefix(size);
  }
  template <class Value>
  void copy(Value& value) {
    copy(&value, sizeof value);
  }

  /// The same, compressed: `count` structs of `size` bytes that resemble each other. @throw DamagedArchive.
  void copy_packed(void* values, std::size_t count, std::size_t size);

  /// Of a vector of such, or a string, with its size. There is memory for it only where bytes back it. @throw as above.
  template <class Values>
  void copy_list(Values& values) {
    std::size_t count = values.size();
    copy(count);
    if (reads_) {
      require(count, sizeof values[0]);
      values.resize(count);
    }
    copy(values.data(), count * sizeof values[0]);
  }

  /// Writes numbers; where the archive is read, adds those that were written. @throw as above.
  template <class Number>
  void copy_sums(Number* sums, std::size_t count) {
    if (!reads_) return copy(sums, count * sizeof *sums);
    require(count, sizeof *sums);
    for (std::size_t i = 0; i < count; ++i) {
      Number more;
      copy(more);
      sums[i] += more;
    }
  }

  /// @throw DamagedArchive if so many values of so many bytes are not left.
  void require(std::size_t count, std::size_t size) const {
    if (count > rest_.size() / size) throw DamagedArchive();
  }

  /// @throw DamagedArchive unless all was read.
  void finish() const {
    if (!rest_.empty()) throw DamagedArchive();
  }

  /// What was written.
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
  std::string_view rest_;
  bool reads_ = false;
};

}  // namespace tensorray
