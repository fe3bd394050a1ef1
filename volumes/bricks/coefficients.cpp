#include "volumes/bricks/coefficients.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstring>
#include <tuple>
#include <type_traits>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "volumes/bricks/cubic_brick.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3i;
using Eigen::Vector3i;

constexpr int edge = CubicBrick::cells;  // Of a block, in voxels.
constexpr int neighbours = 27;

/// The offset of neighbour n, −1 to 1 along each axis; that of 13 is zero.
Vector3i neighbour(int n) { return {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1}; }

int reach_of(Border border) { return border == Border::fade ? 1 : 2; }

Vector3i place_of(const Vector3i& voxel) {
  return voxel.unaryExpr([](int v) { return v >> 3; });
}

bool is_set(const VoxelMask& mask, int x, int y, int z) {
  return mask[static_cast<std::size_t>(x * edge + y)] >> z & 1;
}

bool any_of(const VoxelMask& mask) {
  return std::any_of(mask.begin(), mask.end(), [](std::uint8_t row) { return row != 0; });
}

VoxelMask mask_of(const BlockShape& shape) {
  VoxelMask mask{};
  for (std::size_t row = 0; row < mask.size(); ++row)
    for (std::size_t z = 0; z < edge; ++z)
      mask[row] = static_cast<std::uint8_t>(mask[row] | (shape.active[row * edge + z] ? 1u << z : 0u));
  return mask;
}

void sort_places(std::vector<Vector3i>& places) {
  tbb::parallel_sort(places.begin(), places.end(), [](const Vector3i& a, const Vector3i& b) {
    return std::make_tuple(a.x(), a.y(), a.z()) < std::make_tuple(b.x(), b.y(), b.z());
  });
  places.erase(std::unique(places.begin(), places.end()), places.end());
}

/// The places of the blocks, and all about them.
std::vector<Vector3i> places_about(const BlockTable& table) {
  std::vector<Vector3i> places = table.places;
  for (const Vector3i& place : table.places)
    for (int n = 0; n < neighbours; ++n)
      if (const Vector3i at = place + neighbour(n); table.index.find(at) == BrickIndex::missing) places.push_back(at);
  sort_places(places);
  return places;
}

/// Active voxels of a block and, on each side, of `margin` more: a row along z is a number whose bit z + margin is
/// voxel z.
struct WideMask {
  static constexpr int margin = 2, width = edge + 2 * margin;

  std::uint16_t rows[width][width] = {};

  void add(const VoxelMask& mask, const Vector3i& offset) {
    const auto first = [](int o) { return std::max(0, margin + edge * o); };
    const auto end = [](int o) { return std::min(width, margin + edge * (o + 1)); };
    for (int x = first(offset.x()); x < end(offset.x()); ++x)
      for (int y = first(offset.y()); y < end(offset.y()); ++y) {
        const int from_x = x - margin - edge * offset.x(), from_y = y - margin - edge * offset.y();
        const unsigned row = mask[static_cast<std::size_t>(from_x * edge + from_y)];
        const int shift = margin + edge * offset.z();
        const unsigned bits = shift < 0 ? row >> -shift : row << shift;
        rows[x][y] = static_cast<std::uint16_t>(rows[x][y] | (bits & ((1u << width) - 1)));
      }
  }

  /// The block's voxels with an active voxel within `reach` along each axis.
  VoxelMask spread(int reach) const {
    VoxelMask mask{};
    for (int x = 0; x < edge; ++x)
      for (int y = 0; y < edge; ++y) {
        unsigned any = 0;
        for (int i = -reach; i <= reach; ++i)
          for (int j = -reach; j <= reach; ++j) any |= rows[x + margin + i][y + margin + j];
        unsigned spread = any;
        for (int k = 1; k <= reach; ++k) spread |= any << k | any >> k;
        mask[static_cast<std::size_t>(x * edge + y)] = static_cast<std::uint8_t>(spread >> margin);
      }
    return mask;
  }
};

/// Removes voxels outside the extent.
void cut(VoxelMask& mask, const Vector3i& place, const AlignedBox3i& extent) {
  const Vector3i low = (extent.min() - edge * place).cwiseMax(0),
                 high = (extent.max() - edge * place).cwiseMin(edge - 1);
  unsigned along_z = 0;
  for (int z = low.z(); z <= high.z(); ++z) along_z |= 1u << z;
  for (int x = 0; x < edge; ++x)
    for (int y = 0; y < edge; ++y) {
      const bool inside = x >= low.x() && x <= high.x() && y >= low.y() && y <= high.y();
      std::uint8_t& row = mask[static_cast<std::size_t>(x * edge + y)];
      row = inside ? static_cast<std::uint8_t>(row & along_z) : std::uint8_t{0};
    }
}

/// Whether a brick whose block is `offset` from another one's needs coefficients of that one.
bool reaches(const VoxelMask& mask, const Vector3i& offset) {
  // A brick needs the last voxel of the block before it, and the first two of the block behind it.
  const auto first = [](int o) { return o > 0 ? edge - 1 : 0; };
  const auto end = [](int o) { return o < 0 ? 2 : edge; };
  unsigned along_z = 0;
  for (int z = first(offset.z()); z < end(offset.z()); ++z) along_z |= 1u << z;
  for (int x = first(offset.x()); x < end(offset.x()); ++x)
    for (int y = first(offset.y()); y < end(offset.y()); ++y)
      if ((mask[static_cast<std::size_t>(x * edge + y)] & along_z) != 0) return true;
  return false;
}

}  // namespace

CoefficientBricks coefficient_bricks(const BlockTable& table, const AlignedBox3i& extent, Border border) {
  const std::vector<Vector3i> candidates = places_about(table);
  const BrickIndex found(candidates);
  std::vector<VoxelMask> active(candidates.size()), filled(candidates.size());
  tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t i) {
    const std::uint32_t block = table.index.find(candidates[i]);
    if (block != BrickIndex::missing) active[i] = mask_of(table.shapes[block]);
  });
  tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t i) {
    WideMask wide;
    for (int n = 0; n < neighbours; ++n)
      if (const std::uint32_t at = found.find(candidates[i] + neighbour(n)); at != BrickIndex::missing)
        wide.add(active[at], neighbour(n));
    filled[i] = wide.spread(reach_of(border));
    cut(filled[i], candidates[i], extent);
  });

  const AlignedBox3i with_cells = bricks_of(extent);
  CoefficientBricks result;
  std::vector<Vector3i> others;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!any_of(filled[i])) continue;
    (with_cells.contains(candidates[i]) ? result.places : others).push_back(candidates[i]);
    for (int n = 0; n < neighbours; ++n) {
      const Vector3i offset = neighbour(n), at = candidates[i] + offset;
      const std::uint32_t other = found.find(at);
      if (other != BrickIndex::missing && any_of(filled[other])) continue;
      if (with_cells.contains(at) && reaches(filled[i], offset)) result.places.push_back(at);
    }
  }
  sort_places(result.places);
  result.count = result.places.size();
  result.places.insert(result.places.end(), others.begin(), others.end());
  result.index = BrickIndex(result.places);
  for (const Vector3i& place : result.places) {
    const std::uint32_t at = found.find(place);
    result.filled.push_back(at == BrickIndex::missing ? VoxelMask{} : filled[at]);
    result.active.push_back(at == BrickIndex::missing ? VoxelMask{} : active[at]);
  }
  return result;
}

namespace {

/// What is stored of a coefficient, with T₂₂ last.
using Stored = Eigen::Array<float, 9, 1>;

Stored read(const CoefficientMemory& memory, std::size_t brick, int number) {
  Stored value = Stored::Zero();
  const float* const floats = memory.brick(brick);
  std::copy_n(floats + CubicBrick::bending_offset(memory.components, number), memory.components, value.data());
  value[8] = floats[CubicBrick::trailing_offset(memory.components) + number];
  return value;
}

void write(const Stored& value, const CoefficientMemory& memory, std::size_t brick, int number) {
  float* const floats = memory.brick(brick);
  std::copy_n(value.data(), memory.components, floats + CubicBrick::bending_offset(memory.components, number));
  floats[CubicBrick::trailing_offset(memory.components) + number] = value[8];
}

/// A voxel in the brick at its place.
struct Voxel {
  std::size_t brick;
  int x, y, z;

  int number() const { return CubicBrick::coefficient(x, y, z); }
};

/// The voxels whose masks are set, by their index; nothing where they are not.
struct VoxelReader {
  const CoefficientBricks& bricks;
  const std::vector<VoxelMask>& masks;

  std::optional<Voxel> find(const Vector3i& index) const {
    const std::uint32_t brick = bricks.index.find(place_of(index));
    if (brick == BrickIndex::missing) return std::nullopt;
    const Voxel voxel{brick, index.x() & 7, index.y() & 7, index.z() & 7};
    if (!is_set(masks[brick], voxel.x, voxel.y, voxel.z)) return std::nullopt;
    return voxel;
  }
};

/// A voxel that is to be continued.
struct Continued {
  Voxel voxel;
  bool is_known = false;
  Stored value;
};

/// (3 − √3) / 6: where all voxels of a half space have the value 1, this is that of the spline, whose coefficients
/// beyond are zero, at the first voxel beyond. It falls to zero from there without a change of sign, and hardly rings
/// within.
constexpr float faded = 0.21132487f;

/// The continuation to the voxel at `index`, if one leads there.
void continue_to(const Vector3i& index, const VoxelReader& known, Border border, const CoefficientMemory& memory,
                 Continued& to) {
  const int longest = border == Border::extend ? 2 : 1;
  int most = 0, count = 0;
  Stored sum = Stored::Zero();
  for (int direction = 0; direction < 6; ++direction) {
    Vector3i along = Vector3i::Zero();
    along[direction / 2] = direction % 2 ? 1 : -1;
    Stored values[2];
    int length = 0;
    for (; length < longest; ++length) {
      const auto voxel = known.find(index + (length + 1) * along);
      if (!voxel) break;
      values[length] = read(memory, voxel->brick, voxel->number());
    }
    if (length == 0 || length < most) continue;
    if (length > most) {
      most = length;
      count = 0;
      sum.setZero();
    }
    sum += length == 2 ? Stored(2 * values[0] - values[1]) : values[0];
    ++count;
  }
  to.is_known = count > 0;
  if (count > 0) to.value = sum * ((border == Border::fade ? faded : 1.0f) / static_cast<float>(count));
}

}  // namespace

void continue_values(const CoefficientBricks& bricks, Border border, const CoefficientMemory& memory) {
  std::vector<VoxelMask> known = bricks.active;
  std::vector<Continued> rest;
  for (std::size_t i = 0; i < bricks.places.size(); ++i)
    for (int x = 0; x < edge; ++x)
      for (int y = 0; y < edge; ++y)
        for (int z = 0; z < edge; ++z)
          if (is_set(bricks.filled[i], x, y, z) && !is_set(known[i], x, y, z))
            rest.push_back({{i, x, y, z}, false, Stored::Zero()});
  // Each sweep leads one voxel further; those beside edges and corners are reached along one axis after the other.
  while (!rest.empty()) {
    const VoxelReader reader{bricks, known};
    tbb::parallel_for(std::size_t{0}, rest.size(), [&](std::size_t i) {
      const Voxel& voxel = rest[i].voxel;
      const Vector3i index = edge * bricks.places[voxel.brick] + Vector3i(voxel.x, voxel.y, voxel.z);
      continue_to(index, reader, border, memory, rest[i]);
    });
    const auto end = std::partition(rest.begin(), rest.end(), [](const Continued& c) { return !c.is_known; });
    if (end == rest.end()) return;
    for (auto done = end; done != rest.end(); ++done) {
      const Voxel& voxel = done->voxel;
      write(done->value, memory, voxel.brick, voxel.number());
      std::uint8_t& row = known[voxel.brick][static_cast<std::size_t>(voxel.x * edge + voxel.y)];
      row = static_cast<std::uint8_t>(row | 1u << voxel.z);
    }
    rest.erase(end, rest.end());
  }
}

namespace {

/// 1 / (4 − 1 / (4 − …)): the elimination of (1, 4, 1).
struct Elimination {
  static constexpr int count = 16;  // The further ones are the same in single precision.

  float factors[count];

  Elimination() {
    double factor = 0;
    for (float& rounded : factors) rounded = static_cast<float>(factor = 1 / (4 - factor));
  }
  float operator[](int i) const { return factors[std::min(i, count - 1)]; }
};

/// Solves (c[i−1] + 4 c[i] + c[i+1]) / 6 = f[i] for a run of `width` numbers each, in place. @param continues_before,
/// continues_after  Whether coefficients beyond an end continue as a cubic polynomial, or, of fewer than three, as a
/// line; otherwise they are zero. With c, δ⁴c = 0 about the second voxel, so that δ²c = δ²f and c = f − δ²f / 6 there.
template <int width>
void solve_run(float* const* run, int count, bool continues_before, bool continues_after) {
  static const Elimination elimination;
  using Numbers = Eigen::Array<float, width, 1>;
  const auto at = [&](int i) { return Eigen::Map<Numbers>(run[i]); };
  const auto second_difference = [&](int i) { return Numbers(at(i - 1) - 2 * at(i) + at(i + 1)); };
  if (continues_before && continues_after && count == 3) {
    const Numbers sixth = second_difference(1) / 6;
    for (int i = 0; i < count; ++i) at(i) -= sixth;
    return;
  }
  const bool cubic_before = continues_before && count >= 3, cubic_after = continues_after && count >= 3;
  const int first = cubic_before ? 1 : continues_before ? 0 : -1;  // The last one that is known before the others.
  const int last = cubic_after ? count - 2 : continues_after ? count - 1 : count;
  Numbers second, second_last;
  if (cubic_before) second = at(1);
  if (cubic_after) second_last = at(count - 2);
  const Numbers known = cubic_before ? Numbers(second - second_difference(1) / 6) : Numbers(Numbers::Zero());
  if (cubic_after) at(count - 2) -= second_difference(count - 2) / 6;
  if (cubic_before) at(1) = known;
  for (int i = first + 1; i < last; ++i) {
    const float factor = elimination[i - first - 1];
    if (i == 0)
      at(i) *= 6 * factor;
    else
      at(i) = (6 * at(i) - at(i - 1)) * factor;
  }
  for (int i = last - 1; i > first; --i)
    if (i + 1 < count) at(i) -= elimination[i - first - 1] * at(i + 1);
  if (cubic_before) at(0) = 6 * second - 4 * at(1) - at(2);
  if (cubic_after) at(count - 1) = 6 * second_last - 4 * at(count - 2) - at(count - 3);
}

/// A column of bricks along an axis, without gaps.
struct Column {
  std::size_t first;
  std::vector<std::uint32_t> bricks;
};

/// The voxels of a column on a line along its axis: `set(i)` says whether voxel i has a coefficient.
struct Runs {
  int axis, begin, count;  // Index of the first voxel along the axis, and number of voxels.
  const AlignedBox3i& extent;
  Border border;

  /// Calls solve(from, length, continues_before, continues_after) for each run.
  template <class Set, class Solve>
  void visit(const Set& set, const Solve& solve) const {
    for (int from = 0; from < count;) {
      if (!set(from)) {
        ++from;
        continue;
      }
      int end = from + 1;
      while (end < count && set(end)) ++end;
      const bool extends = border == Border::extend;
      solve(from, end - from, extends || begin + from == extent.min()[axis],
            extends || begin + end - 1 == extent.max()[axis]);
      from = end;
    }
  }
};

/// Solves the runs of a line of voxels or of rows of eight voxels along z. `number(i)` is the number, in brick
/// i / 8, of what is at place i of the line.
template <int components, int voxels, class Set, class Number>
void solve_line(const Column& column, const Runs& runs, const CoefficientMemory& memory, const Set& set,
                const Number& number, std::vector<float*>& pointers) {
  runs.visit(set, [&](int from, int length, bool continues_before, bool continues_after) {
    pointers.resize(2 * static_cast<std::size_t>(length));
    float** const bending = pointers.data();
    float** const trailing = bending + length;
    for (int i = 0; i < length; ++i) {
      float* const brick = memory.brick(column.bricks[static_cast<std::size_t>((from + i) / edge)]);
      const int at = number((from + i) % edge);
      bending[i] = brick + CubicBrick::bending_offset(components, at);
      trailing[i] = brick + CubicBrick::trailing_offset(components) + at;
    }
    solve_run<voxels * components>(bending, length, continues_before, continues_after);
    solve_run<voxels>(trailing, length, continues_before, continues_after);
  });
}

/// Solves the lines of a column along x or y: eight neighbours along z together where they have the same runs.
template <int components>
void solve_across(const CoefficientBricks& bricks, const Column& column, const Runs& runs,
                  const CoefficientMemory& memory) {
  std::vector<float*> pointers;
  const bool along_x = runs.axis == 0;
  for (int across = 0; across < edge; ++across) {
    const auto row = [&](int i) {
      const int within = i % edge;
      return bricks.filled[column.bricks[static_cast<std::size_t>(i / edge)]]
                          [static_cast<std::size_t>(along_x ? within * edge + across : across * edge + within)];
    };
    const auto number = [&](int i, int z) {
      return along_x ? CubicBrick::coefficient(i, across, z) : CubicBrick::coefficient(across, i, z);
    };
    bool same = true;
    for (int i = 0; i < runs.count && same; ++i) same = row(i) == 0 || row(i) == 0xff;
    if (same)
      solve_line<components, edge>(
          column, runs, memory, [&](int i) { return row(i) != 0; }, [&](int i) { return number(i, 0); }, pointers);
    else
      for (int z = 0; z < edge; ++z)
        solve_line<components, 1>(
            column, runs, memory, [&](int i) { return (row(i) >> z & 1) != 0; }, [&](int i) { return number(i, z); },
            pointers);
  }
}

/// Copies the lines of a sheet of voxels, at x, to a buffer in which those of one z follow each other, or back.
template <int components, bool back>
void copy_sheet(const Column& column, int x, const CoefficientMemory& memory, float* buffer) {
  constexpr int floats = components + 1;
  const auto copy = [](float* voxel, float* place, std::size_t count) {
    back ? std::memcpy(voxel, place, count * sizeof(float)) : std::memcpy(place, voxel, count * sizeof(float));
  };
  for (const std::uint32_t number : column.bricks) {
    float* const brick = memory.brick(number);
    for (int y = 0; y < edge; ++y) {
      const int first = CubicBrick::coefficient(x, y, 0);
      for (int z = 0; z < edge; ++z) {
        float* const place = buffer + (z * edge + y) * floats;
        copy(brick + CubicBrick::bending_offset(components, first + z), place, components);
        copy(brick + CubicBrick::trailing_offset(components) + first + z, place + components, 1);
      }
    }
    buffer += edge * edge * floats;
  }
}

/// Solves the lines of a column along z: eight neighbours along y together where they have the same runs.
template <int components>
void solve_along_z(const CoefficientBricks& bricks, const Column& column, const Runs& runs,
                   const CoefficientMemory& memory) {
  constexpr int floats = components + 1, all = edge * floats;
  std::vector<float> buffer(static_cast<std::size_t>(runs.count * all));
  std::vector<float*> pointers(static_cast<std::size_t>(runs.count));
  const auto row = [&](int i, int x, int y) {
    return bricks.filled[column.bricks[static_cast<std::size_t>(i)]][static_cast<std::size_t>(x * edge + y)];
  };
  for (int x = 0; x < edge; ++x) {
    copy_sheet<components, false>(column, x, memory, buffer.data());
    const auto solve = [&](auto width, int y, const auto& set) {
      for (int i = 0; i < runs.count; ++i) pointers[static_cast<std::size_t>(i)] = buffer.data() + i * all + y * floats;
      runs.visit(set, [&](int from, int length, bool continues_before, bool continues_after) {
        solve_run<width.value>(pointers.data() + from, length, continues_before, continues_after);
      });
    };
    bool same = true;
    for (int i = 0; i < runs.count / edge && same; ++i)
      for (int y = 1; y < edge && same; ++y) same = row(i, x, y) == row(i, x, 0);
    const auto set_at = [&](int y) { return [&, y](int i) { return (row(i / edge, x, y) >> i % edge & 1) != 0; }; };
    if (same)
      solve(std::integral_constant<int, all>(), 0, set_at(0));
    else
      for (int y = 0; y < edge; ++y) solve(std::integral_constant<int, floats>(), y, set_at(y));
    copy_sheet<components, true>(column, x, memory, buffer.data());
  }
}

/// The bricks of the column that begins with a brick; none if another brick is before it.
Column column_of(const CoefficientBricks& bricks, std::size_t first, int axis) {
  Column column{first, {}};
  const Vector3i along = Vector3i::Unit(axis);
  Vector3i place = bricks.places[first];
  if (bricks.index.find(place - along) != BrickIndex::missing) return column;
  for (std::uint32_t brick; (brick = bricks.index.find(place)) != BrickIndex::missing; place += along)
    column.bricks.push_back(brick);
  return column;
}

template <int components>
void make_coefficients_of(const CoefficientBricks& bricks, const AlignedBox3i& extent, Border border,
                          const CoefficientMemory& memory) {
  for (int axis = 0; axis < 3; ++axis)
    tbb::parallel_for(std::size_t{0}, bricks.places.size(), [&](std::size_t i) {
      const Column column = column_of(bricks, i, axis);
      if (column.bricks.empty()) return;
      make_room();
      const Runs runs{axis, edge * bricks.places[i][axis], edge * static_cast<int>(column.bricks.size()), extent,
                      border};
      if (axis == 2)
        solve_along_z<components>(bricks, column, runs, memory);
      else
        solve_across<components>(bricks, column, runs, memory);
    });
}

}  // namespace

void make_coefficients(const CoefficientBricks& bricks, const AlignedBox3i& extent, Border border,
                       const CoefficientMemory& memory) {
  if (memory.components == TensorBrick::symmetric)
    make_coefficients_of<TensorBrick::symmetric>(bricks, extent, border, memory);
  else
    make_coefficients_of<TensorBrick::general>(bricks, extent, border, memory);
}

namespace {

/// The coefficients of voxels within the extent, and their extrapolation.
struct Extrapolation {
  VoxelReader reader;
  const AlignedBox3i& extent;
  const CoefficientMemory& memory;

  /// The coefficient at any index.
  Stored at(const Vector3i& index) const {
    for (int axis = 0; axis < 3; ++axis) {
      const int low = extent.min()[axis], high = extent.max()[axis];
      if (index[axis] >= low && index[axis] <= high) continue;
      return beyond(index, axis, index[axis] < low ? low : high, index[axis] < low ? 1 : -1);
    }
    const auto voxel = reader.find(index);
    return voxel ? read(memory, voxel->brick, voxel->number()) : Stored(Stored::Zero());
  }

  /// One voxel beyond a face of the extent: the polynomial that `solve_run` takes coefficients for.
  Stored beyond(Vector3i index, int axis, int face, int inward) const {
    constexpr float weights[5][4] = {{}, {1}, {2, -1}, {3, -3, 1}, {4, -6, 4, -1}};
    const int size = extent.max()[axis] - extent.min()[axis] + 1;
    int run = 0;
    for (Vector3i along = index.cwiseMax(extent.min()).cwiseMin(extent.max()); run < 3; ++run) {
      along[axis] = face + run * inward;
      if (!reader.find(along)) break;
    }
    const int terms = size == 1 ? 1 : run < 3 ? 2 : std::min(size, 4);
    Stored sum = Stored::Zero();
    for (int i = 0; i < terms; ++i) {
      index[axis] = face + i * inward;
      sum += weights[terms][i] * at(index);
    }
    return sum;
  }
};

/// Calls visit(neighbour, first, end) for the parts of a brick's apron: the block that it belongs to, and the range of
/// its voxels in the brick.
template <class Visit>
void for_apron(const Visit& visit) {
  const auto first = [](int o) { return edge * o - (o < 0 ? CubicBrick::before - edge : 0); };
  const auto size = [](int o) { return o < 0 ? CubicBrick::before : o == 0 ? edge : CubicBrick::width - edge - 1; };
  for (int n = 0; n < neighbours; ++n) {
    const Vector3i offset = neighbour(n);
    if (offset.isZero()) continue;
    const Vector3i from(first(offset.x()), first(offset.y()), first(offset.z()));
    visit(offset, from, from + Vector3i(size(offset.x()), size(offset.y()), size(offset.z())));
  }
}

/// Copies the part of an apron, `length` voxels along z, from the block that it belongs to.
template <int components, int length>
void copy_part_of(const float* block, const Vector3i& offset, const Vector3i& first, const Vector3i& end,
                  float* brick) {
  constexpr int trailing = CubicBrick::trailing_offset(components);
  const int shift = CubicBrick::coefficient(edge * offset.x(), edge * offset.y(), edge * offset.z()) -
                    CubicBrick::coefficient(0, 0, 0);
  for (int x = first.x(); x < end.x(); ++x)
    for (int y = first.y(); y < end.y(); ++y) {
      const int to = CubicBrick::coefficient(x, y, first.z()), from = to - shift;
      std::memcpy(brick + CubicBrick::bending_offset(components, to),
                  block + CubicBrick::bending_offset(components, from), length * components * sizeof(float));
      std::memcpy(brick + trailing + to, block + trailing + from, length * sizeof(float));
    }
}

template <int components>
void copy_part(const float* block, const Vector3i& offset, const Vector3i& first, const Vector3i& end, float* brick) {
  if (offset.z() < 0)
    copy_part_of<components, CubicBrick::before>(block, offset, first, end, brick);
  else if (offset.z() > 0)
    copy_part_of<components, CubicBrick::width - edge - 1>(block, offset, first, end, brick);
  else
    copy_part_of<components, edge>(block, offset, first, end, brick);
}

/// Extrapolates the coefficients of a brick that are outside the extent.
void extrapolate(const Extrapolation& field, const Vector3i& place, std::size_t brick) {
  const Vector3i origin = edge * place;
  const auto is_beyond = [&](int axis, int i) {
    return origin[axis] + i == field.extent.min()[axis] - 1 || origin[axis] + i == field.extent.max()[axis] + 1;
  };
  const auto is_far = [&](int axis, int i) {
    return origin[axis] + i < field.extent.min()[axis] - 1 || origin[axis] + i > field.extent.max()[axis] + 1;
  };
  for (int x = -1; x < CubicBrick::width - 1; ++x)
    for (int y = -1; y < CubicBrick::width - 1; ++y)
      for (int z = -1; z < CubicBrick::width - 1; ++z) {
        if (is_far(0, x) || is_far(1, y) || is_far(2, z)) continue;  // No cell of the extent needs it.
        if (is_beyond(0, x) || is_beyond(1, y) || is_beyond(2, z))
          write(field.at(origin + Vector3i(x, y, z)), field.memory, brick, CubicBrick::coefficient(x, y, z));
      }
}

}  // namespace

namespace {

/// TensorBrick::strongest: a B-spline is a mean of its coefficients, so that none of its deviators is greater than
/// theirs.
template <int components>
float strongest_of(const float* brick) {
  const auto greatest = [&](auto number) {
    using Number = decltype(number);
    for (int i = 0; i < CubicBrick::coefficients; ++i) {
      const float* const T = brick + CubicBrick::bending_offset(components, i);
      const auto component = [&](int k) { return Number(T[TensorBrick::stored_component(components, k)]); };
      Number squares = 0;
      for (int k = 0; k < 8; ++k) squares += component(k) * component(k);
      const Number trace = component(0) + component(4);
      number = std::max(number, squares - trace * trace / 3);
    }
    return number;
  };
  constexpr float least = 1e-25f, most = 1e30f;  // Outside this range squares may underflow or overflow.
  const float single = greatest(0.0f);
  // Single precision errs by less than 2e-6 here, because the trace takes at most two thirds of the squares away.
  const double squared = single > least && single < most ? double{single} : greatest(0.0);
  return static_cast<float>(std::sqrt(squared) * (1 + 1.2e-5));  // Interpolation may round to slightly more.
}

template <int components>
void finish_bricks_of(const CoefficientBricks& bricks, const AlignedBox3i& extent, const CoefficientMemory& memory,
                      std::vector<float>& strongest) {
  const Extrapolation field{{bricks, bricks.filled}, extent, memory};
  tbb::parallel_for(std::size_t{0}, bricks.count, [&](std::size_t i) {
    make_room();
    const Vector3i& place = bricks.places[i];
    for_apron([&](const Vector3i& offset, const Vector3i& first, const Vector3i& end) {
      const std::uint32_t block = bricks.index.find(place + offset);
      if (block != BrickIndex::missing) copy_part<components>(memory.brick(block), offset, first, end, memory.brick(i));
    });
    const AlignedBox3i covered(edge * place - Vector3i::Ones(), edge * place + Vector3i::Constant(edge + 1));
    if (!extent.contains(covered)) extrapolate(field, place, i);
    strongest[i] = strongest_of<components>(memory.brick(i));
  });
}

}  // namespace

std::vector<float> finish_bricks(const CoefficientBricks& bricks, const AlignedBox3i& extent,
                                 const CoefficientMemory& memory) {
  std::vector<float> strongest(bricks.count);
  if (memory.components == TensorBrick::symmetric)
    finish_bricks_of<TensorBrick::symmetric>(bricks, extent, memory, strongest);
  else
    finish_bricks_of<TensorBrick::general>(bricks, extent, memory, strongest);
  return strongest;
}

void widen_coefficients(const float* symmetric, float* general) {
  constexpr int few = TensorBrick::symmetric, all = TensorBrick::general;
  for (int i = 0; i < CubicBrick::coefficients; ++i)
    for (int k = 0; k < all; ++k)
      general[CubicBrick::bending_offset(all, i) + k] =
          symmetric[CubicBrick::bending_offset(few, i) + TensorBrick::stored_component(few, k)];
  std::copy_n(symmetric + CubicBrick::trailing_offset(few), CubicBrick::coefficients,
              general + CubicBrick::trailing_offset(all));
}

}  // namespace tensorray
