#pragma once
/// @file python/module/field.h
/// A tensor field as Python holds it. Its voxels are made when they are first needed, so that an array of the user's is
/// not copied twice.

#include <mutex>
#include <optional>
#include <string>

#include <pybind11/numpy.h>

#include "scenes/keys/json_reader.h"
#include "scenes/scene/scene.h"
#include "volumes/grids/block_source.h"

namespace tensorray {

/// Where voxels come from, and, once light was traced through them, their bricks. Any number of threads may use one.
class Field {
 public:
  /// @param keys    `field` of a scene that has this field. Renders write it into the headers of their files.
  /// @param blocks  The voxels. Filling a block must not touch Python's objects.
  /// @param memory  What the blocks read; kept alive. None: nothing.
  Field(Json keys, BlockSource blocks, pybind11::object memory = pybind11::none())
      : keys_(std::move(keys)), blocks_(std::move(blocks)), memory_(std::move(memory)) {}

  const Json& keys() const { return keys_; }
  TensorGrid grid() const { return to_grid(blocks_); }

  /// The field without voxels that are not finite, smoothed and preprocessed. Made anew if a choice differs from the
  /// last one.
  LoadedField loaded(const FieldChoices& choices) const;

 private:
  Json keys_;
  BlockSource blocks_;
  pybind11::object memory_;
  mutable std::mutex mutex_;
  mutable FieldChoices choices_;
  mutable std::optional<LoadedField> loaded_;
};

}  // namespace tensorray
