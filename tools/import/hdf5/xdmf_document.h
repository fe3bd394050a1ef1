#pragma once
/// The XML of an XDMF file: which grids there are at each step of time, references between elements, and numbers. Only
/// the .cpp file includes libxml2. The format: https://www.xdmf.org/index.php/XDMF_Model_and_Format

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include <vtkSmartPointer.h>

struct _xmlDoc;
struct _xmlNode;
class vtkDataArray;

namespace tensorray {

using XmlElement = _xmlNode;

class XdmfDocument {
 public:
  /// @throw std::runtime_error naming the file: no XML, or no XDMF.
  explicit XdmfDocument(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  int steps() const { return static_cast<int>(steps_.size()); }

  /// The uniform grids at a step, from 0 on. Grids of time that stand beside each other, as FEniCSx writes one for each
  /// function, are parts of the same step.
  const std::vector<XmlElement*>& grids(int step) const { return steps_[static_cast<std::size_t>(step)]; }

  /// The elements in an element with one of the names. Elements that XInclude takes from elsewhere are among them.
  std::vector<XmlElement*> children(XmlElement& element, const std::vector<std::string>& names) const;

  /// The elements that a path of XPath means, which has // once at most. @param from  Where a relative path begins.
  std::vector<XmlElement*> find(const std::string& xpath, XmlElement& from) const;

 private:
  using Steps = std::vector<std::vector<XmlElement*>>;
  void add_steps(XmlElement& grid, Steps& steps, int depth) const;

  std::filesystem::path path_;
  std::shared_ptr<_xmlDoc> document_;
  Steps steps_;
};

/// An attribute's text; the first of the names that is there; empty if none is.
std::string xml_attribute(XmlElement& element, std::initializer_list<const char*> names);

/// What is between an element's tags, without blanks around it.
std::string xml_text(XmlElement& element);

/// The numbers of a DataItem: in the XML itself, in HDF5 files, or in binary files.
struct XdmfValues {
  vtkSmartPointer<vtkDataArray> numbers;  ///< One component.
  std::vector<std::uint64_t> shape;
};

/// Reads a DataItem, also by reference, a part of another one (HyperSlab), or several joined (JOIN).
/// @throw std::runtime_error naming the file, and what is not read or damaged.
XdmfValues xdmf_values(const XdmfDocument& document, XmlElement& item);

/// The integers in a text; empty if there is anything else.
std::vector<std::uint64_t> integers_in(const std::string& text);

}  // namespace tensorray
