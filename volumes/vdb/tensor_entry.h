#pragma once
/// @file volumes/vdb/tensor_entry.h

namespace tensorray {

/// The tensor entry that a component of a grid's value is stored in. Of a vector, `row` is the component.
struct TensorEntry {
  int component, row, column;
};

}  // namespace tensorray
