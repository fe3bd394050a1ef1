// Importing files of other programs: the whole way, and what the program reports of it. tests/import has the readers.

#include <cctype>
#include <cstdlib>
#include <iomanip>
#include <map>
#include <numeric>
#include <sstream>

#include "base/constants.h"
#include "tests/program/import_support.h"
#include "volumes/vdb/vdb_archive.h"

namespace tensorray {
namespace {

using testing::Key;

TEST_F(Import, PointLoadIsBoussinesqs) {
  const std::string file = data_file("pointload/pointload_32.vti");
  SKIP_WITHOUT(file);
  const json load = import({file}, "load");
  EXPECT_EQ(load["active_voxels"], 32 * 32 * 32);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(load["world_extent"]["min"][axis].get<double>(), -10, 1e-9);
    EXPECT_NEAR(load["world_extent"]["max"][axis].get<double>(), 10, 1e-9);
  }
  const TensorGrid grid = read_tensor_vdb(in_folder("load.vdb"));
  for (const TensorBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      const Vector3i index = block.origin + TensorBlock::position(offset);
      const Eigen::Matrix3f& stress = block.values[offset];
      const Vector3d r = grid.to_world * index.cast<double>() - Vector3d(0, 0, 10);
      const double pressed = 3 * 100 / (2 * pi) * std::pow(r.z(), 3) / std::pow(r.norm(), 5);
      ASSERT_NEAR(stress(2, 2), pressed, 1e-6 * (1 + std::abs(pressed)));  // r.z() <= 0: pressure is negative.
      ASSERT_NEAR(stress(0, 2) * r.z(), pressed * r.x(), 1e-5 * (1 + std::abs(pressed)));
    }
}

TEST_F(Import, BluntFinWhoseBoundaryLayerIsThinnerThanAVoxel) {
  const std::string folder = data_file("bluntfin");
  SKIP_WITHOUT(folder);
  // With a number of voxels for each axis, voxels are on the walls.
  const json fin = import({folder + "/bluntfinxyz.bin", folder + "/bluntfinq.bin", "--gradient-of", "velocity",
                           "--resolution", "100", "38", "26", "--levels", "1", "--boundary", "fin.ply"},
                          "fin");
  EXPECT_THAT(imported_.out, HasSubstr("peak 1942 ->"));
  const std::size_t median = imported_.out.find("median ");
  ASSERT_NE(median, std::string::npos) << imported_.out;
  EXPECT_NEAR(std::stod(imported_.out.substr(median + 7)), 6.49, 0.03);  // Some nodes have no gradient.
  EXPECT_EQ(std::count(imported_.error.begin(), imported_.error.end(), '\n'), 1) << imported_.error;
  EXPECT_THAT(imported_.error, HasSubstr("warning: the grid holds"));
  EXPECT_EQ(fin["index_extent"]["max"][0].get<int>() - fin["index_extent"]["min"][0].get<int>(), 99);
  EXPECT_NEAR(fin["asymmetry"].get<double>(), std::sqrt(2.0), 0.02);  // That of simple shear, as in boundary layers.
  EXPECT_LT(fin["norm"]["p100"], 1942.5);
  EXPECT_THAT(contents("fin.ply"), StartsWith("ply\n"));
  EXPECT_THAT(files(), ElementsAre("fin.ply", "fin.vdb"));
}

TEST_F(Import, HalfPrecisionIsTheUsersChoice) {
  write("array.npy", npy("12, 14, 18", components(lattice.prod())));
  const json whole = import({"array.npy"}, "whole"), half = import({"array.npy", "--half"}, "half");
  for (const json& each : {whole, half}) EXPECT_EQ(each["active_voxels"], lattice.prod());
  const double exact = whole["norm"]["p50"], rounded = half["norm"]["p50"];
  EXPECT_NE(rounded, exact);
  EXPECT_NEAR(rounded, exact, 1e-3 * exact);
}

TEST_F(Import, StepsOfTime) {
  OpenFoamCase::write(in_folder("case"));
  const auto steps = [&](const char* which, const char* output) {
    return run({"import", "case", "--array", "sigma", "--order", "vtk", "--resolution", "4", "-q", "--steps", which,
                "-o", output});
  };
  for (const auto& [which, output] :
       {std::pair("all", "all.##.vdb"), {"first", "first.vdb"}, {"last", "last.vdb"}, {"2", "second.vdb"}})
    EXPECT_EQ(steps(which, output).status, 0) << which;
  EXPECT_FALSE(has("all.03.vdb"));
  EXPECT_TRUE(is_equal("all.01.vdb", "first.vdb"));
  EXPECT_TRUE(is_equal("all.02.vdb", "last.vdb") && is_equal("second.vdb", "last.vdb"));
  EXPECT_FALSE(is_equal("first.vdb", "last.vdb"));
  for (const auto& [which, text] : {std::pair("3", "there are 2 steps"),
                                    {"0", "a number from 1 on"},
                                    {"some", "a number from 1 on"},
                                    {"all", "flow.####.vdb"}}) {
    expect_one_line(steps(which, "none.vdb"), text);
    EXPECT_FALSE(has("none.vdb"));
  }
}

// The scenes of imported data. Their comments have the command that imports the data. These tests run exactly that
// command on the data sets of TENSORRAY_DATA.

std::vector<std::filesystem::path> imported_scenes() {
  std::vector<std::filesystem::path> scenes;
  for (const auto& entry : std::filesystem::directory_iterator(source_folder() / "scenes" / "imported"))
    if (entry.path().extension() == ".json") scenes.push_back(entry.path());
  return scenes;
}

/// The words after `tensorray` in the comment of a scene. Lines that end with a backslash are joined with the next.
std::vector<std::string> import_command(const std::filesystem::path& scene) {
  std::istringstream lines(bytes_of(scene));
  std::string command;
  for (std::string line; std::getline(lines, line);) {
    if (command.empty() && line.find("tensorray import ") == std::string::npos) continue;
    const bool goes_on = line.back() == '\\';
    command += line.substr(2, line.size() - 2 - (goes_on ? 1 : 0)) + " ";
    if (!goes_on) break;
  }
  std::istringstream text(command.substr(std::min(command.size(), command.find("import"))));
  std::vector<std::string> words;
  for (std::string word; text >> std::quoted(word);) words.push_back(word);
  return words;
}

/// The path of a file of the data sets, by its name; empty if there is no such file.
std::string data_file(const std::string& name) {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(data_folder()))
    if (entry.path().filename() == name) return entry.path().string();
  return {};
}

class ImportedScene : public Program, public ::testing::WithParamInterface<std::filesystem::path> {};

TEST_P(ImportedScene, IsImportedAsItSaysAndBendsLight) {
  if (!std::filesystem::is_directory(data_folder()))
    GTEST_SKIP() << "no data sets at " << data_folder() << "; TENSORRAY_DATA says where they are";
  std::vector<std::string> command = import_command(GetParam());
  ASSERT_GE(command.size(), 4u) << "no import command in the scene's comment";
  for (std::string& word : command) {
    const std::filesystem::path path(word);
    if (path.parent_path() == "scenes/imported")
      word = path.filename().string();
    else if (path.has_extension() && word[0] != '-' && !std::isdigit(static_cast<unsigned char>(word[0])))
      word = data_file(word);
  }
  run_well(command);
  std::filesystem::copy_file(GetParam(), in_folder("scene.json"));
  Arguments smaller{"light.photons=2000", "receiver.resolution=[64,64]", "light.wavelengths.count=8",
                    "camera.resolution=[64,64]", "integrator.max_samples=4"};
  if (contents("scene.json").find("\"type\": \"scene\"") != std::string::npos)
    smaller.push_back("integrator.caustic.rays=20000");
  run_well(joined({"render", "scene.json", "-o", "out.exr"}, changes(smaller)));
  const std::vector<float> light = pixels("out.exr");
  EXPECT_TRUE(std::all_of(light.begin(), light.end(), [](float value) { return std::isfinite(value); }));
  EXPECT_GT(*std::max_element(light.begin(), light.end()), 0.5);
  EXPECT_GT(std::accumulate(light.begin(), light.end(), 0.0), 0);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ImportedScene, ::testing::ValuesIn(imported_scenes()),
                         [](const auto& scene) { return scene.param.stem().string(); });

// Grids for other OpenVDB programs: invariants, the light inside the volume, the stretch of neighbouring rays.

class Grids : public Program {
 protected:
  void SetUp() override { openvdb::initialize(); }

  /// The grids of a file by their names.
  std::multimap<std::string, openvdb::FloatGrid::Ptr> grids(const std::string& file) const {
    openvdb::io::File vdb(in_folder(file).string());
    vdb.open();
    const auto all = vdb.getGrids();
    std::multimap<std::string, openvdb::FloatGrid::Ptr> found;
    for (const auto& grid : *all) found.emplace(grid->getName(), openvdb::gridPtrCast<openvdb::FloatGrid>(grid));
    return found;
  }
};

TEST_F(Grids, DeriveMakesFloatGridsNamedByTheirInvariants) {
  run_well({"make", "constant", "-o", "t.vdb", "--resolution", "9", "--tensor", "3", "0", "0", "0", "1", "0", "0", "0",
            "-2"});
  run_well({"derive", "t.vdb", "--invariant", "norm", "--invariant", "smallest_eigenvalue", "--invariant", "norm", "-o",
            "i.vdb"});
  const auto derived = grids("i.vdb");
  ASSERT_THAT(derived, ElementsAre(Key("norm"), Key("smallest_eigenvalue")));
  for (const auto& [name, grid] : derived) {
    EXPECT_EQ(grid->activeVoxelCount(), 729u);
    EXPECT_NEAR(grid->cbeginValueOn().getValue(), name == "norm" ? std::sqrt(14.0) : -2, 1e-6) << name;
  }
}

TEST_F(Grids, DeriveTellsWhatThereIs) {
  EXPECT_THAT(run_well({"derive", "--help"}).out, HasSubstr("fractional_anisotropy"));
  run_well({"make", "vortex", "-o", "t.vdb", "--resolution", "9"});
  expect_error("fractional_anisotropy", {"derive", "t.vdb", "--invariant", "curl", "-o", "i.vdb"}, 2);
  expect_error("-o (t.vdb) is the same file as the input", {"derive", "t.vdb", "--invariant", "norm", "-o", "t.vdb"},
               2);
  expect_error(".vdb", {"derive", "t.vdb", "--invariant", "norm", "-o", "i.png"}, 2);
  expect_error("--invariant", {"derive", "t.vdb", "-o", "i.vdb"}, 2);
  expect_error("vortex", {"derive", "t.vdb", "--name", "stress", "--invariant", "norm", "-o", "i.vdb"}, 1);
}

TEST_F(Grids, FluenceIsAFogVolumeInTheFieldsVoxelsOfEachBandIfAsked) {
  write("scene.json", small_scene());
  const Arguments command =
      joined({"render", "scene.json", "-q"}, changes({"output.fluence=f.vdb", "output.fluence_bands=true"}));
  run_well(command);
  const auto fluence = grids("f.vdb");
  ASSERT_THAT(fluence, ElementsAre(Key("fluence"), Key("fluence_424nm"), Key("fluence_511nm"), Key("fluence_599nm"),
                                   Key("fluence_686nm")));
  EXPECT_EQ(fluence.find("fluence_511nm")->second->metaValue<std::string>("tensorray:wavelength"), "511.25 nm");
  double power = 0;
  for (const auto& [name, grid] : fluence)
    if (name != "fluence") power += std::stod(grid->metaValue<std::string>("tensorray:power"));
  EXPECT_NEAR(power, 1, 1e-5);
  const auto together = fluence.find("fluence")->second;
  EXPECT_EQ(together->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(together->evalActiveVoxelBoundingBox().dim().x(), 17);
  run_well(joined(command, changes({"bending.rgb=[0.1,0.2,0.3]"})));
  EXPECT_THAT(grids("f.vdb"),
              ElementsAre(Key("fluence"), Key("fluence_blue"), Key("fluence_green"), Key("fluence_red")));
}

TEST_F(Grids, PythonReadsThem) {
  run_well({"make", "vortex", "-o", "t.vdb", "--resolution", "9"});
  run_well({"derive", "t.vdb", "--invariant", "vorticity", "-o", "i.vdb"});
  write("print.py", R"(
try: import pyopenvdb as vdb
except ImportError: import openvdb as vdb
for file in ('t.vdb', 'i.vdb'):
  grids, metadata = vdb.readAll(file)
  print(*sorted(g.name for g in grids), grids[0].activeVoxelCount())
)");
  const Outcome printed = run_shell("/usr/bin/python3 print.py");
  if (printed.status != 0) GTEST_SKIP() << "python3 has no OpenVDB (python3-openvdb)";
  EXPECT_EQ(printed.out, "vortex_row0 vortex_row1 vortex_row2 729\nvorticity 729\n");
}

}  // namespace
}  // namespace tensorray
