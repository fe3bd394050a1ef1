// OpenVDB files that are valid but unusual, made with OpenVDB itself.

#include <cmath>
#include <limits>
#include <regex>

#include <openvdb/openvdb.h>

#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

class OddFields : public Program {
 protected:
  using Rows = std::vector<openvdb::Vec3SGrid::Ptr>;

  /// The grids of the three rows of a field "T": a dense cube of `voxels`³.
  static Rows rows(int voxels) {
    Rows grids;
    for (int row = 0; row < 3; ++row) {
      auto grid = openvdb::Vec3SGrid::create();
      grid->setName("T_row" + std::to_string(row));
      openvdb::Vec3f value(0);
      value[row] = static_cast<float>(row + 1);
      if (voxels > 0) grid->denseFill({openvdb::Coord(0), openvdb::Coord(voxels - 1)}, value, true);
      grids.push_back(grid);
    }
    return grids;
  }

  void save(const openvdb::GridCPtrVec& grids) const { openvdb::io::File(in_folder("odd.vdb").string()).write(grids); }
  void save(const Rows& grids) const { save(openvdb::GridCPtrVec(grids.begin(), grids.end())); }

  Outcome render() const {
    write("scene.json", small_scene(R"({"file": "odd.vdb"})"));
    return run({"render", "scene.json", "--set", "light.direction=[1,2,-3]", "--stats", "stats.json"});
  }

  void expect_failure(const std::string& pattern) const {
    const Outcome outcome = render();
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(std::regex_search(outcome.error, std::regex(pattern))) << outcome.error << "\nexpected " << pattern;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    EXPECT_EQ(files(), (std::vector<std::string>{"odd.vdb", "scene.json"}));
  }

  void SetUp() override {
    openvdb::initialize();
    Program::SetUp();
  }
};

TEST_F(OddFields, NonFiniteVoxelsAreCountedAndLightGoesStraightThere) {
  Rows grids = rows(9);
  grids[0]->tree().setValue(openvdb::Coord(4, 4, 4), openvdb::Vec3f(std::nanf("")));
  grids[2]->tree().setValue(openvdb::Coord(2, 3, 4), openvdb::Vec3f(std::numeric_limits<float>::infinity()));
  save(grids);
  const Outcome outcome = render();
  EXPECT_EQ(outcome.status, 0) << outcome.error;
  EXPECT_TRUE(std::regex_search(outcome.error, std::regex("odd.vdb.*2 of 729 voxels are not finite"))) << outcome.error;
  EXPECT_EQ(read_json("stats.json")["field"]["non_finite_voxels"], 2);
  EXPECT_EQ(read_json("stats.json")["photons"]["stopped"]["degenerate"], 0);
}

TEST_F(OddFields, EmptyGrids) {
  save(rows(0));
  expect_failure("odd.vdb.*active voxel");
}

TEST_F(OddFields, AFlatFieldSeenEdgeOn) {
  Rows grids = rows(0);
  for (auto& grid : grids) grid->denseFill({openvdb::Coord(0), openvdb::Coord(5, 5, 0)}, openvdb::Vec3f(1), true);
  save(grids);
  EXPECT_EQ(render().status, 0);  // The field is one voxel thick; see TensorField::index_bounds.
}

TEST_F(OddFields, HugeValuesEndTheRayNotTheProgram) {
  Rows grids = rows(5);
  for (auto& grid : grids)
    grid->denseFill({openvdb::Coord(0), openvdb::Coord(4)}, openvdb::Vec3f(1e30f, -3e30f, 2e30f), true);
  save(grids);
  EXPECT_EQ(render().status, 0);
}

}  // namespace
}  // namespace tensorray
