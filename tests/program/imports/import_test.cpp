// Importing files of other programs: the whole way, and what the program reports of it. tests/import has the readers.

#include "base/constants.h"
#include "tests/program/import_support.h"

namespace tensorray {
namespace {

using namespace test;

TEST_F(Import, PointLoadIsBoussinesqs) {
  const std::string file = data_file("pointload/pointload_32.vti");
  SKIP_WITHOUT(file);
  const json load = import({file}, "load");
  EXPECT_EQ(load["active_voxels"], 32 * 32 * 32);
  expect_extent(load, {-10, -10, -10}, {10, 10, 10}, 1e-9);
  const TensorGrid grid = field("load");
  for_each_voxel(grid, [&](const Vector3i& index, const Eigen::Matrix3f& stress) {
    const Vector3d r = grid.to_world * index.cast<double>() - Vector3d(0, 0, 10);
    const double pressed = 3 * 100 / (2 * pi) * std::pow(r.z(), 3) / std::pow(r.norm(), 5);
    ASSERT_NEAR(stress(2, 2), pressed, 1e-6 * (1 + std::abs(pressed)));  // r.z() <= 0: pressure is negative.
    ASSERT_NEAR(stress(0, 2) * r.z(), pressed * r.x(), 1e-5 * (1 + std::abs(pressed)));
  });
}

TEST_F(Import, BluntFinWhoseBoundaryLayerIsThinnerThanAVoxel) {
  const std::string folder = data_file("bluntfin");
  SKIP_WITHOUT(folder);
  // With a number of voxels for each axis, voxels are on the walls.
  const json fin = import({folder + "/bluntfinxyz.bin", folder + "/bluntfinq.bin", "--gradient-of", "velocity",
                           "--resolution", "100", "38", "26", "--boundary", "fin.ply"},
                          "fin");
  EXPECT_NE(imported_.out.find("peak 1942 ->"), std::string::npos) << imported_.out;
  const std::size_t median = imported_.out.find("median ");
  ASSERT_NE(median, std::string::npos) << imported_.out;
  EXPECT_NEAR(std::stod(imported_.out.substr(median + 7)), 6.49, 0.03);  // Some nodes have no gradient.
  EXPECT_EQ(std::count(imported_.error.begin(), imported_.error.end(), '\n'), 1) << imported_.error;
  EXPECT_NE(imported_.error.find("warning: the grid holds"), std::string::npos) << imported_.error;
  EXPECT_EQ(voxels_of(fin).x(), 100);
  EXPECT_NEAR(fin["asymmetry"].get<double>(), std::sqrt(2.0), 0.02);  // That of simple shear, as in boundary layers.
  EXPECT_LT(at(fin, "norm", "p100"), 1942.5);
  EXPECT_EQ(read_file(in_folder("fin.ply")).compare(0, 4, "ply\n"), 0);
  EXPECT_EQ(files(), (std::vector<std::string>{"fin.ply", "fin.vdb"}));
}

TEST_F(Import, WhatMakeMadeComesBackBitForBit) {
  run_well({"make", "vortex", "-o", "made.vdb", "--resolution", "9"});
  const TensorGrid made = field("made");
  const Vector3i size = made.active_box().sizes() + Vector3i::Ones();
  std::vector<float> numbers(static_cast<std::size_t>(size.prod()) * 9);
  for_each_voxel(made, [&](const Vector3i& index, const Eigen::Matrix3f& tensor) {
    const auto first = static_cast<std::size_t>((index.z() * size.y() + index.y()) * size.x() + index.x()) * 9;
    for (std::size_t i = 0; i < 9; ++i) numbers[first + i] = tensor(static_cast<int>(i / 3), static_cast<int>(i % 3));
  });
  const Matrix3d edges = made.to_world.linear();
  write("made.vti", vti(size, made.to_world.translation(), edges.diagonal(), Matrix3d::Identity(), numbers));
  EXPECT_EQ(import({"made.vti"}, "image")["name"], "lumps");
  expect_same(made, field("image"));

  write("made.npy", npy_header(fmt::format("{}, {}, {}, 3, 3", size.z(), size.y(), size.x())) + bytes_of(numbers));
  import({"made.npy"}, "array");
  TensorGrid array = field("array");
  EXPECT_TRUE(array.to_world.matrix().isIdentity());
  array.to_world = made.to_world;
  expect_same(made, array);

  const json half = import({"made.npy", "--half"}, "half");
  EXPECT_EQ(half["active_voxels"], size.prod());
  EXPECT_NEAR(at(half, "norm", "p100"), at(info("made"), "norm", "p100"), 1e-3 * at(half, "norm", "p100"));
}

TEST_F(Import, StepsOfTime) {
  OpenFoamCase::write(in_folder("case"));
  const std::vector<std::string> sigma{"import", "case",         "--array", "sigma", "--order",
                                       "vtk",    "--resolution", "4",       "-q"};
  const auto steps = [&](const std::string& which, const std::string& output) {
    std::vector<std::string> arguments = sigma;
    arguments.insert(arguments.end(), {"--steps", which, "-o", output});
    return run(arguments);
  };
  EXPECT_EQ(steps("all", "all.##.vdb").status, 0);
  EXPECT_EQ(steps("first", "first.vdb").status, 0);
  EXPECT_EQ(steps("last", "last.vdb").status, 0);
  EXPECT_EQ(steps("2", "second.vdb").status, 0);
  const auto bytes = [&](const std::string& name) { return read_file(in_folder(name)); };
  EXPECT_FALSE(std::filesystem::exists(in_folder("all.03.vdb")));
  EXPECT_TRUE(bytes("all.01.vdb") == bytes("first.vdb"));
  EXPECT_TRUE(bytes("all.02.vdb") == bytes("last.vdb") && bytes("second.vdb") == bytes("last.vdb"));
  EXPECT_FALSE(bytes("first.vdb") == bytes("last.vdb"));
  const std::pair<const char*, const char*> wrong[] = {{"3", "there are 2 steps"},
                                                       {"0", "a number from 1 on"},
                                                       {"some", "a number from 1 on"},
                                                       {"all", "flow.####.vdb"}};
  for (const auto& [which, text] : wrong) {
    const Outcome outcome = steps(which, "none.vdb");
    EXPECT_NE(outcome.status, 0) << which;
    EXPECT_NE(outcome.error.find(text), std::string::npos) << outcome.error;
    EXPECT_FALSE(std::filesystem::exists(in_folder("none.vdb")));
  }
}

}  // namespace
}  // namespace tensorray
