// ExodusII files whose writer was stopped, or which announce what they do not hold; and pieces of Nemesis.

#include <array>
#include <functional>
#include <limits>

#include <vtkDataSet.h>
#include <vtk_exodusII.h>
#include <vtk_netcdf.h>

#include "base/text/byte_order.h"
#include "tests/import/imported.h"
#include "tests/import/mesh_files.h"
#include "tools/import/cases/case_files.h"
#include "tools/import/vtk_source/vtk_source.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;
using FilePath = std::filesystem::path;

/// Of the nodes of a row of unit cubes from x = first on.
std::vector<double> coordinates(int nodes, int axis, int first = 0) {
  std::vector<double> x;
  for (int i = 0; i < nodes; ++i) x.push_back(axis == 0 ? first + i / 4 : axis == 1 ? i % 2 : i % 4 / 2);
  return x;
}

/// Of cells: their names, and their values at the first step.
using Variables = std::vector<std::pair<std::string, double>>;
const Variables of_stress{{"s_xx", 11}, {"s_yy", 22}, {"s_zz", 33}, {"s_xy", 12}, {"s_yz", 23}, {"s_xz", 13}};

/// A row of unit cubes from x = first on. At step k from 1 on, the gradient of v is k diag(1, 2, 3), and the variables
/// of all cells are k times those given. @param mode  EX_LARGE_MODEL or EX_NETCDF4.
void write_bar(const FilePath& path, int steps, const Variables& variables = of_stress, int mode = EX_LARGE_MODEL,
               int first = 0, int cubes = 2) {
  int word = 8, stored = 8;
  const int file = ex_create(path.c_str(), EX_CLOBBER | mode, &word, &stored), nodes = 4 * (cubes + 1);
  ASSERT_GE(file, 0);
  const std::vector<double> x[] = {coordinates(nodes, 0, first), coordinates(nodes, 1), coordinates(nodes, 2)};
  std::vector<int> corners;
  for (int cube = 0; cube < cubes; ++cube)
    for (const int corner : {1, 5, 6, 2, 3, 7, 8, 4}) corners.push_back(4 * cube + corner);
  ex_put_init(file, "bar", 3, nodes, cubes, 1, 0, 0);
  ex_put_coord(file, x[0].data(), x[1].data(), x[2].data());
  ex_put_block(file, EX_ELEM_BLOCK, 7, "HEX8", cubes, 8, 0, 0, 0);
  ex_put_conn(file, EX_ELEM_BLOCK, 7, corners.data(), nullptr, nullptr);
  const int count = static_cast<int>(variables.size());
  ex_put_variable_param(file, EX_NODAL, 3);
  ex_put_variable_param(file, EX_ELEM_BLOCK, count);
  for (int i = 0; i < 3; ++i) ex_put_variable_name(file, EX_NODAL, i + 1, std::array{"v_x", "v_y", "v_z"}[i]);
  for (int i = 0; i < count; ++i) ex_put_variable_name(file, EX_ELEM_BLOCK, i + 1, variables[i].first.c_str());
  ex_put_truth_table(file, EX_ELEM_BLOCK, 1, count, std::vector<int>(variables.size(), 1).data());
  for (int step = 1; step <= steps; ++step) {
    const double time = 0.5 * step;
    ex_put_time(file, step, &time);
    for (int i = 0; i < 3; ++i) {
      std::vector<double> values = x[i];
      for (double& value : values) value *= step * (i + 1);
      ex_put_var(file, step, EX_NODAL, i + 1, 1, nodes, values.data());
    }
    for (int i = 0; i < count; ++i) {
      const std::vector<double> values(cubes, step * variables[i].second);
      ex_put_var(file, step, EX_ELEM_BLOCK, i + 1, 7, cubes, values.data());
    }
  }
  ex_close(file);
}

void change(const FilePath& path, const std::function<void(int)>& act) {
  int file = 0;
  ASSERT_EQ(nc_open(path.c_str(), NC_WRITE, &file), NC_NOERR);
  act(file);
  nc_close(file);
}

/// Writes a value to all numbers of a variable at a step, from 1 on.
void fill(const FilePath& path, const std::string& name, std::size_t step, double value = NC_FILL_DOUBLE) {
  change(path, [&](int file) {
    int id = -1, rank = 0, dimensions[2];
    ASSERT_EQ(nc_inq_varid(file, name.c_str(), &id), NC_NOERR) << name;
    nc_inq_var(file, id, nullptr, nullptr, &rank, dimensions, nullptr);
    const std::size_t start[] = {step - 1, 0};
    std::size_t count[] = {1, 1};
    if (rank == 2) nc_inq_dimlen(file, dimensions[1], &count[1]);
    nc_put_vara_double(file, id, start, count, std::vector<double>(count[1], value).data());
  });
}

void set_aside(const FilePath& path, const std::string& name) {
  change(path, [&](int file) {
    int id = -1;
    nc_redef(file);
    ASSERT_EQ(nc_inq_varid(file, name.c_str(), &id), NC_NOERR) << name;
    EXPECT_EQ(nc_rename_var(file, id, "other"), NC_NOERR);
  });
}

/// Imports pieces of one mesh with voxels of 1/2.
Imported import(const std::vector<FilePath>& files, const std::string& array, Take take, std::optional<int> step = {}) {
  ImportSettings settings = array_settings(array, take, 0.5, step);
  settings.files = files;
  return imported(settings);
}

std::string refusal(const FilePath& path, const char* array, Take take) {
  return message([&] { import({path}, array, take); });
}

const char* const stress_list = "s_xx,s_yy,s_zz,s_xy,s_yz,s_xz";

/// Expects v and the stress of a step, from 1 on. @return the notes.
std::string expect_step(const FilePath& path, int step, std::optional<int> asked = {}) {
  const Matrix3d tensor = (Matrix3d() << 11, 12, 13, 12, 22, 23, 13, 23, 33).finished();
  const Matrix3d gradient = Vector3d(1, 2, 3).asDiagonal();
  const Imported v = import({path}, "v_", Take::gradient, asked), s = import({path}, stress_list, Take::tensor, asked);
  EXPECT_LT((v.tensor() - step * gradient).norm(), 1e-5) << path;
  EXPECT_LT((s.tensor() - step * tensor).norm(), 1e-4) << path;
  EXPECT_EQ(v.notes(), s.notes());
  return v.notes();
}

constexpr std::array modes{EX_LARGE_MODEL, EX_NETCDF4};

TEST(Exodus, TheLastCompleteStepIsTaken) {
  const TemporaryFolder folder;
  const FilePath path = folder / "a.e";
  struct Row {
    const char* name;
    int last;  ///< Complete step of four.
    std::function<void()> spoil;
    const char* words;
  };
  const Row table[] = {{"nothing", 4, [] {}, "; --steps chooses another one"},
                       {"its time", 3, [&] { fill(path, "time_whole", 4); }, "its time was not written"},
                       {"a time of zero", 3, [&] { fill(path, "time_whole", 4, 0); }, "its time"},
                       {"nodes", 3, [&] { fill(path, "vals_nod_var2", 4); }, "was not written"},
                       {"cells", 3, [&] { fill(path, "vals_elem_var3eb1", 4); }, "\"s_zz\" was not written"},
                       {"two steps", 2,
                        [&] {
                          fill(path, "vals_nod_var1", 3);
                          fill(path, "time_whole", 4);
                        },
                        "its time"}};
  for (const int mode : modes)
    for (const Row& row : table) {
      write_bar(path, 4, of_stress, mode);
      row.spoil();
      const std::string notes = expect_step(path, row.last);
      EXPECT_THAT(notes, HasSubstr("step " + std::to_string(row.last) + " of 4 is taken")) << row.name;
      if (row.last == 4) continue;
      EXPECT_THAT(notes, HasSubstr(row.words)) << row.name;
      const std::string asked = error_of([&] { import({path}, "v_", Take::gradient, 3); });
      EXPECT_THAT(asked, AllOf(HasSubstr("a.e: step 4 of 4 is not complete: "), HasSubstr("--steps"))) << row.name;
      EXPECT_EQ(expect_step(path, 1, 0), "");
    }
}

/// The same variable may be missing at every step, and an only step may have no time.
TEST(Exodus, FillValuesAreHoles) {
  const TemporaryFolder folder;
  write_bar(folder / "a.e", 1);
  fill(folder / "a.e", "time_whole", 1);
  EXPECT_EQ(expect_step(folder / "a.e", 1), "");
  fill(folder / "a.e", "vals_nod_var1", 1);
  EXPECT_THAT(refusal(folder / "a.e", "v_", Take::gradient), HasSubstr("have NaN or infinite tensors"));
  EXPECT_GT(import({folder / "a.e"}, stress_list, Take::tensor).voxels(), 0u);
}

TEST(Exodus, VariablesThatAreNotThereAreLeftOut) {
  const TemporaryFolder folder;
  const FilePath path = folder / "a.e";
  const auto left_out = [](const char* name) { return AllOf(HasSubstr("no array"), HasSubstr(name)); };
  write_bar(path, 2);
  set_aside(path, "vals_nod_var2");
  EXPECT_THAT(refusal(path, "v_", Take::gradient), left_out("left out: \"v_y\""));
  EXPECT_NEAR(import({path}, stress_list, Take::tensor).tensor()(0, 0), 22, 1e-4);
  write_bar(path, 2);
  set_aside(path, "vals_elem_var2eb1");
  EXPECT_THAT(refusal(path, stress_list, Take::tensor), left_out("left out: \"s_yy\""));
  EXPECT_NEAR(import({path}, "v_", Take::gradient).tensor()(1, 1), 4, 1e-4);
  write_bar(path, 2);
  set_aside(path, "vals_nod_var2");
  change(path, [](int file) {  // As numbers of other nodes, of which the reader would read the first ones.
    int id = 0, dimensions[2];
    nc_redef(file);
    nc_inq_varid(file, "other", &id);
    nc_inq_vardimid(file, id, dimensions);
    nc_def_dim(file, "more", 100, &dimensions[1]);
    nc_def_var(file, "vals_nod_var2", NC_DOUBLE, 2, dimensions, &id);
  });
  EXPECT_THAT(refusal(path, "v_", Take::gradient), left_out("left out: \"v_y\""));
  write_bar(path, 2);
  change(path, [](int file) {  // As meshio writes it: the form of coordinates is one, that of variables another.
    int id = 0, dimensions[2];
    nc_redef(file);
    nc_del_att(file, NC_GLOBAL, "file_size");
    nc_inq_dimid(file, "num_dim", &dimensions[0]);
    nc_inq_dimid(file, "num_nodes", &dimensions[1]);
    nc_def_var(file, "coord", NC_DOUBLE, 2, dimensions, &id);
    nc_enddef(file);
    std::vector<double> x;
    for (const int axis : {0, 1, 2})
      for (const double value : coordinates(12, axis)) x.push_back(value);
    nc_put_var_double(file, id, x.data());
  });
  EXPECT_THAT(refusal(path, "v_", Take::gradient), left_out("meshio convert a.e FILE.vtu"));
}

/// In alphabetical order, as MOOSE writes them; VTK joins those that it can.
TEST(Exodus, VariablesKeepTheirNames) {
  const TemporaryFolder folder;
  const FilePath six = folder / "six.e", nine = folder / "nine.e";
  write_bar(six, 1, {{"t_xx", 1}, {"t_xy", 0.2}, {"t_xz", 0.3}, {"t_yy", 2}, {"t_yz", 0.4}, {"t_zz", 3}});
  Variables rows;
  for (int i = 0; i < 9; ++i) rows.emplace_back(std::string("t_") + "xyz"[i / 3] + "xyz"[i % 3], i + 1);
  write_bar(nine, 1, rows);
  const Matrix3d of_six = (Matrix3d() << 1, 0.2, 0.3, 0.2, 2, 0.4, 0.3, 0.4, 3).finished();
  const Matrix3d of_nine = (Matrix3d() << 1, 2, 3, 4, 5, 6, 7, 8, 9).finished();
  const Matrix3d upper = (Matrix3d() << 1, 2, 3, 2, 5, 6, 3, 6, 9).finished();
  struct Row {
    FilePath file;
    const char* list;
    Matrix3d tensor;
    std::optional<TensorOrder> order = {};
  };
  for (const Row& row : {Row{six, "t_xx,t_yy,t_zz,t_xy,t_yz,t_xz", of_six},
                         {six, "t_xx,t_xy,t_xz,t_yy,t_yz,t_zz", of_six},
                         {nine, "t_x, t_y, t_z", of_nine},
                         {nine, "t_xx,t_xy,t_xz,t_yx,t_yy,t_yz,t_zx,t_zy,t_zz", of_nine},
                         {nine, "t_x:0,t_y:1,t_z:2,t_x:1,t_y:2,t_x:2", upper, TensorOrder::vtk},
                         {nine, "t_x:t_xx,t_y:t_yy,t_z:t_zz,t_x:t_xy,t_y:t_yz,t_x:t_xz", upper}}) {
    ImportSettings settings = array_settings(row.list);
    settings.order = row.order;
    EXPECT_LT((imported(row.file, settings).tensor(1e-6) - row.tensor).norm(), 1e-6) << row.list;
  }
  EXPECT_THAT([&] { import({nine}, "t_x:3,t_y,t_z", Take::tensor); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("no array \"t_x:3\"")));
}

TEST(Exodus, PiecesOfNemesisAreOneMesh) {
  const TemporaryFolder folder;
  const FilePath first = folder / "out.e.2.0", second = folder / "out.e.2.1";
  for (const int mode : modes) {
    write_bar(first, 3, of_stress, mode, 0, 2);
    write_bar(second, 3, of_stress, mode, 2, 3);
    for (const std::vector<FilePath>& files : {std::vector{first}, {second}, {first, second}, {second, first}}) {
      const Imported all = import(files, "v_", Take::gradient);
      EXPECT_EQ(all.report.mesh_cells, 5u);
      EXPECT_EQ(all.voxels(), 11u * 3 * 3);
      EXPECT_NEAR(all.tensor()(2, 2), 9, 1e-5);
      EXPECT_THAT(all.notes(), HasSubstr("one of 2 pieces of a mesh (Nemesis): all are read"));
    }
    EXPECT_EQ(read_vtk_source(first)->GetNumberOfPoints(), 24);  // Those between both are the same.
  }
  write_bar(second, 2, of_stress, EX_LARGE_MODEL, 2, 3);
  EXPECT_THAT(expect_step(first, 2), HasSubstr("step 2 of 3 is taken"));
  std::filesystem::remove(second);
  EXPECT_THAT(error_of([&] { import({first}, "v_", Take::gradient); }),
              HasSubstr("of which are missing: out.e.2.1; copy"));
  write_bar(folder / "out.e.12.07", 1);
  EXPECT_THAT(error_of([&] { import({folder / "out.e.12.07"}, "v_", Take::gradient); }),
              HasSubstr("of which are missing: out.e.12.00 out.e.12.01"));
  write_bar(folder / "run.2.5.e", 1);  // No piece.
  EXPECT_EQ(import({folder / "run.2.5.e"}, "v_", Take::gradient).report.mesh_cells, 2u);
}

/// A header of version 5, with 64-bit lengths: one dimension, no attribute, one variable of doubles, whose last one
/// ends at byte 280.
struct Cdf5 {
  std::uint64_t records = 0, name_length = 1, dimension = 10, attributes = 0, begin = 200;

  std::string bytes() const {
    std::string bytes = "CDF\5";
    const auto put = [&](auto... numbers) { (append_number(numbers, ByteOrder::big, bytes), ...); };
    const std::uint64_t none = 0, one = 1, size = 80;
    const std::uint32_t name = 'x' << 24, dimensions = 10, variables = 11, has_attributes = attributes > 0 ? 12 : 0;
    put(records, dimensions, one, name_length, name, dimension, has_attributes, attributes);
    // Its one dimension is the first, and it has no attributes; 6 are doubles.
    put(variables, one, one, name, one, none, 0u, none, 6u, size, begin);
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
