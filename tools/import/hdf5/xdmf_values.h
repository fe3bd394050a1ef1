#pragma once
/// @file tools/import/hdf5/xdmf_values.h
/// The numbers of the DataItems of an XDMF file: in the XML itself, in HDF5 files, or in binary files.

#include <cstdint>
#include <string>
#include <vector>

#include <vtkSmartPointer.h>

#include "tools/import/hdf5/xdmf_document.h"

class vtkDataArray;

namespace tensorray {

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
