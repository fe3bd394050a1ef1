// An import that fails prints one line and changes no file.

#include <cstdlib>
#include <fstream>

#include "tests/program/import_support.h"

namespace tensorray {
namespace {

using ImportErrors = Import;

std::string array() { return npy("12, 14, 18", components(lattice.prod())); }
std::string image() { return vti(lattice, components(lattice.prod())); }

/// tests/import has the formats' own errors.
TEST_F(ImportErrors, FilesThatAreCutOffOrMissingOrSomethingElse) {
  write("half.npy", array().substr(0, 20000));
  write("half.vti", image().substr(0, 20000));
  for (const char* half : {"half.npy", "half.vti"}) refuses({half}, 1, {half, "cut off"});
  refuses({"missing.vti"}, 1, {"missing.vti", "does not exist"});
  refuses({"half.vti", "missing.q"}, 1, {"missing.q", "does not exist"});
  for (const char* pipe : {"pipe.vti", "pipe.npy", "pipe.vdb"}) {
    make_pipe(pipe);
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
  expect_error("-o (link.vdb) is the same file as the file to import", {"import", "field.vti", "-q", "-o", "link.vdb"},
               2);
  EXPECT_EQ(contents("field.vti"), image());
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
  write("array.npy", array());
  for (const char* const file : {"image.vti", "array.npy"})
    refuses({file, "--levels", "2"}, 2, {file, "--levels", "one size"});
  refuses({"image.vti", "--bounds", "1", "0", "0", "1", "0", "1"}, 2, {"--bounds"});
  refuses({"image.vti", "--origin", "0", "0", "0"}, 2, {"image.vti", "leave --origin out"});
  refuses({"image.vti", "--boundary", "body.stl"}, 2, {"--boundary", ".ply"});
  refuses({"image.vti", "-o", "image.txt"}, 2, {"--output"});
  refuses({"array.npy", "--resolution", "8"}, 2, {"array.npy", "--resolution"});
  refuses({"array.npy", "--memory", "-1"}, 2, {"--memory"});
  expect_error("missing", {"import", "image.vti", "-q", "-o", "missing/image.vdb"}, 1);
  // Numbers that OpenVDB refuses, or writes and does not read; and no voxels.
  refuses({"array.npy", "--voxel-size", "1e150"}, 1, {"array.npy", "1e-30"});
  refuses({"array.npy", "--origin", "1e20", "0", "0"}, 1, {"array.npy", "origin"});
  refuses({"image.vti", "--bounds", "50", "60", "50", "60", "50", "60"}, 2, {"--bounds"});
  refuses({"image.vti", "--resolution", "8", "--bounds", "50", "60", "50", "60", "50", "60"}, 2, {"--bounds"});
}

/// Options that take one number or three end where a word is none.
TEST_F(ImportErrors, NamesOfFilesAreNoNumbers) {
  write("image.vti", image());
  write("array.npy", array());
  const Arguments table[] = {{"import", "--resolution", "8", "image.vti", "-q", "-o", "a.vdb"},
                             {"import", "--resolution=8", "image.vti", "-q", "-o", "a.vdb"},
                             {"import", "--resolution", "8", "9", "8", "image.vti", "-q", "-o", "a.vdb"},
                             {"import", "-q", "-o", "a.vdb", "--voxel-size", "0.5", "--", "array.npy"},
                             {"import", "--voxel-size", "0.5", "0.5", "1", "array.npy", "-o", "a.vdb", "-q"},
                             {"info", "--voxel-size", "0.5", "array.npy", "--json"},
                             {"derive", "--voxel-size", "0.5", "array.npy", "--invariant", "trace", "-o", "a.vdb"},
                             {"make", "point_load", "--resolution", "8", "-o", "a.vdb"}};
  for (const Arguments& arguments : table) run_well(arguments);
  refuses({"--voxel-size", "0.5", "0.5", "array.npy"}, 2, {"--voxel-size", "one number, or three"});
  refuses({"--voxel-size", "array.npy"}, 2, {"array.npy is no size"});
  expect_error("missing.json", {"render", "-o", "a.png", "missing.json", "-q"});  // Not as another picture.
}

TEST_F(ImportErrors, AFullDiskLeavesWhatWasThere) {
  write("array.npy", array());
  write("old.vdb", " BDV, which was there before");
  expect_one_line(run({"import", "array.npy", "-q", "-o", "old.vdb"}, "ulimit -f 8; exec"), "", 1);
  EXPECT_EQ(contents("old.vdb"), " BDV, which was there before");
  EXPECT_THAT(files(), ElementsAre("array.npy", "old.vdb"));
}

TEST_F(ImportErrors, DataThatTheInputNamesAreNotReplaced) {
  const std::string numbers(9 * 8 * sizeof(float), 1);
  write("data.vdb", numbers);
  write("a.nhdr",
        "NRRD0004\ntype: float\ndimension: 4\nsizes: 9 2 2 2\nkinds: 3D-matrix space space space\nendian: little\n"
        "encoding: raw\ndata file: data.vdb\n");
  expect_error("data.vdb: is there, and is no OpenVDB file", {"import", "a.nhdr", "-o", "data.vdb"}, 2);
  EXPECT_TRUE(contents("data.vdb") == numbers);
  for (int i = 0; i < 2; ++i) run_well({"import", "a.nhdr", "-q", "-o", "b.vdb"});
}

constexpr std::size_t large_numbers = 128 * 128 * 128 * 9;

class ImportProcess : public Import {
 protected:
  /// A file of tensors: `header`, then numbers, then `footer`.
  void write_large(const std::string& name, const std::string& header, const std::string& footer = "") const {
    std::vector<float> quarter(large_numbers / 4);
    for (std::size_t i = 0; i < quarter.size(); ++i) quarter[i] = static_cast<float>(i * 2654435761u % 1024);
    std::ofstream file(in_folder(name), std::ios::binary);
    file << header;
    for (int i = 0; i < 4; ++i) file << bytes_of(quarter);
    file << footer;
  }

  /// The largest resident memory of any process of an import, bytes.
  double peak_bytes(const std::string& file) const {
    // The size that the system tells of a process includes what it was forked from: Python is smaller than this test.
    const Outcome outcome = run({"import", file, "-q", "-o", "field.vdb"}, R"(exec python3 -c '
import resource, subprocess, sys
status = subprocess.call(sys.argv[1:], stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(status)')");
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    const double kilobytes = std::strtod(outcome.out.c_str(), nullptr);
    EXPECT_GT(kilobytes, 0) << outcome.out;
    return 1024 * kilobytes;
  }

  /// An import to which something happens while its reader reads. One that was quicker is tried again.
  Outcome import_until(const std::function<void(pid_t program, pid_t reader)>& happen) const {
    write_large("large.npy", npy("128, 128, 128", {}));
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
  expect_one_line(import_until([](pid_t, pid_t reader) { kill(reader, SIGABRT); }),
                  "large.npy: reading it ended the reader", 1);
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
  write("small.npy", npy("2, 2, 2", components(8)));
  write("small.vti", vti({2, 2, 2}, components(8)));
  const double data = 4.0 * large_numbers;
  write_large("large.npy", npy("128, 128, 128", {}));
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
  const auto expect_same = [&](const Arguments& arguments) {
    run_well(joined({"import", "-q", "-o", "all.vdb"}, arguments));
    run_well(joined({"import", "-q", "-o", "part.vdb", "--memory", "64M"}, arguments));
    EXPECT_TRUE(is_equal("all.vdb", "part.vdb")) << arguments.front();
  };
  write("cube.npy", npy("40, 40, 40", components(40 * 40 * 40)));
  expect_same({"cube.npy"});
  write("cube.vti", image());
  expect_same({"cube.vti", "--resolution", "48"});
}

// Files that announce what they do not have, or that name pipes: one line, in a time that a user waits, and no more
// memory than there is.

class HostileFiles : public Import {
 protected:
  /// Expects an error of one line with the file's name and a part, of a process whose data may take 2 GB: more for the
  /// address sanitizer, which reserves terabytes.
  void refuses_soon(const std::string& name, const std::string& part = "") const {
    const Outcome outcome = run({"import", "-q", "-o", "f.vdb", name}, limit_);
    EXPECT_TRUE(outcome.status == 1 || outcome.status == 2) << name << ": " << outcome.status << outcome.error;
    for (const std::string& each : {name, part}) expect_one_line(outcome, each);
    EXPECT_FALSE(has("f.vdb"));
  }

 private:
#ifdef TENSORRAY_SANITIZED
  const std::string limit_ = "exec";
#else
  const std::string limit_ = "ulimit -d 2000000; exec";
#endif
};

std::string xml(const std::string& type, const std::string& inside, const std::string& attributes = "") {
  return fmt::format(R"(<?xml version="1.0"?><VTKFile type="{0}" version="1.0" byte_order="LittleEndian"
      header_type="UInt64"><{0}{2}>{1}</{0}></VTKFile>)",
                     type, inside, attributes);
}

std::string legacy(const std::string& data_set, const std::string& points) {
  return "# vtk DataFile Version 3.0\nx\nASCII\nDATASET " + data_set + "\n" + points;
}

const std::string legacy_image = "STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nORIGIN 0 0 0\nSPACING 1 1 1";
const std::string legacy_mesh = "UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1";

/// Files that name pipes or devices, that announce billions of numbers, points or cells in less than 2 kB, whose mesh
/// is implied, so that what looks at all its points would take days, or that grow when they are read.
TEST_F(HostileFiles, AreRefusedSoon) {
  make_pipe("pipe");
  const std::string numbers = "NRRD0004\ntype: float\ndimension: 4\nsizes: 6 2 2 2\nencoding: raw\nendian: little\n";
  for (const char* name : {"a.vti", "b.vti"})
    write(name, xml("ImageData", R"(<Piece Extent="0 99999 0 99999 0 99999"/>)",
                    R"( WholeExtent="0 99999 0 99999 0 99999" Origin="0 0 0" Spacing="1 1 1")"));
  const auto xdmf = [](const std::string& inside) { return "<Xdmf><Domain>" + inside + "</Domain></Xdmf>"; };
  const std::string grid = R"(<Grid><Topology TopologyType="3DCoRectMesh" Dimensions="100000 100000 100000"/>
      <Geometry GeometryType="ORIGIN_DXDYDZ"><DataItem Dimensions="3">0 0 0</DataItem>
      <DataItem Dimensions="3">1 1 1</DataItem></Geometry></Grid>)";
  std::string doubled;
  for (int i = 0; i < 26; ++i) {
    const std::string next = fmt::format("<xi:include xpointer=\"xpointer(//Grid[@Name='g{}'])\"/>", i + 1);
    doubled += fmt::format(R"(<Grid Name="g{}" GridType="Tree">{}{}</Grid>)", i, next, next);
  }
  doubled += R"(<Grid Name="g26" GridType="Uniform"></Grid>)";
  struct Case {
    const char *name, *part;
    std::string text;
  };
  const std::vector<Case> all{
      {"a.nhdr", "", numbers + "data file: pipe\n"},
      {"zero.nhdr", "", numbers + "line skip: 5\ndata file: /dev/zero\n"},
      {"a.vtm", "pipe", xml("vtkMultiBlockDataSet", R"(<DataSet index="0" file="pipe"/>)")},
      {"a.pvd", "pipe", xml("Collection", R"(<DataSet timestep="0" part="0" file="pipe"/>)")},
      {"a.pvti", "pipe",
       xml("PImageData", R"(<Piece Extent="0 1 0 1 0 1" Source="pipe"/>)", R"( WholeExtent="0 1 0 1 0 1")")},
      {"scalars.vtk", "",
       legacy(legacy_image, "POINT_DATA 8\nSCALARS s float 2000000000\nLOOKUP_TABLE default\n1 2 3\n")},
      {"array.vtk", "", legacy(legacy_image, "POINT_DATA 8\nFIELD f 1\na 2000000000 2000000000 float\n1 2 3\n")},
      {"cells.vtk", "", legacy(legacy_mesh, "CELLS 2000000000 2000000000\n4 0 1 2 3\n")},
      {"points.vtk", "", legacy("UNSTRUCTURED_GRID", "POINTS 2000000000 float\n0 0 0\n")},
      {"two.vtm", "",
       xml("vtkMultiBlockDataSet", R"(<DataSet index="0" file="a.vti"/><DataSet index="1" file="b.vti"/>)")},
      {"two.xdmf", "", xdmf(R"(<Grid GridType="Collection" CollectionType="Spatial">)" + grid + grid + "</Grid>")},
      {"doubled.xdmf", "", xdmf(doubled)},
      {"paths.xdmf", "",
       xdmf(repeated("<A>", 150) + R"(<DataItem Dimensions="1">1</DataItem>)" + repeated("</A>", 150) +
            R"(<Grid><Topology TopologyType="3DSMesh" Dimensions="2 2 2"/>
               <Geometry><DataItem Reference="//A//A//A//A//A//A//A//A"/></Geometry></Grid>)")}};
  for (const Case& each : all) {
    write(each.name, each.text);
    refuses_soon(each.name, each.part);
  }
}

TEST_F(HostileFiles, OfEnSight) {
  make_pipe("pipe");
  make_pipe("p.0001");
  write("a.geo", "text\n");
  const std::string format = "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: ";
  for (const std::string entry :
       {"pipe\n", "a.geo\nmeasured: pipe\n", "a.geo\nVARIABLE\ncomplex scalar per node: p a.geo pipe 1\n",
        "a.geo\nVARIABLE\nscalar per measured node: 1 p p.****\n"}) {
    write("a.case", format + entry);
    expect_error("a pipe or a device", {"import", "-q", "-o", "f.vdb", "a.case"}, 1);
  }
  const std::string head = "a\nb\nnode id off\nelement id off\npart\n1\nx\n";
  const std::string points = "coordinates\n8\n0\n1\n0\n1\n0\n1\n0\n1\n0\n0\n1\n1\n0\n0\n1\n1\n0\n0\n0\n0\n1\n1\n1\n1\n";
  write("a.case", format + "a.geo\n");
  for (const std::string count : {"coordinates\n2000000000\n", "hexa8\n1000000000\n", "nfaced\n2000000000\n",
                                  "block uniform\n1000000 1000000 1000000\n"}) {
    write("a.geo", head + (count[0] == 'h' || count[0] == 'n' ? points : "") + count + "0\n0\n0\n1\n1\n1\n");
    expect_error("tensorray: ", {"import", "-q", "-o", "f.vdb", "a.case"});
  }
  write("b.case", format + "a.geo\nTIME\ntime set: 1\nnumber of steps: 2000000000\n");
  refuses_soon("b.case", "million");
}

TEST_F(HostileFiles, PipesInCasesOfOpenFoam) {
  for (const std::string pipe : {"constant/polyMesh/boundary", "1/U", "1/lagrangian/cloud/positions"}) {
    for (const std::string name : {"system/controlDict", "constant/polyMesh/points", "constant/polyMesh/faces",
                                   "constant/polyMesh/owner", "constant/polyMesh/neighbour", "1/p"})
      write("case/" + name, "x");
    make_pipe("case/" + pipe);
    refuses_soon("case", pipe + ": is a pipe or a device");
    std::filesystem::remove_all(in_folder("case"));
  }
}

// Where `tensorray-import` is not built: all that needs no VTK works, and the rest says what to do.

TEST_F(Program, WithoutImportWhatNeedsItSaysHowToBuildIt) {
  std::filesystem::copy_file(TENSORRAY_BINARY, in_folder("alone"));  // Nothing lies beside it.
  write("scene.json", small_scene());
  write("a.vtu", "");
  write("lines.vtp", "<VTKFile/>");
  for (const std::string arguments :
       {"import a.vtu -o a.vdb",
        "render scene.json -q --set integrator.type=path_tracing --set integrator.paths=lines.vtp -o a.png"})
    expect_one_line(run_shell("./alone " + arguments), "`tools/setup release import`", 1);
  const Outcome outcome = run_shell("./alone render scene.json -q -o a.png -o photons.vtp");
  EXPECT_EQ(outcome.status, 0) << outcome.error;
  EXPECT_TRUE(has("a.png") && has("photons.vtp"));
}

}  // namespace
}  // namespace tensorray
