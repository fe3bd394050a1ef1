#pragma once
/// @file scenes/outputs/channel_table.h
/// The channels of an EXR as a table: each row has names, meaning and values together. docs/scenes.md has the same
/// tables (Method::channels).

#include <cstddef>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "scenes/description/method.h"

namespace tensorray {

/// Channels, and how they are computed of what is known of a pixel. @tparam Pixel  Any type.
template <class Pixel>
struct ChannelRow : ChannelText {
  bool is_there;                                           ///< Whether the picture has these channels.
  std::function<void(const Pixel&, float* values)> write;  ///< Writes as many values as there are names.

  /// @param value  Of a pixel: for one name, a number; otherwise an Eigen vector with a number for each name.
  template <std::size_t count, class Value>
  ChannelRow(const std::string (&names_)[count], const char* meaning_, Value value, bool is_there_ = true)
      : ChannelText{{names_, names_ + count}, meaning_},
        is_there(is_there_),
        write([value](const Pixel& pixel, float* values) {
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

/// The names of the channels that the picture has.
template <class Pixel>
std::vector<std::string> channel_names(const ChannelTable<Pixel>& table) {
  std::vector<std::string> names;
  for (const ChannelRow<Pixel>& row : table)
    if (row.is_there) names.insert(names.end(), row.names.begin(), row.names.end());
  return names;
}

/// The texts of all rows.
template <class Pixel>
std::vector<ChannelText> channel_texts(const ChannelTable<Pixel>& table) {
  return {table.begin(), table.end()};
}

/// Writes the values of a pixel, in the order of channel_names.
template <class Pixel>
void write_channels(const ChannelTable<Pixel>& table, const Pixel& pixel, float* values) {
  for (const ChannelRow<Pixel>& row : table) {
    if (!row.is_there) continue;
    row.write(pixel, values);
    values += row.names.size();
  }
}

}  // namespace tensorray
