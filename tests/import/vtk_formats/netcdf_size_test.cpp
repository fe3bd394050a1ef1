#include "tools/import/vtk_formats/netcdf_size.h"

#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "base/text/byte_order.h"
#include "tests/import/mesh_files.h"

namespace tensorray {
namespace {

/// A header of version 5, with 64-bit lengths: one dimension, no attribute, one variable of doubles.
struct Cdf5 {
  std::uint64_t records = 0, name_length = 1, dimension = 10, attributes = 0, begin = 200;

  std::string bytes() const {
    std::string bytes = std::string("CDF") + '\5';
    const auto put32 = [&](std::uint32_t number) { append_number(number, ByteOrder::big, bytes); };
    const auto put64 = [&](std::uint64_t number) { append_number(number, ByteOrder::big, bytes); };
    const auto put_name = [&](std::uint64_t length) {
      put64(length);
      bytes += std::string("x\0\0\0", 4);
    };
    put64(records);
    put32(10);  // The list of dimensions.
    put64(1);
    put_name(name_length);
    put64(dimension);
    put32(attributes > 0 ? 12 : 0);
    put64(attributes);
    put32(11);  // The list of variables.
    put64(1);
    put_name(1);
    put64(1);  // It has one dimension: the first.
    put64(0);
    put32(0);
    put64(0);
    put32(6);  // Type: double.
    put64(80);
    put64(begin);
    return bytes;
  }
};

std::optional<std::uint64_t> size_of(const Cdf5& header) {
  const TemporaryFolder folder;
  write_bytes(folder / "a.ex2", header.bytes());
  return netcdf_size(folder / "a.ex2");
}

TEST(NetcdfSizeTest, IsTheEndOfTheLastVariable) { EXPECT_EQ(size_of({}), 280u); }

/// If it were read as a signed number, a length of 2⁶⁴ − 8 would move the position back again and again.
TEST(NetcdfSizeTest, LengthsBeyondTheFileAreDamage) {
  constexpr std::uint64_t greatest = std::numeric_limits<std::uint64_t>::max();
  for (const std::uint64_t length :
       {std::uint64_t{1000}, std::uint64_t{1} << 63, greatest - 19, greatest - 7, greatest}) {
    Cdf5 header;
    header.name_length = length;
    EXPECT_EQ(size_of(header), std::nullopt) << length;
    header = {};
    header.attributes = length;
    EXPECT_EQ(size_of(header), std::nullopt) << length;
  }
}

TEST(NetcdfSizeTest, SizesBeyondSixtyFourBitsAreDamage) {
  Cdf5 header;
  header.dimension = std::uint64_t{1} << 61;  // Each element takes eight bytes.
  EXPECT_EQ(size_of(header), std::nullopt);
  header = {};
  header.begin = std::numeric_limits<std::uint64_t>::max() - 10;
  EXPECT_EQ(size_of(header), std::nullopt);
  header = {};
  header.dimension = 0;  // The record dimension.
  header.records = std::uint64_t{1} << 62;
  EXPECT_EQ(size_of(header), std::nullopt);
}

}  // namespace
}  // namespace tensorray
