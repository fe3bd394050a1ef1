// EnSight's cases, as its manual describes them: Gold, in ASCII.

#include <tuple>

#include <fmt/format.h>
#include <sys/stat.h>
#include <vtkCellData.h>

#include "tests/import/imported.h"
#include "tests/import/vtk_files.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

std::string number(double value) { return fmt::format("{:12.5e}\n", value); }
std::string integer(int value) { return fmt::format("{:10}", value); }

/// Values of a variable: for each component, as many equal values as there are points or cells.
std::string variable(const std::string& of, int count, const std::vector<double>& components) {
  std::string text = "a variable\npart\n" + integer(1) + "\n" + of + "\n";
  for (const double component : components)
    for (int i = 0; i < count; ++i) text += number(component);
  return text;
}

/// One cube from 0 to 2 along each axis, with three tensors at two times.
void write_case(const std::filesystem::path& folder) {
  std::string geometry =
      "one\ncube\nnode id assign\nelement id assign\npart\n" + integer(1) + "\nbody\ncoordinates\n" + integer(8) + "\n";
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < 8; ++i) geometry += number(2 * (i >> axis & 1));
  geometry += "hexa8\n" + integer(1) + "\n";
  for (const int corner : {1, 2, 4, 3, 5, 6, 8, 7}) geometry += integer(corner);
  write_bytes(folder / "a.geo", geometry + "\n");
  for (const int time : {0, 1}) {
    const std::string name = "a." + std::to_string(time);
    const double t = 100 * time;
    write_bytes(folder / (name + ".sym"), variable("coordinates", 8, {t + 11, 22, 33, 12, 13, 23}));
    write_bytes(folder / (name + ".gen"), variable("coordinates", 8, {t + 11, 12, 13, 21, 22, 23, 31, 32, 33}));
    write_bytes(folder / (name + ".ele"), variable("hexa8", 1, {t + 11, 22, 33, 12, 13, 23}));
    write_bytes(folder / (name + ".vec"), variable("hexa8", 1, {t + 1, 2, 3}));
  }
  write_bytes(folder / "a.case",
              "# a comment\nFORMAT\ntype: ensight gold\n\nGEOMETRY\nmodel: a.geo\n\nVARIABLE\n"
              "tensor symm per node: 1 symmetric a.*.sym\ntensor asym per node: 1 general a.*.gen\n"
              "tensor symm per element: 1 of_cells a.*.ele\n"
              "vector per element: 1 velocity a.*.vec\n\nTIME\ntime set: 1\nnumber of steps: 2\n"
              "filename start number: 0\nfilename increment: 1\ntime values: 0.5 2.5\n");
}

Matrix3d tensor_of(const std::filesystem::path& path, const std::string& array, std::optional<int> step = {}) {
  const Imported found = imported(path, array_settings(array, Take::tensor, 2, step));
  EXPECT_EQ(found.voxels(), 8u);
  return found.tensor();
}

TEST(EnSight, TensorsHaveTheirOrderWithoutBeingTold) {
  const TemporaryFolder folder;
  write_case(folder);
  const Matrix3d symmetric = (Matrix3d() << 111, 12, 13, 12, 22, 23, 13, 23, 33).finished();
  const Matrix3d general = (Matrix3d() << 111, 12, 13, 21, 22, 23, 31, 32, 33).finished();
  EXPECT_LT((tensor_of(folder / "a.case", "symmetric") - symmetric).norm(), 1e-3);
  EXPECT_LT((tensor_of(folder / "a.case", "of_cells") - symmetric).norm(), 1e-3);
  EXPECT_LT((tensor_of(folder / "a.case", "general") - general).norm(), 1e-3);
  const auto read = read_vtk_source(folder / "a.case");
  const Vector3d velocity(read->GetCellData()->GetArray("velocity")->GetTuple3(0));
  EXPECT_LT((velocity - Vector3d(101, 2, 3)).norm(), 1e-3);
}

TEST(EnSight, NamesInQuotesMayHaveBlanks) {
  const TemporaryFolder folder;
  write_case(folder);
  const std::string sound = bytes_of(folder / "a.case");
  std::filesystem::create_directory(folder / "my data");
  std::filesystem::copy_file(folder / "a.geo", folder / "my data/the mesh.geo");
  for (const std::string time : {"0", "1"})
    std::filesystem::copy_file(folder / ("a." + time + ".gen"), folder / ("my data/the general." + time));
  for (const auto& [model, array, name, file] :
       {std::tuple("\"a.geo\"", "general", "general", "\"a.*.gen\""),
        {"\"my data/the mesh.geo\"", "\"my tensor\"", "my_tensor", "\"my data/the general.*\""}}) {
    write_bytes(folder / "a.case", replaced_text(replaced_text(sound, "a.geo", model), "general a.*.gen",
                                                 std::string(array) + "   " + file));
    EXPECT_EQ(time_steps(folder / "a.case"), 2);
    for (const int step : {0, 1}) EXPECT_NEAR(tensor_of(folder / "a.case", name, step)(0, 0), 100 * step + 11, 1e-4);
    EXPECT_THROW(tensor_of(folder / "a.case", name, 2), std::invalid_argument);
    EXPECT_NEAR(tensor_of(folder / "a.case", "symmetric")(0, 1), 12, 1e-4);
  }
  std::filesystem::remove(folder / "my data/the mesh.geo");
  EXPECT_THAT(read_error(folder / "a.case"), HasSubstr("the mesh.geo: is missing"));
}

/// VTK seeks the steps in all files of such a case, for ever in those without, and goes on for ever with some damaged
/// cases; it repeats the last number of a text that is cut off.
TEST(EnSight, StepsInOneFileAreRefusedWhereOthersHaveNoneAndDescriptionsAnnounceNothing) {
  const TemporaryFolder folder;
  write_case(folder);
  const std::string geometry = bytes_of(folder / "a.geo"), sound = bytes_of(folder / "a.case");
  const std::size_t third = geometry.find('\n', geometry.find('\n') + 1) + 1;
  write_bytes(folder / "a.geo", "point\n99999999 particles in the run\n" + geometry.substr(third));
  EXPECT_EQ(read_error(folder / "a.case"), "");
  write_bytes(folder / "a.case", replaced_text(sound, "1 symmetric a.*.sym", "1 1 symmetric a.sym") +
                                     "FILE\nfile set: 1\nnumber of steps: 2\n");
  std::string steps;
  for (const char* step : {"a.0.sym", "a.1.sym"})
    steps += "BEGIN TIME STEP\n" + bytes_of(folder / step) + "END TIME STEP\n";
  write_bytes(folder / "a.sym", steps);
  EXPECT_THAT(read_error(folder / "a.case"), HasSubstr("a.geo: has no steps of time"));
}

TEST(EnSight, WhatIsCutOffOrMissingIsNamed) {
  const TemporaryFolder folder;
  const auto error = [&] { return read_error(folder / "a.case", 1); };
  write_case(folder);
  const std::string sound = bytes_of(folder / "a.case");
  for (const char* section : {"VARIABLE", "GEOMETRY", "TIME"}) {
    write_bytes(folder / "a.case", replaced_text(sound, section, "V0R"));
    EXPECT_THAT(error(), HasSubstr("is neither a section of EnSight nor an entry: 'V0R'"));
  }
  write_bytes(folder / "a.case", sound);
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".case" || entry.path().extension() == ".geo") continue;
    const std::string text = bytes_of(entry.path());
    for (const std::size_t lines : {1u, 3u}) {
      std::size_t end = text.size() - 1;
      for (std::size_t i = 0; i < lines; ++i) end = text.rfind('\n', end - 1);
      write_bytes(entry.path(), text.substr(0, end + 1));
      if (error().empty()) continue;  // It is of another step.
      EXPECT_THAT(error(), HasSubstr(entry.path().filename().string() + ": is cut off"));
    }
    write_bytes(entry.path(), text);
  }
  EXPECT_EQ(error(), "");
  write_bytes(folder / "b.case", "no case\n");
  EXPECT_THAT(read_error(folder / "b.case"), HasSubstr("is not a case of EnSight"));
  std::filesystem::remove(folder / "a.geo");
  EXPECT_THAT(error(), HasSubstr("a.geo: is missing, which a.case names"));
  ASSERT_EQ(mkfifo((folder / "a.geo").c_str(), 0600), 0);  // To open a pipe takes for ever.
  EXPECT_THAT(error(), HasSubstr("a.geo: is a pipe or a device"));
}

}  // namespace
}  // namespace tensorray
