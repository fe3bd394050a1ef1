#pragma once
/// @file volumes/making/field_file.h
/// A field as a file of pages (page_memory.h), which other processes of this machine map: one copy of its bricks is in
/// memory for all of them. Only for processes of the same program, because the file has its numbers as they are.

#include <optional>
#include <string>

#include "base/files/descriptor.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Writes to the file of a field's bricks what else another process needs. @param words  For the one that reads them.
/// @return false if there is no such file, because memory has no bound, or if the disk has no space for it.
bool complete_field_file(const TensorField& field, const std::string& words);

struct FieldOfFile {
  TensorField field;
  std::string words;
};

/// The field of such a file, with its bricks where they are; nothing if the file is not complete. Memory has a bound.
std::optional<FieldOfFile> field_of_file(Descriptor file);

}  // namespace tensorray
