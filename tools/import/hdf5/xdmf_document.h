#pragma once
/// @file tools/import/hdf5/xdmf_document.h
/// The XML of an XDMF file: which grids there are at each step of time, and references between elements. Private to the
/// importer. The format: https://www.xdmf.org/index.php/XDMF_Model_and_Format

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include <vtkSmartPointer.h>

class vtkXMLDataElement;

namespace tensorray {

class XdmfDocument {
 public:
  /// @throw std::runtime_error naming the file: no XML, or no XDMF.
  explicit XdmfDocument(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  int steps() const { return static_cast<int>(steps_.size()); }

  /// The uniform grids at a step, from 0 on. Grids of time that stand beside each other, as FEniCSx writes one for each
  /// function, are parts of the same step.
  const std::vector<vtkXMLDataElement*>& grids(int step) const { return steps_[static_cast<std::size_t>(step)]; }

  /// The elements in an element with one of the names. Elements that XInclude takes from elsewhere are among them.
  std::vector<vtkXMLDataElement*> children(vtkXMLDataElement& element, const std::vector<std::string>& names) const;

  /// The elements that a path of XPath means, of which the parts are names, *, [number], [@Attribute='value'] and
  /// [self::Name or ...]. @param from  Where a relative path begins.
  std::vector<vtkXMLDataElement*> find(const std::string& xpath, vtkXMLDataElement& from) const;

 private:
  void add_steps(vtkXMLDataElement& grid, std::vector<std::vector<vtkXMLDataElement*>>& steps, int depth) const;

  std::filesystem::path path_;
  vtkSmartPointer<vtkXMLDataElement> root_;
  std::vector<std::vector<vtkXMLDataElement*>> steps_;
};

/// An attribute's text; the first of the names that is there; empty if none is.
std::string xml_attribute(vtkXMLDataElement& element, std::initializer_list<const char*> names);

}  // namespace tensorray
