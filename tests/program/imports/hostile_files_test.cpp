// Files that announce what they do not have, or that name pipes: one line, in a time that a user waits, and no more
// memory than there is.

#include <functional>

#include <sys/stat.h>

#include "tests/program/import_support.h"

namespace tensorray {
namespace {

using namespace test;

class HostileFiles : public Import {
 protected:
  /// A pipe that nobody writes to: to open it would wait for ever.
  void make_pipe(const std::string& name) const {
    std::filesystem::create_directories(in_folder(name).parent_path());
    ASSERT_EQ(mkfifo(in_folder(name).c_str(), 0600), 0);
  }

  void write_in_folders(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories(in_folder(name).parent_path());
    write(name, text);
  }

  /// Expects an error of one line with the file's name and a part, of a process whose data may take 2 GB: more for the
  /// address sanitizer, which reserves terabytes.
  void refuses_soon(const std::string& name, const std::string& part = "") const {
    const Outcome outcome = wait_for(start_in(limit_, {"import", "-q", "-o", "f.vdb", name}));
    EXPECT_TRUE(outcome.status == 1 || outcome.status == 2) << name << ": " << outcome.status << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    for (const std::string& each : {name, part})
      EXPECT_NE(outcome.error.find(each), std::string::npos) << name << outcome.error;
    EXPECT_FALSE(std::filesystem::exists(in_folder("f.vdb")));
  }

 private:
#ifdef TENSORRAY_SANITIZED
  const std::string limit_ = "exec";
#else
  const std::string limit_ = "ulimit -d 2000000; exec";
#endif
};

std::string xml(const std::string& type, const std::string& contents) {
  return "<?xml version=\"1.0\"?><VTKFile type=\"" + type +
         "\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">" + contents + "</VTKFile>";
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
  const std::string nrrd = "NRRD0004\ntype: float\ndimension: 4\nsizes: 6 2 2 2\nencoding: raw\nendian: little\n";
  const std::string huge =
      "<ImageData WholeExtent=\"0 99999 0 99999 0 99999\" Origin=\"0 0 0\" Spacing=\"1 1 1\">"
      "<Piece Extent=\"0 99999 0 99999 0 99999\"/></ImageData>";
  for (const char* name : {"a.vti", "b.vti"}) write(name, xml("ImageData", huge));
  const std::string grid =
      "<Grid><Topology TopologyType=\"3DCoRectMesh\" Dimensions=\"100000 100000 100000\"/><Geometry "
      "GeometryType=\"ORIGIN_DXDYDZ\"><DataItem Dimensions=\"3\">0 0 0</DataItem><DataItem Dimensions=\"3\">1 1 "
      "1</DataItem></Geometry></Grid>";
  std::string doubled, nested;
  for (int i = 0; i < 27; ++i) {
    const std::string next = fmt::format("<xi:include xpointer=\"xpointer(//Grid[@Name='g{}'])\"/>", i + 1);
    doubled += fmt::format("<Grid Name=\"g{}\" GridType=\"{}\">", i, i == 26 ? "Uniform" : "Tree") +
               (i == 26 ? "" : next + next) + "</Grid>";
  }
  for (int i = 0; i < 150; ++i) nested += "<A>";
  nested += "<DataItem Dimensions=\"1\">1</DataItem>";
  for (int i = 0; i < 150; ++i) nested += "</A>";
  struct Case {
    const char *name, *part;
    std::string text;
  };
  const std::vector<Case> all{
      {"a.nhdr", "", nrrd + "data file: pipe\n"},
      {"zero.nhdr", "", nrrd + "line skip: 5\ndata file: /dev/zero\n"},
      {"a.vtm", "pipe",
       xml("vtkMultiBlockDataSet",
           "<vtkMultiBlockDataSet><DataSet index=\"0\" file=\"pipe\"/></vtkMultiBlockDataSet>")},
      {"a.pvd", "pipe",
       xml("Collection", "<Collection><DataSet timestep=\"0\" part=\"0\" file=\"pipe\"/></Collection>")},
      {"a.pvti", "pipe",
       xml("PImageData",
           "<PImageData WholeExtent=\"0 1 0 1 0 1\"><Piece Extent=\"0 1 0 1 0 1\" Source=\"pipe\"/></PImageData>")},
      {"scalars.vtk", "",
       legacy(legacy_image, "POINT_DATA 8\nSCALARS s float 2000000000\nLOOKUP_TABLE default\n1 2 3\n")},
      {"array.vtk", "", legacy(legacy_image, "POINT_DATA 8\nFIELD f 1\na 2000000000 2000000000 float\n1 2 3\n")},
      {"cells.vtk", "", legacy(legacy_mesh, "CELLS 2000000000 2000000000\n4 0 1 2 3\n")},
      {"points.vtk", "", legacy("UNSTRUCTURED_GRID", "POINTS 2000000000 float\n0 0 0\n")},
      {"two.vtm", "",
       xml("vtkMultiBlockDataSet",
           "<vtkMultiBlockDataSet><DataSet index=\"0\" file=\"a.vti\"/><DataSet index=\"1\" file=\"b.vti\"/>"
           "</vtkMultiBlockDataSet>")},
      {"two.xdmf", "",
       "<Xdmf><Domain><Grid GridType=\"Collection\" CollectionType=\"Spatial\">" + grid + grid +
           "</Grid></Domain></Xdmf>"},
      {"doubled.xdmf", "", "<Xdmf><Domain>" + doubled + "</Domain></Xdmf>"},
      {"paths.xdmf", "",
       "<Xdmf><Domain>" + nested +
           "<Grid><Topology TopologyType=\"3DSMesh\" Dimensions=\"2 2 2\"/><Geometry><DataItem "
           "Reference=\"//A//A//A//A//A//A//A//A\"/></Geometry></Grid></Domain></Xdmf>"}};
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
    const Outcome outcome = run({"import", "-q", "-o", "f.vdb", "a.case"});
    EXPECT_EQ(outcome.status, 1) << entry;
    EXPECT_NE(outcome.error.find("a pipe or a device"), std::string::npos) << entry << outcome.error;
  }
  const std::string head = "a\nb\nnode id off\nelement id off\npart\n1\nx\n";
  const std::string points = "coordinates\n8\n0\n1\n0\n1\n0\n1\n0\n1\n0\n0\n1\n1\n0\n0\n1\n1\n0\n0\n0\n0\n1\n1\n1\n1\n";
  write("a.case", format + "a.geo\n");
  for (const std::string count : {"coordinates\n2000000000\n", "hexa8\n1000000000\n", "nfaced\n2000000000\n",
                                  "block uniform\n1000000 1000000 1000000\n"}) {
    write("a.geo", head + (count[0] == 'h' || count[0] == 'n' ? points : "") + count + "0\n0\n0\n1\n1\n1\n");
    const Outcome outcome = run({"import", "-q", "-o", "f.vdb", "a.case"});
    EXPECT_TRUE(outcome.status == 1 || outcome.status == 2) << count << outcome.status << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  }
  write("b.case", format + "a.geo\nTIME\ntime set: 1\nnumber of steps: 2000000000\n");
  refuses_soon("b.case", "million");
}

TEST_F(HostileFiles, PipesInCasesOfOpenFoam) {
  const auto is_refused = [&](const std::string& pipe) {
    write_in_folders("case/system/controlDict", "x");
    for (const char* name : {"points", "faces", "owner", "neighbour"})
      write_in_folders(std::string("case/constant/polyMesh/") + name, "x");
    write_in_folders("case/1/p", "x");
    make_pipe("case/" + pipe);
    refuses_soon("case", pipe + ": is a pipe or a device");
    std::filesystem::remove_all(in_folder("case"));
  };
  for (const char* pipe : {"constant/polyMesh/boundary", "1/U", "1/lagrangian/cloud/positions"}) is_refused(pipe);
}

}  // namespace
}  // namespace tensorray
