// Datasets whose numbers are elsewhere, or were never written: HDF5 itself reads zeros.

#include "tools/import/hdf5/hdf5_file.h"

#include <functional>

#include <gmock/gmock.h>
#include <vtkDataArray.h>
#include <vtkSmartPointer.h>

#include "tests/import/hdf5_writer.h"
#include "tests/import/mesh_files.h"

namespace tensorray {
namespace {

using testing::HasSubstr;

constexpr hsize_t count = 6;

/// Makes a dataset of six doubles, for which `set` has set the properties. @return whether it was made.
bool make(const std::filesystem::path& path, const std::string& name, const std::function<void(hid_t)>& set,
          const std::vector<double>& first = {}) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), space = H5Screate_simple(1, &count, nullptr),
              properties = H5Pcreate(H5P_DATASET_CREATE);
  set(properties);
  const hid_t data = H5Dcreate2(file, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, properties, H5P_DEFAULT);
  const hsize_t zero = 0, some = first.size();
  if (some > 0) {
    const hid_t memory = H5Screate_simple(1, &some, nullptr);
    H5Sselect_hyperslab(space, H5S_SELECT_SET, &zero, nullptr, &some, nullptr);
    EXPECT_GE(H5Dwrite(data, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, first.data()), 0);
    H5Sclose(memory);
  }
  H5Dclose(data);
  H5Pclose(properties);
  H5Sclose(space);
  H5Fclose(file);
  return data >= 0;
}

TEST(Hdf5File, NumbersThatAreElsewhereOrNowhere) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "a.h5";
  const std::vector<double> numbers{1, 2, 3, 4, 5, 6};
  { Hdf5Writer(folder / "source.h5").write("/there", {count}, numbers); }
  { Hdf5Writer(folder / "source.h5.unwritten").announce("/there", {count}); }
  write_bytes(folder / "raw.bin", std::string(reinterpret_cast<const char*>(numbers.data()), 8 * count));
  write_bytes(folder / "cut.bin", "12345678");
  {
    Hdf5Writer file(path);
    file.write("/own", {count}, numbers);
    file.write("/zeros", {count}, std::vector<double>(count, 0));
    file.announce("/announced", {count});
  }
  const auto virtual_of = [](const char* file, const char* source) {
    return [file, source](hid_t properties) {
      const hid_t space = H5Screate_simple(1, &count, nullptr);
      H5Pset_virtual(properties, space, file, source, space);
      H5Sclose(space);
    };
  };
  const auto external = [](const char* file) {
    return [file](hid_t properties) { H5Pset_external(properties, file, 0, 8 * count); };
  };
  const auto chunked = [](hid_t properties) {
    const hsize_t three = 3;
    H5Pset_chunk(properties, 1, &three);
  };
  struct Row {
    const char* name;
    std::function<void(hid_t)> set;
    const char* error;  ///< Empty: the numbers are read.
  };
  const Row table[] = {
      {"/own", nullptr, ""},
      {"/zeros", nullptr, ""},
      {"/announced", nullptr, "a.h5: its dataset /announced was announced, and not written"},
      {"/v", virtual_of("source.h5", "/there"), ""},
      {"/v_own", virtual_of(".", "/own"), ""},
      {"/v_of_v", virtual_of(".", "/v"), ""},
      {"/v_file", virtual_of("gone.h5", "/there"),
       "its dataset /v_file is virtual, and its source is the file gone.h5"},
      {"/v_of_v_file", virtual_of(".", "/v_file"), "gone.h5, which is missing"},
      {"/v_data", virtual_of("source.h5", "/gone"), "source.h5, which has no dataset /gone"},
      {"/v_unwritten", virtual_of("source.h5.unwritten", "/there"), "dataset /there was announced, and not written"},
      {"/v_itself", virtual_of(".", "/v_itself"), "refers to itself"},
      {"/e", external("raw.bin"), ""},
      {"/e_gone", external("gone.bin"), "its dataset /e_gone are in the file gone.bin, which is missing"},
      {"/e_cut", external("cut.bin"), "cut.bin, which is missing or cut off"},
      {"/chunks", chunked, "/chunks was announced, and not written"}};
  for (const Row& row : table) {
    EXPECT_TRUE(!row.set || make(path, row.name, row.set)) << row.name;
    const std::string error = error_of([&] {
      const auto read = Hdf5File(path).read(row.name);
      for (vtkIdType i = 0; i < read->GetNumberOfTuples(); ++i)
        EXPECT_EQ(read->GetComponent(i, 0), row.name == std::string("/zeros") ? 0 : 1 + i) << row.name;
    });
    EXPECT_THAT(error, HasSubstr(row.error)) << row.name;
    EXPECT_EQ(error.empty(), row.error[0] == '\0') << error;
  }
}

/// Of a part, as of a step, its own chunks count: also zeros that were written.
TEST(Hdf5File, PartsThatWereNotWritten) {
  const TemporaryFolder folder;
  { Hdf5Writer file(folder / "a.h5"); }
  const auto two = [](hid_t properties) {
    const hsize_t chunk = 2;
    H5Pset_chunk(properties, 1, &chunk);
  };
  ASSERT_TRUE(make(folder / "a.h5", "/x", two, {0, 0, 0}));
  const Hdf5File file(folder / "a.h5");
  const auto error = [&](std::uint64_t start, std::uint64_t size) {
    return error_of([&] { file.read("/x", {{start}, {1}, {size}}); });
  };
  for (const std::uint64_t start : {0, 1, 2, 3}) EXPECT_EQ(error(start, 2), "") << start;
  EXPECT_THAT(error(4, 2), HasSubstr("/x was announced, and not written"));
  EXPECT_THAT(error(5, 1), HasSubstr("/x was announced, and not written"));
  EXPECT_EQ(error(0, 6), "");
}

TEST(Hdf5File, LinksToOtherFiles) {
  const TemporaryFolder folder;
  { Hdf5Writer(folder / "source.h5").write("/there/x", {1}, std::vector<double>{7}); }
  { Hdf5Writer file(folder / "a.h5"); }
  const hid_t id = H5Fopen((folder / "a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Lcreate_external("source.h5", "/there", id, "/good", H5P_DEFAULT, H5P_DEFAULT);
  H5Lcreate_external("gone.h5", "/there", id, "/group", H5P_DEFAULT, H5P_DEFAULT);
  H5Lcreate_external("gone.h5", "/there/x", id, "/x", H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(id);
  const Hdf5File file(folder / "a.h5");
  EXPECT_EQ(file.read("/good/x")->GetComponent(0, 0), 7);
  for (const char* name : {"/group/x", "/x"})
    EXPECT_THAT(error_of([&] { file.read(name); }), HasSubstr("in the file gone.h5, which is missing")) << name;
  EXPECT_THAT(error_of([&] { file.read("/none"); }), HasSubstr("has no dataset /none"));
}

}  // namespace
}  // namespace tensorray
