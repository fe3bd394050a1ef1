// An import that fails prints one line and changes no file.

#include <functional>

#include <sys/stat.h>

#include "tests/program/import_support.h"

namespace tensorray {
namespace {

using namespace test;

using ImportErrors = Import;

std::string npy() { return npy_header("12, 14, 18, 3, 3") + bytes_of(lump_components()); }

std::string image() {
  return vti(lumps_size, Vector3d::Zero(), Vector3d::Ones(), Matrix3d::Identity(), lump_components());
}

/// tests/import has the formats' own errors.
TEST_F(ImportErrors, FilesThatAreCutOffOrMissingOrSomethingElse) {
  write("half.npy", npy().substr(0, 20000));
  write("half.vti", image().substr(0, 20000));
  for (const char* half : {"half.npy", "half.vti"}) refuses({half}, 1, {half, "cut off"});
  refuses({"missing.vti"}, 1, {"missing.vti", "does not exist"});
  refuses({"half.vti", "missing.q"}, 1, {"missing.q", "does not exist"});
  for (const char* pipe : {"pipe.vti", "pipe.npy", "pipe.vdb"}) {
    ASSERT_EQ(mkfifo(in_folder(pipe).c_str(), 0600), 0);
    refuses({pipe}, 1, {pipe, "is a pipe or a device"});
  }
  std::filesystem::create_directory(in_folder("folder"));
  refuses({"folder"}, 1, {"folder", "OpenFOAM"});
}

TEST_F(ImportErrors, OutputsThatAreInputsByALink) {
  write("field.vti", image());
  for (const char* link : {"link.vdb", "link.ply"})
    std::filesystem::create_symlink(in_folder("field.vti"), in_folder(link));
  refuses({"field.vti", "--boundary", "link.ply"}, 2,
          {"--boundary", "link.ply", "the same file as the file to import"});
  const auto before = files();
  const Outcome outcome = run({"import", "field.vti", "-q", "-o", "link.vdb"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.error.find("-o (link.vdb) is the same file as the file to import"), std::string::npos)
      << outcome.error;
  EXPECT_EQ(read_file(in_folder("field.vti")), image());
  EXPECT_EQ(files(), before);
}

TEST_F(ImportErrors, WrongArguments) {
  write("image.vti", image());
  refuses({"image.vti", "--array", "stress"}, 2, {"stress", "lumps (9 components"});
  refuses({"image.vti", "--gradient-of", "lumps"}, 2, {"lumps", "--gradient-of"});
  refuses({"image.vti", "--array", "lumps", "--gradient-of", "v"}, 2, {"--array", "--gradient-of"});
  refuses({"image.vti", "--order", "xyz"}, 2, {"--order", "vtk", "fsl", "mrtrix", "voigt"});
  refuses({"image.vti", "--voxel-size", "0"}, 2, {"--voxel-size"});
  refuses({"image.vti", "--voxel-size", "1", "2"}, 2, {"--voxel-size", "three"});
  refuses({"image.vti", "--voxel-size", "1", "2", "3"}, 2, {"image.vti", "--voxel-size", "one"});
  refuses({"image.vti", "--voxel-size", "1e-6"}, 2, {"--voxel-size", "limit"});
  refuses({"image.vti", "--resolution", "8", "8"}, 2, {"--resolution"});
  for (const char* const levels : {"0", "5", "many"})
    refuses({"image.vti", "--resolution", "8", "--levels", levels}, 2, {"--levels"});
  for (const char* const error : {"200%", "1.5", "x", "%"})
    refuses({"image.vti", "--resolution", "8", "--error", error}, 2, {"--error", "1%"});
  refuses({"image.vti", "--voxel-size", "1", "--finest", "2"}, 2, {"--finest", "--voxel-size"});
  refuses({"image.vti", "--resolution", "8", "--finest", "0.1"}, 2, {"--finest", "--resolution"});
  for (const char* const file : {"image.vti", "array.npy"})
    refuses({file, "--levels", "2"}, 2, {file, "--levels", "one size"});
  refuses({"image.vti", "--bounds", "1", "0", "0", "1", "0", "1"}, 2, {"--bounds"});
  refuses({"image.vti", "--boundary", "body.stl"}, 2, {"--boundary", ".ply"});
  refuses({"image.vti", "-o", "image.txt"}, 2, {"--output"});
  write("array.npy", npy());
  refuses({"array.npy", "--resolution", "8"}, 2, {"array.npy", "--resolution"});
  refuses({"array.npy", "--memory", "-1"}, 2, {"--memory"});
  const Outcome elsewhere = run({"import", "image.vti", "-q", "-o", "missing/image.vdb"});
  EXPECT_EQ(elsewhere.status, 1);
  EXPECT_NE(elsewhere.error.find("missing"), std::string::npos) << elsewhere.error;
}

/// Numbers that a file or a user may give, and that OpenVDB refuses, or writes and does not read; and no voxels.
TEST_F(ImportErrors, VoxelsThatAreNowhere) {
  write("array.npy", npy());
  write("image.vti", image());
  refuses({"array.npy", "--voxel-size", "1e150"}, 1, {"array.npy", "1e-30"});
  refuses({"array.npy", "--origin", "1e20", "0", "0"}, 1, {"array.npy", "origin"});
  refuses({"image.vti", "--bounds", "50", "60", "50", "60", "50", "60"}, 2, {"--bounds"});
  refuses({"image.vti", "--resolution", "8", "--bounds", "50", "60", "50", "60", "50", "60"}, 2, {"--bounds"});
}

TEST_F(ImportErrors, AFullDiskLeavesWhatWasThere) {
  write("array.npy", npy());
  write("old.vdb", " BDV, which was there before");
  const Outcome outcome = run({"import", "array.npy", "-q", "-o", "old.vdb"}, 16);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  EXPECT_EQ(read_file(in_folder("old.vdb")), " BDV, which was there before");
  EXPECT_EQ(files(), (std::vector<std::string>{"array.npy", "old.vdb"}));
}

/// Headers name their data by any name.
TEST_F(ImportErrors, DataThatTheInputNamesAreNotReplaced) {
  const std::string numbers(9 * 8 * sizeof(float), 1);
  write("data.vdb", numbers);
  write("a.nhdr",
        "NRRD0004\ntype: float\ndimension: 4\nsizes: 9 2 2 2\nkinds: 3D-matrix space space space\nendian: little\n"
        "encoding: raw\ndata file: data.vdb\n");
  const Outcome outcome = run({"import", "a.nhdr", "-o", "data.vdb"});
  EXPECT_EQ(outcome.status, 2) << outcome.error;
  EXPECT_NE(outcome.error.find("data.vdb: is there, and is no OpenVDB file"), std::string::npos) << outcome.error;
  EXPECT_TRUE(read_file(in_folder("data.vdb")) == numbers);
  run_well({"import", "a.nhdr", "-q", "-o", "b.vdb"});
  run_well({"import", "a.nhdr", "-q", "-o", "b.vdb"});
}

constexpr std::size_t large_numbers = 128 * 128 * 128 * 9;

class ImportProcess : public Import {
 protected:
  /// A file of tensors: `header`, then numbers, then `footer`.
  void write_large(const std::string& name, const std::string& header, const std::string& footer = "") const {
    std::ofstream file(in_folder(name), std::ios::binary);
    file << header;
    constexpr int slices = 4;
    std::vector<float> slice(large_numbers / slices);
    for (int z = 0; z < slices; ++z) {
      for (std::size_t i = 0; i < slice.size(); ++i) slice[i] = static_cast<float>((i * 2654435761u + 97u * z) % 1024);
      file << bytes_of(slice);
    }
    file << footer;
  }

  /// The largest resident memory of any process of an import, bytes.
  double peak_bytes(const std::string& file) const {
    // The size that the system tells of a process includes what it was forked from: Python is smaller than this test.
    const Outcome outcome = wait_for(start_in(R"(exec python3 -c '
import resource, subprocess, sys
status = subprocess.call(sys.argv[1:], stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(status)')",
                                              {"import", file, "-q", "-o", "field.vdb"}));
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    const double kilobytes = std::strtod(outcome.out.c_str(), nullptr);
    EXPECT_GT(kilobytes, 0) << outcome.out;
    return 1024 * kilobytes;
  }

  /// An import to which something happens while its reader reads. One that was quicker is tried again.
  Outcome import_until(const std::function<void(pid_t program, pid_t reader)>& happen) const {
    write_large("large.npy", npy_header("128, 128, 128, 3, 3"));
    while (true) {
      std::filesystem::remove(in_folder("field.vdb"));
      const pid_t program = start({"import", "large.npy", "-q", "-o", "field.vdb"});
      const std::string children = fmt::format("/proc/{0}/task/{0}/children", program);
      pid_t reader = 0;
      while (!(std::ifstream(children) >> reader) && is_running(program))
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (reader > 0) happen(program, reader);
      Outcome outcome = wait_for(program);
      if (outcome.status != 0) return outcome;
    }
  }
};

TEST_F(ImportProcess, AReaderThatCrashesIsOneLine) {
  if (!std::filesystem::exists(fmt::format("/proc/{0}/task/{0}/children", getpid())))
    GTEST_SKIP() << "this system does not tell a process's children";
  const Outcome outcome = import_until([](pid_t, pid_t reader) { kill(reader, SIGABRT); });
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.error.find("large.npy: reading it ended the reader"), std::string::npos) << outcome.error;
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  EXPECT_EQ(files(), std::vector<std::string>{"large.npy"});
}

TEST_F(ImportProcess, AnInterruptedImportLeavesNothing) {
  if (!std::filesystem::exists(fmt::format("/proc/{0}/task/{0}/children", getpid())))
    GTEST_SKIP() << "this system does not tell a process's children";
  const Outcome outcome = import_until([](pid_t program, pid_t) { kill(program, SIGINT); });
  EXPECT_EQ(outcome.status, 130);
  EXPECT_EQ(outcome.error, "tensorray: interrupted; nothing was written\n");
  EXPECT_EQ(files(), std::vector<std::string>{"large.npy"});
}

TEST_F(ImportProcess, TakesLessThanTwiceTheData) {
#ifdef TENSORRAY_SANITIZED
  GTEST_SKIP() << "the sanitizer's own memory is larger";
#endif
  write("small.npy", npy_header("2, 2, 2, 3, 3") + bytes_of(std::vector<float>(72, 1.0f)));
  write("small.vti",
        vti({2, 2, 2}, Vector3d::Zero(), Vector3d::Ones(), Matrix3d::Identity(), std::vector<float>(72, 1.0f)));
  const double data = 4.0 * large_numbers;
  write_large("large.npy", npy_header("128, 128, 128, 3, 3"));
  EXPECT_LT(peak_bytes("large.npy") - peak_bytes("small.npy"), 2 * data);
  std::string image =
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"><ImageData "
      "WholeExtent=\"0 127 0 127 0 127\" Origin=\"0 0 0\" Spacing=\"1 1 1\"><Piece Extent=\"0 127 0 127 0 127\">"
      "<PointData><DataArray type=\"Float32\" Name=\"T\" NumberOfComponents=\"9\" format=\"appended\" offset=\"0\"/>"
      "</PointData></Piece></ImageData><AppendedData encoding=\"raw\">_";
  image += bytes_of(std::vector<std::uint64_t>{4 * large_numbers});
  write_large("large.vti", image, "</AppendedData></VTKFile>");
  EXPECT_LT(peak_bytes("large.vti") - peak_bytes("small.vti"), 2 * data);
}

/// What is read, and what is made of it, is in files with `--memory`.
TEST_F(ImportProcess, OfWhatIsKeptInFilesGivesTheSameFile) {
  const auto expect_same = [&](const std::vector<std::string>& arguments) {
    std::vector<std::string> all = {"import", "-q", "-o", "all.vdb"},
                             part = {"import", "-q", "-o", "part.vdb", "--memory", "64M"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    part.insert(part.end(), arguments.begin(), arguments.end());
    run_well(all);
    run_well(part);
    EXPECT_TRUE(read_file(in_folder("all.vdb")) == read_file(in_folder("part.vdb"))) << arguments.front();
  };
  write("cube.npy", npy_header("40, 40, 40, 3, 3") + bytes_of(std::vector<float>(40 * 40 * 40 * 9, 1.0f)));
  expect_same({"cube.npy"});
  write("cube.vti", image());
  expect_same({"cube.vti", "--resolution", "48"});
}

}  // namespace
}  // namespace tensorray
