#include <limits>
#include <random>
#include <tuple>

#include <openvdb/openvdb.h>

#include "base/text/byte_order.h"
#include "tests/volumes/file_support.h"
#include "volumes/files/tensor_files.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

/// Runs `read` on a file cut at every fiftieth of its length and at some lengths near its ends. Each call must throw
/// one line that names the file.
void expect_all_truncations_fail(const std::string& bytes, const std::string& label) {
  std::vector<std::size_t> lengths{1, 7, 8, 11, 12, 20, 21, 57, bytes.size() - 1, bytes.size() - 2, bytes.size() - 9};
  for (std::size_t i = 0; i < 50; ++i) lengths.push_back(bytes.size() * i / 50);
  const Temporary path("short.vdb");
  for (const std::size_t length : lengths) {
    write_bytes(path, bytes.substr(0, length));
    EXPECT_THAT([&] { read_tensor_vdb(path); }, fails_with(path.string())) << label << " " << length;
    EXPECT_THROW(list_vdb(path), std::runtime_error) << label << " " << length;
  }
}

TEST(DamagedFiles, TruncationIsNoticed) {
  using namespace openvdb::io;
  const Temporary path("a.vdb"), recompressed("b.vdb");
  for (const bool half : {false, true}) {
    write_tensor_vdb(path, sparse_grid(), half);
    const openvdb::GridPtrVec grids = stock_grids(path);
    for (const std::uint32_t compression :
         std::initializer_list<std::uint32_t>{COMPRESS_NONE, COMPRESS_ACTIVE_MASK, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK,
                                              COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK}) {
      write_stock(recompressed, grids, compression);
      expect_all_truncations_fail(bytes_of(recompressed), compressionToString(compression));
    }
  }
}

/// Bytes with another length at a place.
std::string with_length(std::string bytes, std::size_t at, std::int64_t length) {
  std::string number;
  append_number(length, ByteOrder::little, number);
  return bytes.replace(at, number.size(), number);
}

TEST(DamagedFiles, LengthsOfZipThatAreTooLarge) {
  using namespace openvdb::io;
  const Temporary path("a.vdb"), stock("b.vdb"), damaged("c.vdb");
  write_tensor_vdb(path, sparse_grid());
  for (const std::uint32_t mask : {0u, std::uint32_t{COMPRESS_ACTIVE_MASK}}) {
    write_stock(stock, stock_grids(path), COMPRESS_ZIP | mask);
    const std::string bytes = bytes_of(stock);
    // A chunk of a leaf begins with its length, which is below that of the leaf's values; its stream of zlib follows.
    std::size_t chunk = bytes.rfind("\x78\x9c");
    while (read_number<std::uint64_t>(&bytes.at(chunk - 8), ByteOrder::little) > 12 * TensorBlock::voxels)
      chunk = bytes.rfind("\x78\x9c", chunk - 1);
    for (const std::int64_t length : {std::int64_t{1} << 21, std::int64_t{1} << 31, std::int64_t{1} << 40}) {
      write_bytes(damaged, with_length(bytes, chunk - 8, length) + std::string(100, '\0'));
      EXPECT_THROW(read_tensor_vdb(damaged), std::runtime_error) << length << " " << mask;
    }
  }
}

/// Compression of a file's trees: half floats or not, and OpenVDB's flags.
class FlippedBytes : public testing::TestWithParam<std::tuple<bool, std::uint32_t>> {};

/// Changes bytes all over a file, one at a time: in trees, a length or a mask that is wrong made OpenVDB write beyond
/// its memory. (A change that leaves every length as it was is read: the format has no checksum.)
TEST_P(FlippedBytes, NeverCrash) {
  const auto [half, compression] = GetParam();
  const Temporary path("a.vdb"), stock("b.vdb"), damaged("c.vdb");
  write_tensor_vdb(path, sparse_grid(), half);
  write_stock(stock, stock_grids(path), compression);
  const std::string bytes = bytes_of(stock);
  int refused = 0;
  constexpr std::size_t flips = 150;
  for (std::size_t i = 0; i < flips; ++i) {
    std::string changed = bytes;
    char& flipped = changed[bytes.size() * i / flips];
    flipped = static_cast<char>(flipped ^ (i % 4 == 3 ? 0xff : 1 << (i % 8)));
    write_bytes(damaged, changed);
    try {
      const TensorGrid grid = read_tensor_vdb(damaged);
      expect_sound(grid);
      // Values that are made of what happens to be in memory differ from one reading to the next.
      if (grid.blocks.size() < 1000) expect_same_blocks(grid, read_tensor_vdb(damaged));  // Others have large tiles.
    } catch (const std::runtime_error& error) {
      ++refused;
      EXPECT_THAT(error.what(), AllOf(HasSubstr(damaged.string()), Not(HasSubstr("\n"))));
    }
  }
  EXPECT_GT(refused, 0);
  EXPECT_LT(refused, static_cast<int>(flips));
}

INSTANTIATE_TEST_SUITE_P(
    Compressions, FlippedBytes,
    testing::Combine(testing::Bool(),
                     testing::Values<std::uint32_t>(openvdb::io::COMPRESS_ACTIVE_MASK,
                                                    openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK,
                                                    openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK,
                                                    openvdb::io::COMPRESS_BLOSC)));

/// Each length in the trees, as the greatest and the least number, and a little off.
TEST(DamagedFiles, WrongLengthsInTreesAreNoticed) {
  const Temporary path("a.vdb"), damaged("b.vdb");
  write_tensor_vdb(path, sparse_grid());
  const std::string bytes = bytes_of(path);
  // A chunk of Blosc begins with its version (2) and that of its format (1); its length stands before it.
  int chunks = 0;
  for (std::size_t at = bytes.find("AffineMap"); (at = bytes.find("\x02\x01", at + 1)) != std::string::npos;) {
    const auto length = read_number<std::int64_t>(&bytes[at - 8], ByteOrder::little);
    if (length != read_number<std::uint32_t>(&bytes[std::min(at + 12, bytes.size() - 4)], ByteOrder::little)) continue;
    ++chunks;
    if (chunks % 7 != 1) continue;
    constexpr std::int64_t zero = 0, large = std::int64_t{1} << 40, greatest = std::numeric_limits<std::int64_t>::max();
    for (const std::int64_t wrong :
         {zero, -length, length - 1, length + 1, -length * 1000, large, -large, greatest, -greatest - 1}) {
      write_bytes(damaged, with_length(bytes, at - 8, wrong));
      EXPECT_THAT([&] { read_tensor_vdb(damaged); }, fails_with(damaged.string())) << at << " " << wrong;
    }
  }
  EXPECT_GT(chunks, 20);
}

TEST(DamagedFiles, NotVdbFiles) {
  const Temporary path("a.vdb");
  const auto expect = [&](const fs::path& file, const std::string& what) {
    EXPECT_THAT([&] { read_tensor_vdb(file); }, fails_with(file.string(), what));
    EXPECT_THAT([&] { list_vdb(file); }, fails_with(file.string(), what));
  };
  expect(Temporary("missing.vdb"), "No such file");
  expect(testing::TempDir(), "is a folder");
  expect("/dev/zero", "is a pipe or a device");
  write_bytes(path, "");
  expect(path, "not an OpenVDB file");
  write_bytes(path, "{ \"field\": \"this is text, and long enough for a header of OpenVDB, or so one thinks\" }\n");
  expect(path, "not an OpenVDB file");
  std::mt19937 engine(5);
  std::string noise(100000, ' ');
  for (char& c : noise) c = static_cast<char>(engine());
  write_bytes(path, noise);
  expect(path, "not an OpenVDB file");
  std::string header;
  append_number(std::int64_t{openvdb::OPENVDB_MAGIC}, ByteOrder::little, header);
  append_number(std::uint32_t{openvdb::OPENVDB_FILE_VERSION}, ByteOrder::little, header);
  write_bytes(path, header + noise);
  expect(path, "damaged");
  header.back() = 1;
  write_bytes(path, header + noise);
  expect(path, "newer OpenVDB");
}

TEST(DamagedFiles, ReadsFormatsThatHoldUnknownGrids) {
  // An unknown type in the table of grids does not hide other grids: rename the type of an unrelated grid.
  const Temporary path("a.vdb");
  openvdb::GridPtrVec grids = voxel_rows("T");
  grids.insert(grids.begin(), stock_grid_of_type("int32", "other"));
  write_stock(path, grids);
  std::string bytes = bytes_of(path);
  const std::size_t at = bytes.find("Tree_int32_5_4_3");
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 10, "Tree_mat3x");
  write_bytes(path, bytes);
  EXPECT_EQ(list_vdb(path)[0].type, "mat3x");
  EXPECT_EQ(read_tensor_vdb(path).active_voxels(), 1u);
}

/// A tile at the greatest index has no index behind it, where a loop over its blocks could end.
TEST(DamagedFiles, VoxelsFarAwayAreRefused) {
  constexpr std::int32_t end = std::numeric_limits<std::int32_t>::max();
  const auto at = [](std::int32_t x) { return openvdb::Coord(x, 0, 0); };
  struct Case {
    const char* what;
    openvdb::Coord first;
    bool is_tile;
  };
  const Case cases[] = {{"tile at the end", openvdb::Coord(end - 127), true},
                        {"tile at the beginning", openvdb::Coord(-end - 1), true},
                        {"voxel at the end", at(end), false},
                        {"voxel at the beginning", at(-end - 1), false},
                        {"voxel just out of range", at((1 << 29) + 8), false}};
  for (const Case& each : cases) {
    const auto set = [&](auto& grid, const auto& value) {
      if (each.is_tile)
        grid.tree().addTile(2, each.first, value, true);  // OpenVDB's own fill does not end at the greatest index.
      else
        grid.tree().setValueOn(each.first, value);
    };
    const auto rows = stock_rows("T", [&](auto& grid, int) { set(grid, openvdb::Vec3s(1)); });
    const auto scalar = stock_grid<openvdb::FloatGrid>("phi");
    set(*scalar, 1.0f);
    EXPECT_THAT([&] { read_stock(rows); }, fails_with("stock.vdb", "indices are beyond")) << each.what;
    EXPECT_THAT([&] { read_stock({scalar}, "", Derive::hessian); }, fails_with("stock.vdb", "indices are beyond"))
        << each.what;
  }
}

/// Tiles take a few bytes in the file, and 2 GB each in memory.
TEST(DamagedFiles, TilesThatFitInNoMemoryAreRefused) {
  const auto grid = stock_grid<openvdb::FloatGrid>("phi");
  for (int i = 0; i < 4000; ++i)
    grid->tree().addTile(2, openvdb::Coord(128 * (i % 20), 128 * (i / 20 % 20), 128 * (i / 400)), 1.0f, true);
  const Temporary path("tiles.vdb");
  write_stock(path, {grid});
  EXPECT_LT(fs::file_size(path), 1000000u);
  EXPECT_THAT([&] { read_tensor_vdb(path, "", Derive::hessian); }, fails_with(path.string(), "active voxels need"));
}

TEST(TensorFileWriting, FullDiskIsNoticed) {
  const TensorGrid grid = sparse_grid();
  const Temporary path("a.vdb");
  write_tensor_vdb(path, grid);
  const auto size = fs::file_size(path);
  for (const auto limit : {std::uintmax_t{0}, std::uintmax_t{30}, size / 3, size / 2, size - 1}) {
    fs::remove(path);
    const FileSizeLimit limited(limit);
    EXPECT_THROW(write_tensor_vdb(path, grid), std::runtime_error) << limit << " of " << size;
  }
  fs::remove(path);
  const FileSizeLimit enough(size);
  EXPECT_NO_THROW(write_tensor_vdb(path, grid));
}

}  // namespace
}  // namespace tensorray
