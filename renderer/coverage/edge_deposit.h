#pragma once
/// @file renderer/coverage/edge_deposit.h
/// Many edges of an AreaDeposit at once. A part of area_deposit.cpp.

#include <cstddef>
#include <cstdint>

namespace tensorray {

/// Sums of four planes, pixel by pixel: those of pixel x of row y, counted from the first row that is kept, are at
/// [4 (y · stride + x)].
struct DepositPlanes {
  static constexpr std::size_t count = 4;
  std::uint64_t* sums = nullptr;
  std::size_t stride = 0;          ///< Pixels from row to row; at least three more than the width.
  int width = 0;                   ///< Of the plate, pixels.
  int first_row = 0, end_row = 0;  ///< Other rows are not kept.
};

/// Added to a number of at most 2^51, 1.5 · 2^52 leaves the nearest integer in the last bits of the sum.
constexpr double integer_bits = 6755399441055744.0;

/// Edges between polygons, all of them between the left and the right border of the plate.
struct EdgeBatch {
  static constexpr std::size_t capacity = 256;

  std::size_t count = 0;
  alignas(64) double from_x[capacity], from_y[capacity], to_x[capacity], to_y[capacity];  // Pixels.
  alignas(64) double density[capacity];
};

/// Adds the edges, with the part `plane_weights` of them to each plane. An edge has the same sums, bit for bit, in any
/// batch, whatever rows are kept.
void deposit_edges(const EdgeBatch& batch, const double* plane_weights, const DepositPlanes& planes);

}  // namespace tensorray
