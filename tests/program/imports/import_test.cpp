// Importing files of other programs: the whole way, and what the program reports of it. tests/import has the readers.

#include <cctype>
#include <cstdlib>
#include <iomanip>
#include <limits>
#include <regex>
#include <sstream>

#include "base/constants.h"
#include "renderer/images/image.h"
#include "tests/data_folder.h"
#include "tests/program/import_support.h"
#include "tests/program/support.h"
#include "volumes/vdb/vdb_archive.h"

namespace tensorray {
namespace {

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
                           "--resolution", "100", "38", "26", "--levels", "1", "--boundary", "fin.ply"},
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
    expect_one_line(steps(which, "none.vdb"), text);
    EXPECT_FALSE(std::filesystem::exists(in_folder("none.vdb")));
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
  std::istringstream lines(read_file(scene));
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
  std::vector<std::string> render{"render", "scene.json", "-o", "out.exr"};
  std::vector<std::string> small{"light.photons=2000", "receiver.resolution=[64,64]", "light.wavelengths.count=8",
                                 "camera.resolution=[64,64]", "integrator.max_samples=4"};
  if (read_file(GetParam()).find("\"type\": \"scene\"") != std::string::npos)
    small.push_back("integrator.caustic.rays=20000");
  for (const std::string& change : small) render.insert(render.end(), {"--set", change});
  run_well(render);
  const Image image = read_image(in_folder("out.exr"));
  double sum = 0, greatest = 0;
  for (const float value : image.pixels) {
    ASSERT_TRUE(std::isfinite(value));
    greatest = std::max<double>(greatest, value);
    sum += value;
  }
  EXPECT_GT(greatest, 0.5);
  EXPECT_GT(sum, 0);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ImportedScene, ::testing::ValuesIn(imported_scenes()),
                         [](const auto& scene) { return scene.param.stem().string(); });

// OpenVDB files that are valid but unusual, made with OpenVDB itself.

class OddFields : public Program {
 protected:
  using Rows = std::vector<openvdb::Vec3SGrid::Ptr>;

  /// The grids of the three rows of a field "T": a dense cube of `voxels`³.
  static Rows rows(int voxels) {
    Rows grids;
    for (int row = 0; row < 3; ++row) {
      auto grid = empty_grid<openvdb::Vec3SGrid>();
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

TEST_F(OddFields, OneVoxelThickOrHugeAreRenderedAndEmptyOnesAreNot) {
  save(rows(0));
  expect_one_line(render(), "active voxel", 1);
  EXPECT_EQ(files(), (std::vector<std::string>{"odd.vdb", "scene.json"}));
  Rows flat = rows(0), huge = rows(0);
  for (std::size_t row = 0; row < 3; ++row) {
    flat[row]->denseFill({openvdb::Coord(0), openvdb::Coord(5, 5, 0)}, openvdb::Vec3f(1), true);
    huge[row]->denseFill({openvdb::Coord(0), openvdb::Coord(4)}, openvdb::Vec3f(1e30f, -3e30f, 2e30f), true);
  }
  for (const Rows& grids : {flat, huge}) {  // Of the flat one, see TensorField::index_bounds.
    save(grids);
    EXPECT_EQ(render().status, 0);
  }
}

// Grids for other OpenVDB programs: invariants, the light inside the volume, the stretch of neighbouring rays.

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
  expect_error("fractional_anisotropy", {"derive", "t.vdb", "--invariant", "curl", "-o", "i.vdb"}, 2);
  expect_error("-o (t.vdb) is the same file as the input", {"derive", "t.vdb", "--invariant", "norm", "-o", "t.vdb"},
               2);
  expect_error(".vdb", {"derive", "t.vdb", "--invariant", "norm", "-o", "i.png"}, 2);
  expect_error("--invariant", {"derive", "t.vdb", "-o", "i.vdb"}, 2);
  expect_error("vortex", {"derive", "t.vdb", "--name", "stress", "--invariant", "norm", "-o", "i.vdb"}, 1);
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
