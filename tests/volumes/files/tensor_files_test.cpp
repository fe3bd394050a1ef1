#include "volumes/files/tensor_files.h"

#include <fstream>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include "tests/volumes/file_support.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

TEST(TensorFiles, HalfRoundTripErrsByHalfsPrecisionAndRefusesGreatValues) {
  TensorGrid grid = sparse_grid();
  const Temporary path("a.vdb"), full("b.vdb");
  write_tensor_vdb(path, grid, true);
  write_tensor_vdb(full, grid);
  EXPECT_LT(fs::file_size(path), fs::file_size(full));
  const TensorGrid read = read_tensor_vdb(path);
  ASSERT_EQ(read.blocks.size(), grid.blocks.size());
  for (std::size_t i = 0; i < grid.blocks.size(); ++i) {
    EXPECT_EQ(read.blocks[i].active, grid.blocks[i].active);
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      const Matrix3f value = grid.blocks[i].values[offset], error = read.blocks[i].values[offset] - value;
      // Half floats have 11 bits, and steps of 2^-24 below 2^-14.
      ASSERT_TRUE((error.array().abs() <= (value.array().abs() / 2048).max(3e-8f)).all()) << value;
    }
  }
  EXPECT_EQ(list_vdb(path)[0].storage, "half");
  EXPECT_EQ(list_vdb(full)[0].storage, "full");
  grid.blocks[1].values[1](2, 0) = -70000;
  EXPECT_THAT([&] { write_tensor_vdb(path, grid, true); }, fails_with(path.string(), "65504"));
  EXPECT_NO_THROW(write_tensor_vdb(path, grid, false));
}

TEST(TensorFiles, FilesOfAnyCompressionHoldTheSame) {
  TensorGrid grid = sparse_grid();
  for (TensorBlock& block : grid.blocks) {
    block.active.set();
    for (int i = 0; i < TensorBlock::voxels; ++i)
      block.values[i] = Eigen::Matrix3f::Constant(0.125f * static_cast<float>(i * i % 13));
  }
  for (const bool half : {false, true}) {
    std::array<std::uintmax_t, 3> sizes;
    for (const VdbCompression compression : {VdbCompression::zip, VdbCompression::blosc, VdbCompression::none}) {
      const Temporary path("a.vdb");
      write_tensor_vdb(path, grid, half, compression);
      sizes[static_cast<std::size_t>(compression)] = fs::file_size(path);
      expect_same_blocks(read_tensor_vdb(path), grid);
      const auto row = stock_grid_of<openvdb::Vec3SGrid>(path, grid.name + "_row0");
      const openvdb::Coord at = coord_of(grid.blocks[0].origin + TensorBlock::position(5));
      EXPECT_EQ(row->tree().getValue(at), openvdb::Vec3s(1.5f));
    }
    const auto& [blosc, zip, none] = sizes;
    EXPECT_LT(zip, blosc);  // Components are rounded.
    EXPECT_LT(blosc, none);
  }
}

TEST(TensorFiles, KeepsNonFiniteValues) {
  TensorGrid grid = sparse_grid();
  grid.blocks[0].values[grid.blocks[0].active._Find_first()](0, 1) = NAN;
  const Temporary path("a.vdb");
  write_tensor_vdb(path, grid);
  expect_same_blocks(read_tensor_vdb(path), grid);
}

TEST(TensorFiles, SameGridGivesSameBytes) {
  const Temporary a("a.vdb"), b("b.vdb"), c("c.vdb");
  TensorGrid grid = sparse_grid();
  write_tensor_vdb(a, grid);
  write_tensor_vdb(b, grid);
  EXPECT_TRUE(bytes_of(a) == bytes_of(b));
  grid.blocks[3].active.set(4);
  grid.blocks[3].values[4](1, 1) += 1;
  write_tensor_vdb(c, grid);
  EXPECT_NE(bytes_of(a).substr(21, 36), bytes_of(c).substr(21, 36));  // The unique tag tells them apart.
}

TEST(TensorFiles, StockOpenVdbReadsThem) {
  const TensorGrid grid = sparse_grid();
  const Temporary path("a.vdb");
  write_tensor_vdb(path, grid);
  openvdb::io::File file(path.string());
  file.open();
  EXPECT_EQ(file.getMetadata()->metaValue<std::string>("tensorray:units"), "Pa/m");
  for (int row = 0; row < 3; ++row) {
    const auto vectors = stock_grid_of<openvdb::Vec3SGrid>(path, "stress_row" + std::to_string(row));
    ASSERT_TRUE(vectors);
    EXPECT_EQ(vectors->getVectorType(), openvdb::VEC_INVARIANT);
    EXPECT_EQ(vectors->activeVoxelCount(), grid.active_voxels());
    EXPECT_EQ(vectors->metaValue<std::string>("tensorray:source"), "a test");
    const Vector3d world = to_eigen(vectors->indexToWorld(openvdb::Vec3d(2, 3, 4)));
    EXPECT_LE((world - grid.to_world * Vector3d(2, 3, 4)).norm(), 1e-12);
    for (const Vector3i& i : {Vector3i(-11, -3, 6), Vector3i(0, 0, 13), Vector3i(6, 12, 21)}) {
      const Matrix3f* expected = find(grid, i);
      EXPECT_EQ(to_eigen(vectors->tree().getValue(coord_of(i))),
                expected ? Vector3f(expected->row(row)) : Vector3f(Vector3f::Zero()));
    }
  }
}

TEST(TensorFiles, DoublePrecisionRows) {
  const TensorGrid read = read_stock(stock_rows<openvdb::Vec3DGrid>("T", [](auto& grid, int row) {
    grid.tree().setValue({0, 0, 0}, {row + 0.5, row + 1.5, 1e300});
  }));
  EXPECT_EQ((*find(read, {0, 0, 0}))(2, 1), 3.5f);
  EXPECT_EQ((*find(read, {0, 0, 0}))(2, 2), INFINITY);
}

TEST(TensorFiles, ActiveWhereAnyComponentIsAndZeroElsewhere) {
  const TensorGrid read = read_stock(stock_rows("T", [](auto& grid, int row) {
    grid.tree().root().setBackground(openvdb::Vec3s(7), false);
    grid.tree().setValueOn({row, 0, 0}, openvdb::Vec3s(1, 2, 3));
    grid.tree().setValueOff({5, 5, 5}, openvdb::Vec3s(9));  // It does not count.
  }));
  EXPECT_EQ(read.active_voxels(), 3u);
  EXPECT_EQ(find(read, {1, 0, 0})->cast<double>(), by_rows({0, 0, 0, 1, 2, 3, 0, 0, 0}));
  EXPECT_EQ(read.blocks[0].values[TensorBlock::offset(5, 5, 5)], Matrix3f(Matrix3f::Zero()));
}

/// Also where all voxels of a block are active, and a block was read before it.
TEST(TensorFiles, ComponentsOfGridsWithoutAVoxelAreZero) {
  const Temporary path("a.vdb");
  write_stock(path, stock_rows("T", [](auto& grid, int row) {
                grid.denseFill({{0, 0, 0}, {7, 7, row == 0 ? 15 : 7}}, openvdb::Vec3s(1, 2, 3));
                if (row == 1) grid.tree().setValueOn({0, 0, 8}, openvdb::Vec3s(4, 5, 6));
              }));
  const BlockSource source = open_tensor_vdb(path);
  TensorBlock block;
  read_block(source, 0, block);
  read_block(source, 1, block);
  EXPECT_TRUE(block.active.all());
  EXPECT_EQ(block.values[1].cast<double>(), by_rows({1, 2, 3, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(block.values[0].cast<double>(), by_rows({1, 2, 3, 4, 5, 6, 0, 0, 0}));
}

TEST(TensorFiles, OfGridsWithOneNameTheSameIsReadEachTime) {
  openvdb::GridPtrVec rows = voxel_rows("T", 1), others = voxel_rows("U", 2);
  rows.insert(rows.end(), others.begin(), others.end());
  const Temporary path("a.vdb");
  write_stock(path, rows);
  std::string bytes = bytes_of(path);
  for (std::size_t at = bytes.find("U_row"); at != std::string::npos; at = bytes.find("U_row", at)) bytes[at] = 'T';
  write_bytes(path, bytes);
  for (int i = 0; i < 10; ++i) {
    const Matrix3f tensor = read_tensor_vdb(path).blocks[0].values[0];
    EXPECT_EQ(tensor, Matrix3f(Matrix3f::Constant(tensor(0, 0))));
  }
}

/// OpenVDB's own files, whose tables of leaves say other flags than the leaves, or lengths that nothing has.
TEST(TensorFiles, StockFilesOfAllCompressions) {
  using namespace openvdb::io;
  TensorGrid grid = sparse_grid();
  const Temporary path("a.vdb"), stock("b.vdb");
  for (const bool half : {false, true})
    for (const bool dense : {false, true}) {
      if (dense)
        for (TensorBlock& block : grid.blocks) block.active.set();
      write_tensor_vdb(path, grid, half);
      const openvdb::GridPtrVec grids = stock_grids(path);
      for (const openvdb::GridBase::Ptr& row : grids)  // A leaf without active voxels.
        openvdb::gridPtrCast<openvdb::Vec3SGrid>(row)->tree().setValueOff({100, 0, 0}, openvdb::Vec3s(1));
      for (const std::uint32_t values : {COMPRESS_NONE, COMPRESS_ZIP, COMPRESS_BLOSC})
        for (const std::uint32_t mask : {0u, std::uint32_t{COMPRESS_ACTIVE_MASK}}) {
          write_stock(stock, grids, values | mask);
          expect_same_blocks(read_tensor_vdb(stock), read_tensor_vdb(path));
        }
    }
}

TEST(TensorFiles, BlocksAreReadInAnyOrder) {
  const TensorGrid grid = sparse_grid();
  const Temporary path("a.vdb");
  for (const bool half : {false, true}) {
    write_tensor_vdb(path, grid, half);
    const BlockSource source = open_tensor_vdb(path, grid.name);
    EXPECT_EQ(source.metadata.at("tensorray:units"), "Pa/m");
    EXPECT_TRUE(source.to_world.isApprox(grid.to_world, 1e-15));
    ASSERT_EQ(source.shapes.size(), grid.blocks.size());
    TensorBlock block;  // Each read replaces all of it.
    for (int turn = 0; turn < 2; ++turn) {
      TensorBlocks blocks = make_blocks(grid.blocks.size());
      for (std::size_t i = blocks.size(); i-- > 0;) {
        read_block(source, i, block);
        blocks[i] = block;
        for (int offset = 0; offset < TensorBlock::voxels; ++offset)
          ASSERT_LE((block.values[offset] - grid.blocks[i].values[offset]).norm(), half ? 1e-3 : 0);
      }
      expect_same_blocks(blocks, half ? read_tensor_vdb(path).blocks : grid.blocks);
    }
  }
}

TEST(TensorFiles, ActiveTilesAreVoxels) {
  const openvdb::GridPtrVec rows = stock_rows("T", [](auto& grid, int row) {
    // One tile of a leaf's size with voxels beside it, and one tile of the next level (128³).
    grid.sparseFill(openvdb::CoordBBox(-1, -8, 0, 8, -1, 7), openvdb::Vec3s(static_cast<float>(row + 1)));
    grid.tree().addTile(2, openvdb::Coord(128, 0, 0), openvdb::Vec3s(4), true);
  });
  EXPECT_GT(openvdb::gridPtrCast<openvdb::Vec3SGrid>(rows[0])->tree().activeTileCount(), 1u);
  const TensorGrid read = read_stock(rows);
  EXPECT_EQ(read.active_voxels(), 10u * 8 * 8 + 128u * 128 * 128);
  EXPECT_EQ((*find(read, {3, -4, 4}))(2, 0), 3.0f);
  EXPECT_EQ((*find(read, {200, 100, 127}))(0, 2), 4.0f);
  expect_sound(read);
}

TEST(TensorFiles, GridsThatShareATree) {
  const auto first = stock_grid<openvdb::FloatGrid>("T_1");
  first->tree().setValue({1, 1, 1}, 3);
  openvdb::GridPtrVec grids{first};
  for (const int i : {0, 2, 3, 4, 5, 6, 7, 8}) {
    const openvdb::FloatGrid::Ptr shared = first->copy();  // Grids share one tree, written once.
    shared->setName("T_" + std::to_string(i));
    grids.push_back(shared);
  }
  EXPECT_EQ(*find(read_stock(grids), {1, 1, 1}), Matrix3f(Matrix3f::Constant(3)));
}

TEST(TensorFiles, FilesWrittenAsAStream) {
  const TensorGrid grid = sparse_grid();
  const Temporary path("a.vdb"), streamed("b.vdb");
  write_tensor_vdb(path, grid);
  {
    std::ofstream out(streamed, std::ios::binary);
    openvdb::io::Stream(out).write(stock_grids(path));
  }
  expect_same_blocks(read_tensor_vdb(streamed), grid);
  const std::string bytes = bytes_of(streamed);
  for (int i = 0; i < 50; ++i) {
    write_bytes(path, bytes.substr(0, bytes.size() * i / 50));
    EXPECT_THROW(read_tensor_vdb(path), std::runtime_error) << i;
  }
}

TEST(TensorFiles, ChoosesAmongFieldsByName) {
  const Temporary path("a.vdb");
  openvdb::GridPtrVec grids = voxel_rows("A", 1), others = voxel_rows("B", 2);
  grids.insert(grids.end(), others.begin(), others.end());
  grids.push_back(stock_grid_of_type("float", "density"));
  grids.push_back(stock_grid_of_type("bool", "mask"));
  write_stock(path, grids);
  EXPECT_EQ((*find(read_tensor_vdb(path, "B"), {0, 0, 0}))(0, 0), 2);
  EXPECT_EQ(tensor_names(list_vdb(path)), (std::vector<std::string>{"A", "B"}));
  EXPECT_THAT([&] { read_tensor_vdb(path); }, fails_with(path.string(), "`field.name` must be one of: A, B"));
  EXPECT_THAT([&] { read_tensor_vdb(path, "C"); }, fails_with("\"C\"", "density (float)", "mask (bool)"));
  EXPECT_THAT([&] { read_tensor_vdb(path, "density", Derive::hessian); }, fails_with("no active voxel"));
}

TEST(TensorFiles, RefusesDifferentTransformsFrustumsAndUnitsThatAreNoNumbers) {
  using openvdb::math::Transform;
  openvdb::GridPtrVec rows = voxel_rows("T");
  rows[2]->setTransform(Transform::createLinearTransform(0.5));
  EXPECT_THAT([&] { read_stock(rows); }, fails_with("stock.vdb", "different transforms"));
  for (const auto& row : rows)
    row->setTransform(Transform::createFrustumTransform(openvdb::BBoxd({0, 0, 0}, {8, 8, 8}), 0.5, 10, 1));
  EXPECT_THAT([&] { read_stock(rows); }, fails_with("stock.vdb", "not affine"));
  rows = voxel_rows("T");
  for (const auto& row : rows) row->insertMeta("tensorray:length_unit", openvdb::StringMetadata("-1e-6"));
  EXPECT_THAT([&] { read_stock(rows); }, fails_with("stock.vdb", "length_unit"));
}

/// A grid of `value(world)` at the voxels of a ball, so that every kind of edge occurs.
template <class Grid, class Value>
typename Grid::Ptr ball(const std::string& name, const Value& value) {
  const auto grid = stock_grid<Grid>(name);
  // OpenVDB multiplies rows by matrices, whose rows are therefore Eigen's columns.
  grid->setTransform(openvdb::math::Transform::createLinearTransform(openvdb::Mat4d(sheared_transform().data())));
  for (int x = -9; x <= 9; ++x)
    for (int y = -9; y <= 9; ++y)
      for (int z = -9; z <= 9; ++z)
        if (x * x + y * y + z * z <= 80)
          grid->tree().setValue({x, y, z}, value(sheared_transform() * Vector3d(x, y, z)));
  return grid;
}

TEST(TensorFiles, GradientAndViscousStressOfALinearVelocityAreExactInWorldAxes) {
  const Matrix3d jacobian = by_rows({1, -2, 0.5, 3, 0.25, -1, 0.125, 4, 1});
  const Matrix3d stress = by_rows({0.5, 1, 0.625, 1, -1, 3, 0.625, 3, 0.5});  // By hand: the trace is 2.25.
  const auto velocity = [&](const Vector3d& p) { return openvdb::Vec3d(Vector3d(jacobian * p).data()); };
  const Temporary of_velocity("v.vdb"), of_gradient("g.vdb");
  write_stock(of_velocity, {ball<openvdb::Vec3DGrid>("velocity", velocity)});
  const TensorGrid gradient = read_tensor_vdb(of_velocity, "", Derive::gradient);
  EXPECT_EQ(gradient.name, "velocity");
  EXPECT_GT(gradient.active_voxels(), 2000u);
  for_each_active(gradient, [&](const Vector3i& index, const Matrix3f& value) {
    // The six poles of the ball have no neighbour along two axes, where the field counts as constant.
    if (index.cast<double>().norm() > 8.5) return;
    ASSERT_LE((value.cast<double>() - jacobian).norm(), 1e-5);
  });
  write_tensor_vdb(of_gradient, gradient);
  for (const fs::path& path : {of_velocity.path(), of_gradient.path()})
    for (const double sign : {1, -1}) {
      const Derive derive = sign > 0 ? Derive::viscous_stress : Derive::negative_viscous_stress;
      const TensorGrid read = read_tensor_vdb(path, "velocity", derive);
      EXPECT_GT(read.active_voxels(), 2000u);
      const Matrix3d middle = find(read, {0, 0, 0})->cast<double>();
      EXPECT_LE((middle - sign * stress).norm(), 1e-5) << path;
    }
}

TEST(TensorFiles, DerivativesHaveTheUnitOfTheirGridByLength) {
  const Temporary path("a.vdb");
  const openvdb::GridPtrVec rows = voxel_rows("T");
  const auto unit = [&] {
    openvdb::MetaMap of_file;
    of_file.insertMeta("tensorray:units", openvdb::StringMetadata("Pa"));
    openvdb::io::File(path.string()).write(rows, of_file);
    const auto metadata = read_tensor_vdb(path, "T_row0", Derive::gradient).metadata;
    return metadata.count("tensorray:units") ? metadata.at("tensorray:units") : "none";
  };
  EXPECT_EQ(unit(), "none");  // The file's may be that of another grid.
  rows[0]->insertMeta("tensorray:units", openvdb::StringMetadata("m/s"));
  EXPECT_EQ(unit(), "m/s/length");
  EXPECT_EQ(read_tensor_vdb(path, "T_row0", Derive::viscous_stress).metadata.at("tensorray:units"), "m/s/length");
  EXPECT_EQ(read_tensor_vdb(path, "T", Derive::viscous_stress).metadata.at("tensorray:units"), "Pa");
}

TEST(TensorFiles, HessianOfAQuadraticIsExactInWorldAxes) {
  const Matrix3d second = by_rows({2, 1, -0.5, 1, -3, 0.25, -0.5, 0.25, 1});
  const auto potential = [&](const Vector3d& p) { return p.dot(0.5 * second * p + Vector3d(1, 2, 3)) - 5; };
  const TensorGrid read = read_stock({ball<openvdb::DoubleGrid>("potential", potential)}, "potential", Derive::hessian);
  std::size_t inside = 0;
  for_each_active(read, [&](const Vector3i& index, const Matrix3f& value) {
    ASSERT_EQ(value, Matrix3f(value.transpose()));
    if (index.cast<double>().norm() > 6.5) return;  // Deep enough for all differences.
    ++inside;
    ASSERT_LE((value.cast<double>() - second).norm(), 1e-5);
  });
  EXPECT_GT(inside, 1000u);
}

TEST(TensorFiles, VoxelsOfAnySizeAreWrittenAndRead) {
  for (const double unit : {1e-30, 1e-12, 1e-9, 3e-6, 1e-5, 1e-3, 1.0, 1e10, 1e26}) {
    TensorGrid grid = sparse_grid();
    grid.to_world = Eigen::Affine3d(Eigen::Scaling(unit)) * grid.to_world;
    grid.metadata["tensorray:length_unit"] = "7";  // As of a file that was read and changed: it is not kept.
    const Temporary path("a.vdb");
    write_tensor_vdb(path, grid);
    const TensorGrid read = read_tensor_vdb(path);
    EXPECT_LE((read.to_world.matrix() - grid.to_world.matrix()).topRows<3>().norm(), 1e-14 * unit) << unit;
    EXPECT_EQ(read.metadata.count("tensorray:length_unit"), 0u);
    expect_same_blocks(read, grid);
    const auto row = stock_grid_of<openvdb::Vec3SGrid>(path, "stress_row0");
    const bool has_unit = row->getMetadata<openvdb::StringMetadata>("tensorray:length_unit") != nullptr;
    EXPECT_EQ(has_unit, unit < 1e-4) << unit;  // Others read the voxels where they are, if OpenVDB can say it.
    const double stored = row->transform().voxelSize().length();
    EXPECT_TRUE(!has_unit || (stored > 0.5 && stored < 50)) << unit << ' ' << stored;
  }
}

}  // namespace
}  // namespace tensorray
