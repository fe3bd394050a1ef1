#include <limits>
#include <string>

#include <gmock/gmock.h>

#include "base/text/byte_order.h"
#include "tests/import/mesh_files.h"
#include "tools/import/cases/exodus.h"

namespace tensorray {
namespace {

/// A header of version 5, with 64-bit lengths: one dimension, no attribute, one variable of doubles, whose last one
/// ends at byte 280.
struct Cdf5 {
  std::uint64_t records = 0, name_length = 1, dimension = 10, attributes = 0, begin = 200;

  std::string bytes() const {
    std::string bytes = std::string("CDF") + '\5';
    const auto put32 = [&](std::uint32_t number) { append_number(number, ByteOrder::big, bytes); };
    const auto put64 = [&](std::initializer_list<std::uint64_t> numbers) {
      for (const std::uint64_t number : numbers) append_number(number, ByteOrder::big, bytes);
    };
    put64({records});
    put32(10);  // The list of dimensions.
    put64({1, name_length});
    bytes += std::string("x\0\0\0", 4);
    put64({dimension});
    put32(attributes > 0 ? 12 : 0);
    put64({attributes});
    put32(11);  // The list of variables.
    put64({1, 1});
    bytes += std::string("x\0\0\0", 4);
    put64({1, 0});  // It has one dimension: the first.
    put32(0);
    put64({0});
    put32(6);  // Type: double.
    put64({80, begin});
    return bytes;
  }
};

std::string error_of_size(const Cdf5& header, std::size_t size) {
  const TemporaryFolder folder;
  std::string bytes = header.bytes();
  bytes.resize(size);
  write_bytes(folder / "a.ex2", bytes);
  return error_of([&] { require_whole_netcdf(folder / "a.ex2"); });
}

TEST(NetcdfEnd, IsThatOfTheLastVariable) {
  EXPECT_EQ(error_of_size({}, 280), "");
  EXPECT_THAT(error_of_size({}, 279), testing::HasSubstr("a.ex2: is cut off: it has 279 of 280 bytes"));
}

/// If it were read as a signed number, a length of 2⁶⁴ − 8 would move the position back again and again.
TEST(NetcdfEnd, SizesOfAnyGreatnessAreRead) {
  constexpr std::uint64_t greatest = std::numeric_limits<std::uint64_t>::max();
  for (const std::uint64_t number :
       {std::uint64_t{1} << 61, std::uint64_t{1} << 63, greatest - 19, greatest - 7, greatest})
    for (std::uint64_t Cdf5::*member : {&Cdf5::name_length, &Cdf5::attributes, &Cdf5::dimension, &Cdf5::begin}) {
      Cdf5 header;
      header.*member = number;
      const bool is_length = member == &Cdf5::name_length || member == &Cdf5::attributes;  // Damage: the library's.
      EXPECT_EQ(error_of_size(header, 280).empty(), is_length) << number;
    }
}

}  // namespace
}  // namespace tensorray
