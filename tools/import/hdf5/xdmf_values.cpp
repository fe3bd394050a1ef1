#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

#include <vtkDataArray.h>

#include "base/errors.h"
#include "base/text/byte_order.h"
#include "base/text/text.h"
#include "tools/import/hdf5/hdf5_file.h"
#include "tools/import/hdf5/xdmf_document.h"

namespace tensorray {
namespace {

using Element = XmlElement;
using Array = vtkSmartPointer<vtkDataArray>;
using Sizes = std::vector<std::uint64_t>;

constexpr int deepest_item = 16;  // Of references to references.

XdmfValues values_of(const XdmfDocument& document, Element& item, int depth);

[[noreturn]] void fail_item(const XdmfDocument& document, const std::string& what) {
  fail(document.path(), "a DataItem " + what);
}

std::uint64_t product(const Sizes& sizes) {
  std::uint64_t result = 1;
  for (const std::uint64_t size : sizes) {
    if (size != 0 && result > (std::uint64_t{1} << 48) / size) return ~std::uint64_t{0};
    result *= size;
  }
  return result;
}

Sizes dimensions_of(Element& item) { return integers_in(xml_attribute(item, {"Dimensions"})); }

bool is_integer(Element& item) {
  const std::string type = lower_case(xml_attribute(item, {"NumberType", "DataType"}));
  return type == "int" || type == "uint" || type == "char" || type == "uchar";
}

Array new_array(bool integers, std::uint64_t count) {
  const auto array = Array::Take(vtkDataArray::CreateDataArray(integers ? VTK_ID_TYPE : VTK_DOUBLE));
  array->SetNumberOfTuples(static_cast<vtkIdType>(count));
  return array;
}

XdmfValues values_of_xml(const XdmfDocument& document, Element& item) {
  std::vector<double> numbers;
  const std::string text = xml_text(item);
  const char* at = text.c_str();
  for (char* end = nullptr;; at = end) {
    const double number = std::strtod(at, &end);
    if (end == at) break;
    numbers.push_back(number);
  }
  while (std::isspace(static_cast<unsigned char>(*at))) ++at;
  if (*at != '\0') fail_item(document, "has text that is no numbers: '" + escaped(std::string(at).substr(0, 20)) + "'");
  XdmfValues values{new_array(is_integer(item), numbers.size()), dimensions_of(item)};
  for (std::size_t i = 0; i < numbers.size(); ++i)
    values.numbers->SetComponent(static_cast<vtkIdType>(i), 0, numbers[i]);
  if (values.shape.empty()) values.shape = {numbers.size()};
  return values;
}

/// The text has a file's name and a dataset's, `FILE:DATASET`, and perhaps `|start|stride|count`.
XdmfValues values_of_hdf(const XdmfDocument& document, Element& item, const HyperSlab* slab) {
  const std::string text = xml_text(item);
  const std::size_t bar = std::min(text.find('|'), text.size()), colon = text.substr(0, bar).rfind(":/");
  if (colon == std::string::npos) fail_item(document, "names no dataset of an HDF5 file: '" + escaped(text) + "'");
  const Hdf5File file(document.path().parent_path() / text.substr(0, colon));
  const std::string dataset = text.substr(colon + 1, bar - colon - 1);
  if (slab) return {file.read(dataset, *slab), slab->count};
  std::istringstream stream(text.substr(bar));
  std::vector<Sizes> part;  // The first one is empty.
  for (std::string numbers; std::getline(stream, numbers, '|');) part.push_back(integers_in(numbers));
  if (part.size() > 3) return {file.read(dataset, {part[1], part[2], part[3]}), part[3]};
  return {file.read(dataset), file.shape(dataset)};
}

template <class Number>
void copy_numbers(const std::vector<char>& bytes, ByteOrder order, vtkDataArray& array) {
  for (vtkIdType i = 0; i < array.GetNumberOfTuples(); ++i)
    array.SetComponent(
        i, 0, static_cast<double>(read_number<Number>(&bytes[static_cast<std::size_t>(i) * sizeof(Number)], order)));
}

XdmfValues values_of_binary(const XdmfDocument& document, Element& item) {
  const std::filesystem::path path = document.path().parent_path() / xml_text(item);
  XdmfValues values{nullptr, dimensions_of(item)};
  const std::string type = lower_case(xml_attribute(item, {"NumberType", "DataType"}));
  const std::string precision = xml_attribute(item, {"Precision"}),
                    endian = lower_case(xml_attribute(item, {"Endian"})),
                    compression = lower_case(xml_attribute(item, {"Compression"}));
  if (!compression.empty() && compression != "raw")
    fail_item(document, "is compressed (" + escaped(compression) + "), which is read only from HDF5");
  const std::size_t size = precision.empty() ? 4 : std::strtoul(precision.c_str(), nullptr, 10);
  const std::uint64_t count = product(values.shape);
  std::error_code none;
  const std::uint64_t offset = std::strtoull(xml_attribute(item, {"Seek"}).c_str(), nullptr, 10),
                      held = std::filesystem::file_size(path, none);
  if (none) fail(path, "is missing; copy it there too");
  if ((size != 4 && size != 8) || (type == "char" || type == "uchar") || type == "uint")
    fail_item(document, "has numbers of a type that is not read from binary files: " + escaped(type) + ", precision " +
                            std::to_string(size));
  if (values.shape.empty() || offset > held || count > (held - offset) / size)
    fail(path, "is cut off: it has fewer numbers than " + document.path().filename().string() + " says");
  std::ifstream file(path, std::ios::binary);
  std::vector<char> bytes(count * size);
  file.seekg(static_cast<std::streamoff>(offset));
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file) fail(path, "cannot be read");
  values.numbers = new_array(type == "int", count);
  const ByteOrder order = endian == "big" ? ByteOrder::big : endian == "little" ? ByteOrder::little : host_byte_order();
  if (type == "int" && size == 4) copy_numbers<std::int32_t>(bytes, order, *values.numbers);
  if (type == "int" && size == 8) copy_numbers<std::int64_t>(bytes, order, *values.numbers);
  if (type != "int" && size == 4) copy_numbers<float>(bytes, order, *values.numbers);
  if (type != "int" && size == 8) copy_numbers<double>(bytes, order, *values.numbers);
  return values;
}

std::vector<Element*> items_in(const XdmfDocument& document, Element& item, std::size_t needed) {
  const std::vector<Element*> items = document.children(item, {"DataItem"});
  if (items.size() < needed) fail_item(document, "lacks DataItems in it");
  return items;
}

XdmfValues part_of(const XdmfDocument& document, const XdmfValues& whole, const HyperSlab& slab) {
  const std::size_t rank = whole.shape.size();
  if (!slab.is_inside(whole.shape)) fail_item(document, "is a HyperSlab beyond what it is of");
  XdmfValues part{Array::Take(whole.numbers->NewInstance()), slab.count};
  part.numbers->SetNumberOfTuples(static_cast<vtkIdType>(product(slab.count)));
  Sizes at(rank, 0);
  for (vtkIdType i = 0; i < part.numbers->GetNumberOfTuples(); ++i) {
    std::uint64_t from = 0;
    for (std::size_t axis = 0; axis < rank; ++axis)
      from = from * whole.shape[axis] + slab.start[axis] + at[axis] * slab.stride[axis];
    part.numbers->SetTuple(i, static_cast<vtkIdType>(from), whole.numbers);
    for (std::size_t axis = rank; axis-- > 0 && ++at[axis] == slab.count[axis];) at[axis] = 0;
  }
  return part;
}

/// The first item has start, stride and count, the second one is what they are of.
XdmfValues values_of_slab(const XdmfDocument& document, Element& item, int depth) {
  const std::vector<Element*> items = items_in(document, item, 2);
  const XdmfValues numbers = values_of(document, *items[0], depth + 1);
  const auto rank = static_cast<std::size_t>(numbers.numbers->GetNumberOfTuples()) / 3;
  HyperSlab slab;
  Sizes* const lists[] = {&slab.start, &slab.stride, &slab.count};
  for (std::size_t i = 0; i < 3 * rank; ++i) {
    const double number = numbers.numbers->GetComponent(static_cast<vtkIdType>(i), 0);
    if (!(number >= (i / rank == 1 ? 1 : 0) && number < 1e15)) fail_item(document, "is a damaged HyperSlab");
    lists[i / rank]->push_back(static_cast<std::uint64_t>(number));
  }
  if (lower_case(xml_attribute(*items[1], {"Format"})) == "hdf" && xml_attribute(*items[1], {"Reference"}).empty())
    return values_of_hdf(document, *items[1], &slab);
  const XdmfValues whole = values_of(document, *items[1], depth + 1);
  if (whole.shape.size() != rank) fail_item(document, "is a HyperSlab of another number of axes");
  return part_of(document, whole, slab);
}

/// JOIN($0, $1, ...), also with semicolons: the items side by side; `0*$0`: zeros, as PyLith fills vectors of plane
/// meshes.
XdmfValues values_of_function(const XdmfDocument& document, Element& item, int depth) {
  std::string function = xml_attribute(item, {"Function"});
  function.erase(std::remove(function.begin(), function.end(), ' '), function.end());
  std::replace(function.begin(), function.end(), ';', ',');
  std::vector<XdmfValues> parts;
  for (Element* const part : items_in(document, item, 1)) parts.push_back(values_of(document, *part, depth + 1));
  const vtkIdType count = parts.front().numbers->GetNumberOfTuples();
  if (function == "0*$0") {
    parts.front().numbers->Fill(0);
    return parts.front();
  }
  std::string wanted = "JOIN(";
  for (std::size_t i = 0; i < parts.size(); ++i) wanted += (i > 0 ? ",$" : "$") + std::to_string(i);
  const bool fits = std::all_of(parts.begin(), parts.end(),
                                [count](const XdmfValues& part) { return part.numbers->GetNumberOfTuples() == count; });
  if (function != wanted + ")" || !fits)
    fail_item(document, "has the function " + escaped(function) + ", which is not read");
  XdmfValues joined{new_array(false, static_cast<std::uint64_t>(count) * parts.size()),
                    {static_cast<std::uint64_t>(count), parts.size()}};
  for (vtkIdType i = 0; i < count; ++i)
    for (std::size_t k = 0; k < parts.size(); ++k)
      joined.numbers->SetComponent(i * static_cast<vtkIdType>(parts.size()) + static_cast<vtkIdType>(k), 0,
                                   parts[k].numbers->GetComponent(i, 0));
  return joined;
}

XdmfValues values_of(const XdmfDocument& document, Element& item, int depth) {
  if (depth > deepest_item) fail_item(document, "refers to itself");
  if (const std::string reference = xml_attribute(item, {"Reference"}); !reference.empty()) {
    const std::string path = lower_case(reference) == "xml" ? xml_text(item) : reference;
    const std::vector<Element*> found = document.find(path, item);
    if (found.empty()) fail_item(document, "refers to what is not there: " + escaped(path));
    return values_of(document, *found.front(), depth + 1);
  }
  const std::string type = lower_case(xml_attribute(item, {"ItemType", "Type"}));
  if (type == "hyperslab") return values_of_slab(document, item, depth);
  if (type == "function") return values_of_function(document, item, depth);
  if (!type.empty() && type != "uniform")
    fail_item(document, "is of the type " + escaped(type) + ", which is not read");
  const std::string format = lower_case(xml_attribute(item, {"Format"}));
  XdmfValues values = format == "hdf"      ? values_of_hdf(document, item, nullptr)
                      : format == "binary" ? values_of_binary(document, item)
                                           : values_of_xml(document, item);
  const Sizes said = dimensions_of(item);
  if (!said.empty() && product(said) != static_cast<std::uint64_t>(values.numbers->GetNumberOfTuples()))
    fail_item(document, "says that it has " + xml_attribute(item, {"Dimensions"}) + " numbers, and has " +
                            std::to_string(values.numbers->GetNumberOfTuples()));
  if (!said.empty()) values.shape = said;
  return values;
}

}  // namespace

std::vector<std::uint64_t> integers_in(const std::string& text) {
  std::istringstream stream(text);
  const Sizes numbers{std::istream_iterator<std::uint64_t>(stream), {}};
  return stream.eof() && text.find('-') == std::string::npos ? numbers : Sizes();
}

XdmfValues xdmf_values(const XdmfDocument& document, Element& item) { return values_of(document, item, 0); }

}  // namespace tensorray
