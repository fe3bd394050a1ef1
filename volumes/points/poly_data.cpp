#include "volumes/points/poly_data.h"

#include <fstream>
#include <stdexcept>
#include <type_traits>

namespace tensorray {
namespace {

const std::string lines_magic = "tensorray poly lines 1\n";

/// Writes sizes and what they are of, or reads them back: `items` of the same code.
class LinesWriter {
 public:
  explicit LinesWriter(const std::filesystem::path& path) : file_(path, std::ios::binary | std::ios::trunc) {}

  /// A vector or a text.
  template <class Items>
  void copy(Items& items) {
    std::uint64_t count = items.size();
    number(count);
    bytes(items.data(), items.size() * sizeof *items.data());
  }

  template <class Item>
  void begin_list(const std::vector<Item>& list) {
    std::uint64_t count = list.size();
    number(count);
  }

  template <class Number>
  void number(Number& number) {
    bytes(&number, sizeof number);
  }

  void close() {
    file_.close();
    if (!file_) throw std::runtime_error("the temporary file cannot be written; the disk may be full");
  }

 private:
  void bytes(const void* data, std::size_t size) {
    file_.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
  }

  std::ofstream file_;
};

class LinesReader {
 public:
  explicit LinesReader(const std::filesystem::path& path)
      : file_(path, std::ios::binary), left_(std::filesystem::file_size(path)) {}

  template <class Items>
  void copy(Items& items) {
    items.resize(count(sizeof *items.data()));
    bytes(items.data(), items.size() * sizeof *items.data());
  }

  template <class Item>
  void begin_list(std::vector<Item>& list) {
    list.resize(count(1));
  }

  template <class Number>
  void number(Number& number) {
    bytes(&number, sizeof number);
  }

 private:
  [[noreturn]] static void fail() { throw std::runtime_error("the temporary file is cut off; the disk may be full"); }

  /// How many elements follow. Each takes at least `size` bytes.
  std::size_t count(std::size_t size) {
    std::uint64_t count = 0;
    number(count);
    if (count > left_ / size) fail();
    return static_cast<std::size_t>(count);
  }

  void bytes(void* data, std::size_t size) {
    if (size > left_ || !file_.read(static_cast<char*>(data), static_cast<std::streamsize>(size))) fail();
    left_ -= size;
  }

  std::ifstream file_;
  std::uintmax_t left_;  ///< Bytes from here to the end of the file.
};

template <class File>
void copy_lines(File& file, std::string& begin, PolyLines& lines) {
  static_assert(sizeof(std::size_t) == sizeof(std::uint64_t), "line ends are 64 bits in the file");
  file.copy(begin);
  file.copy(lines.points.numbers);
  file.copy(lines.line_ends);
  for (auto* const arrays : {&lines.point_data, &lines.line_data}) {
    file.begin_list(*arrays);
    for (auto& [name, values] : *arrays) {
      file.copy(name);
      file.number(values.components);
      file.copy(values.numbers);
    }
  }
}

}  // namespace

DataView view_of(const DataArray& array) {
  DataView view;
  view.components = array.components;
  std::visit(
      [&](const auto& values) {
        using Number = typename std::decay_t<decltype(values)>::value_type;
        view.values = NumberSpan<Number>{values.data(), values.size()};
      },
      array.values);
  return view;
}

void write_poly_lines(const std::filesystem::path& path, PolyLines lines) {
  LinesWriter writer(path);
  std::string begin = lines_magic;
  copy_lines(writer, begin, lines);
  writer.close();
}

PolyLines read_poly_lines(const std::filesystem::path& path) {
  LinesReader reader(path);
  PolyLines lines;
  std::string begin;
  copy_lines(reader, begin, lines);
  if (begin != lines_magic) throw std::runtime_error("the temporary file is of another version of the program");
  return lines;
}

}  // namespace tensorray
