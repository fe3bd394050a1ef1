#include "volumes/points/poly_data.h"

#include <fstream>
#include <stdexcept>
#include <type_traits>

namespace tensorray {
namespace {

const std::string magic = "tensorray poly data 1\n";

class PolyDataWriter {
 public:
  explicit PolyDataWriter(const std::filesystem::path& path) : file_(path, std::ios::binary | std::ios::trunc) {
    file_.write(magic.data(), static_cast<std::streamsize>(magic.size()));
  }

  void number(std::uint64_t number) { bytes(&number, sizeof number); }

  void text(const std::string& text) {
    number(text.size());
    bytes(text.data(), text.size());
  }

  void array(const DataView& array) {
    number(static_cast<std::uint64_t>(array.components));
    number(array.values.index());
    std::visit(
        [&](const auto& span) {
          number(span.size);
          bytes(span.data, span.size * sizeof *span.data);
        },
        array.values);
  }

  void arrays(const Named<DataView>& arrays) {
    number(arrays.size());
    for (const auto& [name, values] : arrays) {
      text(name);
      array(values);
    }
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

class PolyDataReader {
 public:
  explicit PolyDataReader(const std::filesystem::path& path)
      : file_(path, std::ios::binary), left_(std::filesystem::file_size(path)) {
    std::string begin(magic.size(), ' ');
    bytes(&begin[0], begin.size());
    if (begin != magic) throw std::runtime_error("the temporary file is of another version of the program");
  }

  std::uint64_t number() {
    std::uint64_t number = 0;
    bytes(&number, sizeof number);
    return number;
  }

  /// Reads how many elements follow. Each takes at least `size` bytes.
  std::size_t count(std::size_t size) {
    const std::uint64_t count = number();
    if (count > left_ / size) fail();
    return static_cast<std::size_t>(count);
  }

  std::string text() {
    std::string text(count(1), ' ');
    bytes(&text[0], text.size());
    return text;
  }

  DataArray array() {
    DataArray array;
    array.components = static_cast<int>(number());
    switch (number()) {
      case 0:
        array.values = numbers<double>();
        break;
      case 1:
        array.values = numbers<float>();
        break;
      case 2:
        array.values = numbers<std::int32_t>();
        break;
      case 3:
        array.values = numbers<std::uint8_t>();
        break;
      default:
        fail();
    }
    return array;
  }

  Named<DataArray> arrays() {
    Named<DataArray> arrays(count(1));
    for (auto& [name, values] : arrays) {
      name = text();
      values = array();
    }
    return arrays;
  }

  template <class Number>
  std::vector<Number> numbers() {
    std::vector<Number> numbers(count(sizeof(Number)));
    bytes(numbers.data(), numbers.size() * sizeof(Number));
    return numbers;
  }

 private:
  [[noreturn]] static void fail() { throw std::runtime_error("the temporary file is cut off; the disk may be full"); }

  void bytes(void* data, std::size_t size) {
    if (size > left_) fail();
    if (!file_.read(static_cast<char*>(data), static_cast<std::streamsize>(size))) fail();
    left_ -= size;
  }

  std::ifstream file_;
  std::uintmax_t left_;  ///< Bytes from here to the end of the file.
};

Named<DataView> views_of(const Named<DataArray>& arrays) {
  Named<DataView> views;
  for (const auto& [name, values] : arrays) views.emplace_back(name, view_of(values));
  return views;
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

PolyDataView view_of(const PolyData& data) {
  return {view_of(data.points), data.has_lines ? &data.line_ends : nullptr, views_of(data.point_data),
          views_of(data.line_data), data.texts};
}

void write_poly_data(const std::filesystem::path& path, const PolyDataView& data) {
  PolyDataWriter writer(path);
  writer.array(data.points);
  writer.number(data.line_ends ? 1 : 0);
  writer.number(data.line_ends ? data.line_ends->size() : 0);
  if (data.line_ends)
    for (const std::size_t end : *data.line_ends) writer.number(end);
  writer.arrays(data.point_data);
  writer.arrays(data.line_data);
  writer.number(data.texts.size());
  for (const auto& [name, lines] : data.texts) {
    writer.text(name);
    writer.number(lines.size());
    for (const std::string& line : lines) writer.text(line);
  }
  writer.close();
}

PolyData read_poly_data(const std::filesystem::path& path) {
  static_assert(sizeof(std::size_t) == sizeof(std::uint64_t), "line ends are 64 bits in the file");
  PolyDataReader reader(path);
  PolyData data;
  data.points = reader.array();
  data.has_lines = reader.number() != 0;
  data.line_ends = reader.numbers<std::size_t>();
  data.point_data = reader.arrays();
  data.line_data = reader.arrays();
  data.texts.resize(reader.count(1));
  for (auto& [name, lines] : data.texts) {
    name = reader.text();
    lines.resize(reader.count(1));
    for (std::string& line : lines) line = reader.text();
  }
  return data;
}

}  // namespace tensorray
