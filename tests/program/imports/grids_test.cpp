// Grids for other OpenVDB programs: invariants, the light inside the volume, the stretch of neighbouring rays.

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <openvdb/openvdb.h>

#include "renderer/images/image.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

class Grids : public Program {
 protected:
  void SetUp() override {
    openvdb::initialize();
    Program::SetUp();
  }

  openvdb::FloatGrid::Ptr read_grid(const std::string& file, const std::string& name) const {
    openvdb::io::File vdb(in_folder(file).string());
    vdb.open();
    return openvdb::gridPtrCast<openvdb::FloatGrid>(vdb.readGrid(name));
  }

  std::vector<std::string> grid_names(const std::string& file) const {
    openvdb::io::File vdb(in_folder(file).string());
    vdb.open();
    std::vector<std::string> names;
    for (auto name = vdb.beginName(); name != vdb.endName(); ++name) names.push_back(*name);
    std::sort(names.begin(), names.end());
    return names;
  }

  /// Runs the program, which must fail with status 2 and one line that contains all of `parts`.
  void expect_wrong_input(const std::vector<std::string>& arguments, const std::vector<std::string>& parts) const {
    const auto before = files();
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.status, 2) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    for (const std::string& part : parts) EXPECT_NE(outcome.error.find(part), std::string::npos) << outcome.error;
    EXPECT_EQ(files(), before);
  }
};

std::string text(const openvdb::MetaMap& metadata, const std::string& key) {
  return metadata.getMetadata<openvdb::StringMetadata>(key)->value();
}

TEST_F(Grids, DeriveMakesFloatGridsNamedByTheirInvariants) {
  std::vector<std::string> make{"make", "constant", "-o", "t.vdb", "--resolution", "9", "--tensor"};
  for (const char* number : {"3", "0", "0", "0", "1", "0", "0", "0", "-2"}) make.emplace_back(number);
  run_well(make);
  run_well({"derive", "t.vdb", "--invariant", "norm", "--invariant", "smallest_eigenvalue", "--invariant", "norm", "-o",
            "i.vdb"});
  EXPECT_EQ(grid_names("i.vdb"), (std::vector<std::string>{"norm", "smallest_eigenvalue"}));
  const auto norm = read_grid("i.vdb", "norm");
  EXPECT_EQ(norm->activeVoxelCount(), 729u);
  for (auto voxel = norm->cbeginValueOn(); voxel; ++voxel) ASSERT_NEAR(*voxel, std::sqrt(14.0), 1e-6);
  const auto smallest = read_grid("i.vdb", "smallest_eigenvalue");
  for (auto voxel = smallest->cbeginValueOn(); voxel; ++voxel) ASSERT_NEAR(*voxel, -2, 1e-6);

  openvdb::io::File vdb(in_folder("t.vdb").string());
  vdb.open();
  EXPECT_EQ(vdb.readGrid("constant_row0")->transform(), norm->transform());
}

TEST_F(Grids, DeriveTellsWhatThereIs) {
  EXPECT_NE(run_well({"derive", "--help"}).out.find("fractional_anisotropy"), std::string::npos);
  run_well({"make", "vortex", "-o", "t.vdb", "--resolution", "9"});
  expect_wrong_input({"derive", "t.vdb", "--invariant", "curl", "-o", "i.vdb"}, {"curl", "norm", "vorticity"});
  expect_wrong_input({"derive", "t.vdb", "--invariant", "norm", "-o", "t.vdb"},
                     {"-o (t.vdb)", "the same file as the field"});
  expect_wrong_input({"derive", "t.vdb", "--invariant", "norm", "-o", "i.nrrd"}, {".vdb"});
  expect_wrong_input({"derive", "t.vdb", "-o", "i.vdb"}, {"--invariant"});
  const Outcome other = run({"derive", "t.vdb", "--name", "stress", "--invariant", "norm", "-o", "i.vdb"});
  EXPECT_EQ(other.status, 1);
  EXPECT_NE(other.error.find("vortex"), std::string::npos) << other.error;
  EXPECT_EQ(files(), std::vector<std::string>{"t.vdb"});
}

TEST_F(Grids, FluenceIsAFogVolumeInTheFieldsVoxelsOfEachBandIfAsked) {
  write("scene.json", small_scene());
  const std::vector<std::string> command{
      "render", "scene.json", "-q", "--set", "output.fluence=f.vdb", "--set", "output.fluence_bands=true"};
  run_well(command);
  const std::vector<std::string> bands{"fluence_424nm", "fluence_511nm", "fluence_599nm", "fluence_686nm"};
  std::vector<std::string> all = bands;
  all.insert(all.begin(), "fluence");
  EXPECT_EQ(grid_names("f.vdb"), all);
  EXPECT_EQ(text(*read_grid("f.vdb", bands[1]), "tensorray:wavelength"), "511.25 nm");

  // The sum of the bands is all light.
  const auto together = read_grid("f.vdb", "fluence");
  EXPECT_EQ(together->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(together->evalActiveVoxelBoundingBox().dim().x(), 17);
  std::vector<openvdb::FloatGrid::Ptr> grids;
  std::vector<double> powers;
  double sum = 0;
  for (const std::string& band : bands) {
    grids.push_back(read_grid("f.vdb", band));
    powers.push_back(std::stod(text(*grids.back(), "tensorray:power")));
    sum += powers.back();
  }
  EXPECT_NEAR(sum, 1, 1e-5);
  for (auto voxel = together->cbeginValueOn(); voxel; ++voxel) {
    double expected = 0;
    for (std::size_t i = 0; i < grids.size(); ++i) expected += powers[i] * grids[i]->tree().getValue(voxel.getCoord());
    ASSERT_NEAR(*voxel, expected, 1e-4 * expected);
  }

  std::vector<std::string> rgb = command;
  rgb.insert(rgb.end(), {"--set", "bending.rgb=[0.1,0.2,0.3]"});
  run_well(rgb);
  EXPECT_EQ(grid_names("f.vdb"), (std::vector<std::string>{"fluence", "fluence_blue", "fluence_green", "fluence_red"}));
}

TEST_F(Grids, PythonReadsThem) {
  run_well({"make", "vortex", "-o", "t.vdb", "--resolution", "9"});
  run_well({"derive", "t.vdb", "--invariant", "vorticity", "-o", "i.vdb"});
  write("print.py",
        "try: import pyopenvdb as vdb\nexcept ImportError: import openvdb as vdb\n"
        "for file in ('t.vdb', 'i.vdb'):\n"
        "  grids, metadata = vdb.readAll(file)\n"
        "  print(*sorted(g.name for g in grids), grids[0].activeVoxelCount())\n");
  const std::string command = "cd '" + in_folder("").string() + "' && /usr/bin/python3 print.py >printed 2>/dev/null";
  if (std::system(command.c_str()) != 0) GTEST_SKIP() << "python3 has no OpenVDB (python3-openvdb)";
  EXPECT_EQ(read_file(in_folder("printed")), "vortex_row0 vortex_row1 vortex_row2 729\nvorticity 729\n");
}

}  // namespace
}  // namespace tensorray
