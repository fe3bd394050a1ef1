#include "volumes/bricks/brick_index.h"

namespace tensorray {
namespace {

constexpr double max_table = 32;  // Table entries per brick, at most; an entry takes eight bytes.

}  // namespace

BrickIndex::BrickIndex(const std::vector<Eigen::Vector3i>& bricks) {
  if (bricks.empty()) return;
  Eigen::AlignedBox3i box;
  for (const Eigen::Vector3i& brick : bricks) box.extend(brick);
  const Eigen::Vector3d size = box.max().cast<double>() - box.min().cast<double>() + Eigen::Vector3d::Ones();
  if (size.prod() <= max_table * static_cast<double>(bricks.size()))
    make_table(bricks, box);
  else
    make_slots(bricks);
}

void BrickIndex::make_table(const std::vector<Eigen::Vector3i>& bricks, const Eigen::AlignedBox3i& box) {
  std::size_t entries = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    first_[axis] = static_cast<std::uint32_t>(box.min()[i]);
    size_[axis] = static_cast<std::uint32_t>(box.max()[i]) - first_[axis] + 1;
    entries *= size_[axis];
  }
  table_.assign(entries, Entry());
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    const Eigen::Vector3i at = bricks[i] - box.min();
    table_[(static_cast<std::size_t>(at.x()) * size_[1] + static_cast<std::size_t>(at.y())) * size_[2] +
           static_cast<std::size_t>(at.z())]
        .number = static_cast<std::uint32_t>(i);
  }
}

void BrickIndex::make_slots(const std::vector<Eigen::Vector3i>& bricks) {
  std::size_t size = 16;
  while (size < 2 * bricks.size()) size *= 2;
  slots_.assign(size, Slot{Eigen::Vector3i::Zero(), Entry()});
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    std::size_t slot = home_slot(bricks[i]);
    while (slots_[slot].entry.number != missing) slot = (slot + 1) & (size - 1);
    slots_[slot] = {bricks[i], {static_cast<std::uint32_t>(i), 0}};
  }
}

std::size_t BrickIndex::home_slot(const Eigen::Vector3i& brick) const {
  const auto part = [](int value, std::uint64_t factor) { return static_cast<std::uint32_t>(value) * factor; };
  std::uint64_t hash = part(brick.x(), 0x9e3779b97f4a7c15u) ^ part(brick.y(), 0xc2b2ae3d27d4eb4fu) ^
                       part(brick.z(), 0x165667b19e3779f9u);
  hash ^= hash >> 32;
  return static_cast<std::size_t>(hash) & (slots_.size() - 1);
}

BrickIndex::Entry BrickIndex::find_slot(const Eigen::Vector3i& brick) const {
  for (std::size_t slot = home_slot(brick);; slot = (slot + 1) & (slots_.size() - 1))
    if (slots_[slot].entry.number == missing || slots_[slot].brick == brick) return slots_[slot].entry;
}

void BrickIndex::set_values(const std::vector<float>& values) {
  const auto set = [&](Entry& entry) {
    if (entry.number != missing) entry.value = values[entry.number];
  };
  for (Entry& entry : table_) set(entry);
  for (Slot& slot : slots_) set(slot.entry);
}

std::size_t BrickIndex::memory_bytes() const {
  return table_.size() * sizeof(table_[0]) + slots_.size() * sizeof(Slot);
}

}  // namespace tensorray
