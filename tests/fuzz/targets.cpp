#include "tests/fuzz/targets.h"

#include <cstdint>
#include <fstream>
#include <new>
#include <sstream>
#include <stdexcept>

#include <fcntl.h>
#include <sys/mman.h>

#include "base/files/descriptor.h"
#include "base/files/temporary_folder.h"
#include "base/process/archive.h"
#include "base/text/path_text.h"
#include "integrators/methods/read_scene.h"
#include "integrators/path_files/path_files.h"
#include "integrators/photon_distribution/photon_chunks.h"
#include "integrators/seeds/seeds.h"
#include "renderer/color/file_colors.h"
#include "renderer/images/formats.h"
#include "renderer/meshes/mesh_readers.h"
#include "renderer/spectra/spectrum.h"
#include "scenes/jobs/work_file.h"
#include "scenes/keys/json_reader.h"
#include "scenes/source/overrides.h"
#include "tools/import/cases/case_files.h"
#include "tools/import/hdf5/xdmf_document.h"
#include "tools/import/lattice_files/lattice_files.h"
#include "tools/import/vtk/vtk_messages.h"
#include "volumes/vdb/vdb_tree_check.h"

namespace tensorray::test {
namespace {

/// A file in memory, with a path.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& bytes) : file_(memfd_create("fuzz", MFD_CLOEXEC)) {
    if (!write_whole(file_.get(), bytes)) throw std::bad_alloc();
  }
  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(file_.get()); }

 private:
  Descriptor file_;
};

/// Calls `read`. Errors of the kinds that readers report are fine, if they are one line. @return whether there is none.
template <class Read>
bool expect_one_line(const Read& read) {
  try {
    read();
    return true;
  } catch (const std::runtime_error& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) throw std::logic_error(error.what());
  } catch (const std::invalid_argument& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) throw std::logic_error(error.what());
  }
  return false;
}

/// A link to a file, with a name, in a folder of its own.
std::filesystem::path named(const std::filesystem::path& path, const std::string& name) {
  static const TemporaryFolder folder;
  const std::filesystem::path link = folder / name;
  std::filesystem::remove(link);
  std::filesystem::create_symlink(path, link);
  return link;
}

/// A target of the bytes of a file, which a function of its path reads.
template <auto read>
bool of_file(const std::string& bytes) {
  const MemoryFile file(bytes);
  return expect_one_line([&] { read(file.path()); });
}

using Path = std::filesystem::path;

void read_scene_file(const Path& path) { read_scene_json(read_json_object(path), "scene.json"); }

/// Lines of KEY=VALUE.
bool read_overrides(const std::string& bytes) {
  Json scene = Json::object();
  std::istringstream lines(bytes);
  bool are_right = true;
  for (std::string line; std::getline(lines, line);) are_right &= expect_one_line([&] { apply_override(scene, line); });
  are_right &= expect_one_line([&] { set_frame(scene, 7, {"scene.json"}); });
  return expect_one_line([&] { read_scene_json(scene, "scene.json"); }) && are_right;
}

bool read_frames(const std::string& bytes) {
  numbered(bytes, 7);
  if (bytes_of_utf8(utf8_of(bytes)) != bytes) throw std::logic_error("a path does not come back");
  return expect_one_line([&] { parse_frames(bytes); });
}

void read_spectrum_file(const Path& path) { read_spectrum(path); }

bool read_seeds_and_spectrum(const std::string& bytes) {
  const bool are_seeds = of_file<read_seeds>(bytes);
  return of_file<read_spectrum_file>(bytes) || are_seeds;
}

/// What files of work hold: the sums of photons, or other results. Their first byte chooses. (Few of the bytes that a
/// fuzzer makes of such a file have the right hash.)
bool read_kept_unit(const std::string& bytes) {
  if (bytes.empty()) return false;
  Archive archive(std::string_view(bytes).substr(1));
  if ((bytes[0] & 1) != 0)
    return expect_one_line([&] {
      std::vector<double> values;
      archive.copy_list(values);
      archive.finish();
    });
  PhotonSums sums;
  sums.ends.resize(2);
  sums.density.emplace(4, 4, 2, DensitySettings{DensityKind::histogram});
  sums.has_photons = true;
  return expect_one_line([&] { copy_sums(archive, sums); });
}

/// Each vertex has a normal or none has, and triangles name vertices that are there.
template <MeshWithNormals (*read)(const Path&)>
void read_mesh(const Path& path) {
  const MeshWithNormals mesh = read(path);
  const std::size_t count = mesh.mesh.vertices.size();
  if (!mesh.normals.empty() && mesh.normals.size() != count) throw std::logic_error("normals are missing");
  for (const auto& triangle : mesh.mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= count) throw std::logic_error("a vertex is missing");
}

/// For grey pictures, too.
bool read_profile(const std::string& bytes) {
  const bool is_grey = expect_one_line([&] { icc_to_xyz(bytes, true); });
  return expect_one_line([&] { icc_to_xyz(bytes, false); }) || is_grey;
}

/// The values of all slices, too.
void read_slices(const Lattice& lattice) {
  std::vector<double> values(static_cast<std::size_t>(lattice.size.x()) * static_cast<std::size_t>(lattice.size.y()) *
                             static_cast<std::size_t>(lattice.components));
  for (int z = lattice.size.z() - 1; z >= 0; --z) lattice.read_slice(z, values.data());
}

template <Lattice (*open)(const Path&, bool)>
void read_lattice(const Path& path) {
  read_slices(open(path, false));
}

/// The library reads only files with this ending.
void read_nifti(const Path& path) { read_slices(open_nifti(named(path, "fuzz.nii"))); }

/// All numbers that stand in the document itself.
void read_xdmf(const Path& path) {
  const VtkMessages messages;
  const XdmfDocument document(path);
  for (int step = 0; step < document.steps(); ++step)
    for (XmlElement* const grid : document.grids(step))
      for (XmlElement* const part : document.children(*grid, {"Topology", "Geometry", "Attribute"}))
        for (XmlElement* const item : document.children(*part, {"DataItem"})) xdmf_values(document, *item);
}

/// Beside the case there are files that it may name.
void read_ensight(const Path& path) {
  const Path file = named(path, "fuzz.case");
  for (const char* other : {"a.0.geo", "a.0.sym", "a.0.gen", "a.1.geo"}) std::ofstream(file.parent_path() / other);
  expect_one_line([&] { ensight_case(file, 1); });
  ensight_case(file, 0);
}

/// The first byte chooses how the file stores its tree.
bool read_vdb_tree(const std::string& bytes) {
  if (bytes.empty()) return false;
  const char* const types[] = {"Tree_vec3s_5_4_3", "Tree_float_5_4_3", "Tree_double_5_4_3", "Tree_vec3d_5_4_3"};
  const auto choice = static_cast<unsigned char>(bytes[0]);
  const StoredTree tree{types[choice & 3], (choice & 4) != 0, (choice & 8) != 0, (choice & 16) != 0,
                        (choice & 32) != 0};
  const MemoryFile file(bytes.substr(1));
  const FileBytes content(file.path());
  std::vector<StoredLeaf> leaves;
  return tree_fits(content, 0, tree, leaves) && !leaves.empty();
}

}  // namespace

const std::vector<FuzzTarget>& fuzz_targets() {
  static const std::vector<FuzzTarget> targets{{"scene", of_file<read_scene_file>},
                                               {"override", read_overrides},
                                               {"frames", read_frames},
                                               {"text", read_seeds_and_spectrum},
                                               {"work", of_file<read_work>},
                                               {"kept", read_kept_unit},
                                               {"ply", of_file<read_mesh<read_ply>>},
                                               {"obj", of_file<read_mesh<read_obj>>},
                                               {"icc", read_profile},
                                               {"png", of_file<read_png_chunks>},
                                               {"tck", of_file<read_tck_paths>},
                                               {"npy", of_file<read_lattice<open_npy>>},
                                               {"nrrd", of_file<read_lattice<open_nrrd>>},
                                               {"nifti", of_file<read_nifti>},
                                               {"mrtrix", of_file<read_lattice<open_mrtrix>>},
                                               {"metaimage", of_file<read_lattice<open_metaimage>>},
                                               {"xdmf", of_file<read_xdmf>},
                                               {"ensight", of_file<read_ensight>},
                                               {"netcdf", of_file<require_whole_netcdf>},
                                               {"vdb_tree", read_vdb_tree},
                                               {"http", read_http},
                                               {"page", read_page_message}};
  return targets;
}

}  // namespace tensorray::test
