#pragma once
/// The channels of an EXR as a table: each row has names and values together. docs/scenes.md says what they mean.

#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Channels that belong together, and how they are computed of what is known of a pixel. @tparam Pixel  Any type.
template <class Pixel>
struct ChannelRow {
  std::vector<std::string> names;                          ///< "normal.X", "normal.Y", "normal.Z"
  std::function<void(const Pixel&, float* values)> write;  ///< Writes as many values as there are names.

  /// @param value  Of a pixel: for one name, a number; otherwise an Eigen vector with a number for each name.
  template <std::size_t count, class Value>
  ChannelRow(const std::string (&names_)[count], Value value)
      : names(names_, names_ + count), write([value](const Pixel& pixel, float* values) {
          const auto result = value(pixel);
          if constexpr (std::is_arithmetic_v<std::decay_t<decltype(result)>>) {
            static_assert(count == 1, "each name needs a number");
            *values = static_cast<float>(result);
          } else {
            Eigen::Map<Eigen::Matrix<float, count, 1>>{values} = result.template cast<float>();
          }
        }) {}
};

template <class Pixel>
using ChannelTable = std::vector<ChannelRow<Pixel>>;

template <class Pixel>
std::vector<std::string> channel_names(const ChannelTable<Pixel>& table) {
  std::vector<std::string> names;
  for (const ChannelRow<Pixel>& row : table) names.insert(names.end(), row.names.begin(), row.names.end());
  return names;
}

/// Writes the values of a pixel, in the order of channel_names.
template <class Pixel>
void write_channels(const ChannelTable<Pixel>& table, const Pixel& pixel, float* values) {
  for (const ChannelRow<Pixel>& row : table) {
    row.write(pixel, values);
    values += row.names.size();
  }
}

}  // namespace tensorray
