#include "tools/import/import_file.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <new>
#include <stdexcept>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDataSet.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkObject.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/cases/case_files.h"
#include "tools/import/lattice_files/lattice_files.h"
#include "tools/import/lattices/tensor_order.h"
#include "tools/import/meshes/flat_mesh.h"
#include "tools/import/sampling/sampling_lattice.h"
#include "tools/import/surfaces/triangle_shells.h"
#include "tools/import/vtk_formats/image_lattice.h"
#include "tools/import/vtk_source/mesh_formats.h"
#include "tools/import/vtk_source/vtk_source.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {
namespace {

/// The reader of a voxel format; null if the file is of another kind.
using OpenLattice = Lattice (*)(const std::filesystem::path&, bool is_mask);

OpenLattice lattice_reader(const std::filesystem::path& path) {
  const std::pair<OpenLattice, std::vector<const char*>> readers[] = {
      {open_nrrd, {".nrrd", ".nhdr"}},
      {open_nifti, {".nii", ".nii.gz", ".hdr", ".hdr.gz", ".img", ".img.gz"}},
      {open_metaimage, {".mha", ".mhd"}},
      {open_mrtrix, {".mif", ".mif.gz", ".mih"}},
      {open_npy, {".npy"}}};
  const std::string name = lower_case(path.filename().string());
  for (const auto& [reader, endings] : readers)
    for (const char* ending : endings)
      if (ends_with(name, ending)) return reader;
  return nullptr;
}

/// Whether the user asks for voxels of a size or a number; the first kind of a resolution is none.
bool wants_sampling(const ImportSettings& settings) { return settings.sampling.resolution.index() > 0; }

/// Keeps only the voxels whose centres `keeps` wants.
void keep_voxels(TensorGrid& grid, const std::function<bool(const Eigen::Vector3d& center)>& keeps) {
  tbb::parallel_for(std::size_t{0}, grid.blocks.size(), [&](std::size_t i) {
    TensorBlock& block = grid.blocks[i];
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      const Eigen::Vector3i index = block.origin + TensorBlock::position(offset);
      if (!block.active[offset] || keeps(grid.to_world * index.cast<double>())) continue;
      block.active.reset(offset);
      block.values[offset].setZero();
    }
  });
  remove_empty_blocks(grid);
}

/// Those in `bounds`, except for rounding.
void crop(TensorGrid& grid, Eigen::AlignedBox3d bounds) {
  const Eigen::Vector3d rounding = Eigen::Vector3d::Constant(1e-6 * grid.to_world.linear().colwise().norm().minCoeff());
  bounds = {bounds.min() - rounding, bounds.max() + rounding};
  keep_voxels(grid, [&](const Eigen::Vector3d& center) { return bounds.contains(center); });
}

/// A lattice of a file that does not say where its voxels are: --voxel-size and --origin do.
Lattice placed(Lattice lattice, const ImportSettings& settings) {
  const double* const size = std::get_if<double>(&settings.sampling.resolution);
  if (wants_sampling(settings) && !size)
    throw std::invalid_argument("has voxels of its own, which are kept: give --voxel-size instead of --resolution");
  lattice.to_world = Eigen::Translation3d(settings.origin.value_or(Eigen::Vector3d::Zero())) *
                     Eigen::Scaling(settings.voxel.value_or(Eigen::Vector3d::Constant(size ? *size : 1.0)));
  return lattice;
}

/// A mask in one of VTK's formats: an image, of which one array has one number at each voxel.
Lattice open_image_mask(const std::filesystem::path& file) try {
  std::vector<std::string> notes;
  const auto data = read_vtk_source(file, std::nullopt, &notes);
  vtkSmartPointer<vtkImageData> image(vtkImageData::SafeDownCast(data));
  std::vector<std::pair<vtkDataArray*, bool>> arrays;
  for_each_array(*data, [&](vtkDataArray& array, bool of_cells) {
    if (array.GetNumberOfComponents() == 1) arrays.emplace_back(&array, of_cells);
  });
  if (!image || arrays.size() != 1)
    throw std::runtime_error("a mask has voxels, and one array of one number at each; " + list_of_arrays(*data));
  Lattice mask = lattice_of(std::move(image), arrays.front().first, arrays.front().second);
  mask.notes = std::move(notes);
  return mask;
} catch (const std::exception& error) {
  throw std::invalid_argument("--mask: NIfTI, NRRD, MetaImage, MRtrix, .npy or an image of VTK is needed; " +
                              file.string() + ": " + error.what());
}

/// Those in voxels of the mask that are not 0. It may have other voxels than the grid, in the same world.
void apply_mask(TensorGrid& grid, const ImportSettings& settings, ImportReport& report) {
  const std::filesystem::path& file = settings.mask;
  const OpenLattice open = lattice_reader(file);
  const bool is_npy = open == open_npy;
  if (is_npy && lattice_reader(settings.files.front()) != open_npy)
    throw std::invalid_argument("--mask " + file.string() + ": .npy does not say where it is, and is for .npy alone");
  Lattice mask = open ? open(file, true) : open_image_mask(file);
  if (is_npy) mask = placed(std::move(mask), settings);
  for (const std::string& note : mask.notes) report.notes.push_back("--mask: " + note);
  const std::size_t slice = std::size_t(mask.size.x()) * std::size_t(mask.size.y());
  std::vector<double> values(slice);
  std::vector<char> inside(slice * std::size_t(mask.size.z()));
  for (int z = mask.size.z() - 1; z >= 0; --z) {
    mask.read_slice(z, values.data());
    std::transform(values.begin(), values.end(), inside.begin() + std::ptrdiff_t(slice) * z,
                   [](double value) { return value != 0 && std::isfinite(value); });
  }
  const Eigen::Affine3d to_mask = mask.to_world.inverse();
  keep_voxels(grid, [&](const Eigen::Vector3d& center) {
    const Eigen::Array3i at = (to_mask * center).array().round().cast<int>();
    if ((at < 0).any() || (at >= mask.size.array()).any()) return false;
    return inside[slice * std::size_t(at.z()) + std::size_t(at.y() * mask.size.x() + at.x())] != 0;
  });
}

/// Changes every tensor of a level.
template <class Change>
void change_tensors(TensorBlocks& blocks, const Change& change) {
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
    for (Eigen::Matrix3f& value : blocks[i].values) value = change(value);
  });
}

void warn_of_fills(const FillValues& fills, std::size_t values, ImportReport& report) {
  if (fills.count > 0)
    report.warnings.push_back(
        fmt::format("{} of {} values are as {:.6g}, which programs write where they have no data; make them NaN, of "
                    "which the import makes inactive voxels",
                    fills.count, values, fills.example));
}

/// Warns of tensors that are all the same, also zero.
void warn_of_same(const TensorGrid& grid, ImportReport& report) {
  std::optional<Eigen::Matrix3d> first;
  std::size_t voxels = 0;
  for (const TensorBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      if (!block.active[offset]) continue;
      const Eigen::Matrix3d tensor = block.values[offset].cast<double>();
      if (!first) first = tensor;
      if ((tensor - *first).norm() > 1e-6 * first->norm()) return;
      ++voxels;
    }
  if (voxels > 1)
    report.warnings.push_back(first->norm() > 0 ? "all tensors are the same; check the array and the step of time"
                                                : "all tensors are zero; check the array and the step of time");
}

bool wants_levels(const ImportSettings& settings) {
  return settings.sampling.levels.value_or(1) > 1 || settings.sampling.finest || settings.sampling.error;
}

TensorGrid import_lattice(const Lattice& lattice, const ImportSettings& settings, ImportReport& report) {
  if (wants_levels(settings) || settings.sampling.rounding > 0)
    throw std::invalid_argument(
        "has voxels of one size, which are kept: leave --levels, --finest, --error and --rounding out");
  if (!settings.boundary.empty()) throw std::invalid_argument("has voxels, which have no body: leave --boundary out");
  if (settings.take == Take::tensor && !settings.array.empty() && lattice.array.empty())
    throw std::invalid_argument("has one array, which has no name: leave --array out");
  report.lattice.emplace();
  TensorGrid grid = settings.take == Take::tensor ? tensors_of(lattice, settings.order, *report.lattice)
                                                  : gradient_of(lattice, *report.lattice);
  if (settings.take != Take::tensor)
    change_tensors(grid.blocks, [&](const Eigen::Matrix3f& G) -> Eigen::Matrix3f {
      return tensor_of_gradient(settings.take, G.cast<double>()).cast<float>();
    });
  if (settings.sampling.bounds) crop(grid, *settings.sampling.bounds);
  if (!settings.mask.empty()) apply_mask(grid, settings, report);
  grid.metadata["tensorray:voxels"] = fmt::format("{} {} {}", lattice.size.x(), lattice.size.y(), lattice.size.z());
  if (lattice.is_anatomical) grid.metadata.insert({{"tensorray:world_unit", "mm"}, {"tensorray:world_axes", "RAS"}});
  grid.name = lattice.array;
  report.lattice->active = grid.active_voxels();
  warn_of_fills(report.lattice->fills, report.lattice->voxels, report);
  return grid;
}

/// Until it is destroyed, drops VTK's errors and warnings: it reports every flat cell. Several threads may use VTK.
struct SilentVtk {
  const int before = vtkObject::GetGlobalWarningDisplay();

  SilentVtk() { vtkObject::GlobalWarningDisplayOff(); }
  ~SilentVtk() { vtkObject::SetGlobalWarningDisplay(before); }
};

/// Gives the grid the surface of the mesh, within the bounds that the user gives.
void add_surface(vtkDataSet& mesh, const BodyFaces& faces, const ImportSettings& settings, const Progress& progress,
                 TensorGrid& grid, ImportReport& report) {
  constexpr double tolerance = 0.0025;  // Of a voxel, of the finest level.
  const SamplingReport& sampled = *report.mesh;
  const double voxel = sampled.finer.empty() ? sampled.voxel.minCoeff() : sampled.finer.back().voxel;
  progress.update("finding the surface", 0, 1);
  report.surface = body_surface(mesh, faces, tolerance * voxel);
  TriangleMesh triangles = std::move(report.surface->mesh);
  if (report.surface->open_edges > 0) return;
  grid.surface = std::move(triangles);
  if (!settings.sampling.bounds) return;
  Eigen::AlignedBox3d box = *settings.sampling.bounds;
  if (const int flat = settings.sampling.flat_axis; flat >= 0)  // Of a slab all of the thickness counts.
    box.min()[flat] = grid.surface.bounds().min()[flat], box.max()[flat] = grid.surface.bounds().max()[flat];
  grid.surface = cut_to(std::move(grid.surface), box);
  report.surface->area = 0;
}

/// Of a plate or a shell; 0: there is none, or no surface is made.
double thickness_of(vtkDataSet& mesh, const BodyFaces& faces) {
  const BodySurface surface = body_surface(mesh, faces, std::numeric_limits<double>::infinity());
  return surface.area > 0 && surface.open_edges == 0 ? 2 * surface.mesh.volume() / surface.area : 0;
}

/// The edges of the finest voxels along the axes do not tell how many are across a body that is turned.
void warn_of_thickness(const SamplingSettings& settings, const SamplingReport& sampled, ImportReport& report) {
  constexpr double least = 2.5;  // Voxels across.
  const double voxel = sampled.finer.empty() ? sampled.voxel.minCoeff() : sampled.finer.back().voxel;
  const Eigen::Vector3d edges = sampled.voxel.cwiseProduct((sampled.size - Eigen::Vector3i::Ones()).cast<double>());
  if (settings.flat_axis < 0 && is_thin(settings, {Eigen::Vector3d::Zero(), edges}) &&
      settings.thickness < least * voxel)
    report.warnings.push_back(
        fmt::format("the body is about {:.3g} thick, and its finest voxels are {:.3g}: the field in it is coarse; try "
                    "--voxel-size {:.2g}",
                    settings.thickness, voxel, settings.thickness / across_thickness));
}

TensorGrid import_mesh(vtkDataSet& data, const ArrayChoice& array, const ImportSettings& settings,
                       const Progress& progress, ImportReport& report) {
  if (!settings.mask.empty())
    throw std::invalid_argument("is a mesh, whose field ends with it: leave --mask out, or give --bounds");
  const SilentVtk silent;
  report.mesh_cells = static_cast<std::size_t>(data.GetNumberOfCells());
  if (!settings.boundary.empty()) {
    progress.update("finding the boundary", 0, 1);
    report.boundary_triangles = write_boundary(data, settings.boundary);
    if (report.boundary_triangles == 0)
      throw std::invalid_argument("is a convex mesh, with no body in it: leave --boundary out");
  }
  progress.update("making tensors", 0, 1);
  const auto mesh = with_tensors(data, array, settings.take, settings.order, settings.cell_values);
  report.mesh.emplace();
  FillValues fills;
  vtkDataArray& values = *attributes_of(data, array.of_cells).GetArray(array.name.c_str());
  std::vector<double> tuple(static_cast<std::size_t>(values.GetNumberOfComponents()));
  for (vtkIdType i = 0; i < values.GetNumberOfTuples(); ++i) {
    values.GetTuple(i, tuple.data());
    fills.add(tuple.data(), values.GetNumberOfComponents());
  }
  warn_of_fills(fills, static_cast<std::size_t>(values.GetNumberOfTuples()), report);
  SamplingSettings sampling = settings.sampling;
  const bool has_surface = settings.surface && !vtkImageData::SafeDownCast(&data);
  const BodyFaces faces = has_surface ? body_faces(*mesh) : BodyFaces();
  if (has_surface) sampling.thickness = thickness_of(*mesh, faces);
  TensorGrid grid = sample_mesh(*mesh, sampling, progress, *report.mesh);
  grid.name = array.name;
  warn_of_thickness(sampling, *report.mesh, report);
  if (has_surface) add_surface(*mesh, faces, settings, progress, grid, report);
  return grid;
}

/// Makes a slab of a flat mesh: one voxel across its plane.
vtkSmartPointer<vtkDataSet> slab_of_flat(vtkSmartPointer<vtkDataSet> data, ImportSettings& settings,
                                         ImportReport& report) {
  const std::optional<FlatMesh> flat = flat_mesh(*data);
  if (!flat && settings.thickness) throw std::invalid_argument("is not flat: leave --thickness out");
  if (!flat) return data;
  if (!settings.boundary.empty()) throw std::invalid_argument("is flat, and has no body: leave --boundary out");
  if (wants_levels(settings))
    throw std::invalid_argument("is flat, and gets voxels of one size: leave --levels, --finest and --error out");
  report.thickness = settings.thickness.value_or(flat->edge);
  settings.sampling.flat_axis = flat->axis;
  if (!wants_sampling(settings)) {
    Eigen::Vector3d edges = Eigen::Vector3d::Constant(flat->edge);
    if (settings.sampling.bounds) edges = settings.sampling.bounds->sizes();
    edges[flat->axis] = 0;
    settings.sampling.resolution = std::min(flat->edge, edges.maxCoeff());
  }
  return slab_of(*data, *flat, report.thickness);
}

/// Sets the distance of the voxels of an image along axes with one voxel.
void set_thickness(vtkImageData& image, double thickness) {
  bool is_flat = false;
  for (int axis = 0; axis < 3; ++axis) {
    if (image.GetDimensions()[axis] != 1) continue;
    Eigen::Vector3d spacing(image.GetSpacing());
    spacing[axis] = thickness;
    image.SetSpacing(spacing.data());
    is_flat = true;
  }
  if (!is_flat) throw std::invalid_argument("is not flat: leave --thickness out");
}

/// Whether an image has one voxel along z, several along x and y, and is not turned.
bool is_flat_across_z(vtkImageData& image) {
  const int* const size = image.GetDimensions();
  return size[0] > 1 && size[1] > 1 && size[2] == 1 && image.GetDirectionMatrix()->IsIdentity();
}

/// The chosen array, with its components in an order that has a name.
ArrayChoice chosen_array(vtkDataSet& data, const ImportSettings& settings, bool is_flat) {
  if (is_array_list(data, settings.array)) return join_arrays(data, settings.array, settings.take, is_flat);
  const ArrayChoice array = choose_array(data, settings.array, settings.take, settings.cell_values);
  vtkDataSetAttributes& attributes = attributes_of(data, array.of_cells);
  if (settings.take == Take::tensor) attributes.AddArray(in_known_order(*attributes.GetArray(array.name.c_str())));
  return array;
}

/// Of a mesh without any, nothing else is looked at: a small file may announce one that takes hours.
bool has_no_arrays(vtkDataSet& data) {
  return data.GetPointData()->GetNumberOfArrays() == 0 && data.GetCellData()->GetNumberOfArrays() == 0;
}

/// Keeps the voxels of a VTK image, unless the user asks for other voxels.
TensorGrid import_data_set(vtkSmartPointer<vtkDataSet> data, ImportSettings settings, const Progress& progress,
                           ImportReport& report) {
  if (has_no_arrays(*data)) choose_array(*data, settings.array, settings.take, settings.cell_values);  // Throws.
  if (!vtkImageData::SafeDownCast(data) || wants_sampling(settings))
    data = slab_of_flat(std::move(data), settings, report);
  else if (settings.thickness)
    set_thickness(*vtkImageData::SafeDownCast(data), *settings.thickness);
  auto image = vtkSmartPointer<vtkImageData>(vtkImageData::SafeDownCast(data));
  const bool is_flat = image ? is_flat_across_z(*image) : settings.sampling.flat_axis == 2;
  if (is_flat) pad_vectors(*data);
  const ArrayChoice array = chosen_array(*data, settings, is_flat);
  if (array.is_at_both)
    report.notes.push_back(fmt::format("array \"{}\" is at points and at cells: that at {} is taken{}", array.name,
                                       array.of_cells ? "cells" : "points",
                                       array.of_cells ? "" : "; --cells constant takes the other one"));
  if (const int count = attributes_of(*data, array.of_cells).GetArray(array.name.c_str())->GetNumberOfComponents();
      count > 9)
    report.notes.push_back(fmt::format("array \"{}\" has {} components: the first six are taken", array.name, count));
  if (!image || wants_sampling(settings)) return import_mesh(*data, array, settings, progress, report);
  data = nullptr;  // Leave the lattice as the only owner of the numbers, so that it can free them.
  vtkSmartPointer<vtkDataArray> values = attributes_of(*image, array.of_cells).GetArray(array.name.c_str());
  std::optional<TensorOrder> order;
  if (settings.take == Take::tensor) order = order_in(*values, settings.order);
  Lattice lattice = lattice_of(std::move(image), std::move(values), array.of_cells);
  if (order != TensorOrder::full) lattice.order = order;
  return import_lattice(lattice, settings, report);
}

TensorGrid import_any(const ImportSettings& settings, const Progress& progress, ImportReport& report) {
  const std::filesystem::path& file = settings.files.front();
  const OpenLattice open = lattice_reader(file);
  const bool has_steps = settings.files.size() == 1 && !open;
  if (open && settings.thickness) throw std::invalid_argument("has voxels of its own: leave --thickness out");
  if (!has_steps && settings.step.value_or(0) > 0)
    throw std::invalid_argument("has one step of time; leave --steps out");
  if (settings.files.size() == 2)
    return import_data_set(read_plot3d(file, settings.files[1]), settings, progress, report);
  if (!open) {
    const auto data = read_vtk_source(file, settings.step, &report.notes);
    TensorGrid grid = import_data_set(data, settings, progress, report);
    if (&find_format(file) == format_with_ending(".foam")) grid.metadata["tensorray:world_unit"] = "m";
    return grid;
  }
  if (open == open_npy) return import_lattice(placed(open(file, false), settings), settings, report);
  if (wants_sampling(settings))
    throw std::invalid_argument("has voxels of its own, which are kept: leave --resolution and --voxel-size out");
  Lattice lattice = open(file, false);
  if (settings.frame) take_frame(lattice, *settings.frame);
  return import_lattice(lattice, settings, report);
}

/// An error message in one line that names the file, with what was found before.
std::string about(const std::filesystem::path& file, const std::string& error, const ImportReport& report) {
  std::string message = escaped(error);
  if (message.find(file.string()) == std::string::npos) message = file.string() + ": " + message;
  for (const std::string& note : report.notes) message += " (" + escaped(note) + ")";
  return message;
}

/// Pieces of one mesh are named by any of them.
std::vector<std::filesystem::path> without_other_pieces(const std::vector<std::filesystem::path>& files) {
  if (files.size() < 2) return files;
  const std::vector<std::filesystem::path> pieces = nemesis_pieces(files.front());
  const bool is_one = pieces.size() > 1 && std::all_of(files.begin(), files.end(), [&](const auto& file) {
                        return std::find(pieces.begin(), pieces.end(), file) != pieces.end();
                      });
  return is_one ? std::vector{files.front()} : files;
}

/// Checks that positions of voxels are numbers that differ, and that OpenVDB takes them.
void require_place(const std::filesystem::path& file, const TensorGrid& grid) {
  const Eigen::Vector3d edges = grid.to_world.linear().colwise().norm();
  const Eigen::AlignedBox3i box = grid.active_box();
  double farthest = 0;
  for (const Eigen::Vector3i& corner : {box.min(), box.max()})
    farthest = std::max(farthest, (grid.to_world * corner.cast<double>()).cwiseAbs().maxCoeff());
  if (!(edges.minCoeff() >= 1e-30 && edges.maxCoeff() <= 1e30))
    fail(file, "has voxels with an edge of " +
                   fmt::format("({:.6g}, {:.6g}, {:.6g})", edges.x(), edges.y(), edges.z()) +
                   ", and not between 1e-30 and 1e30; change its unit");
  if (!(farthest <= 1e13 * edges.minCoeff()))
    fail(file, fmt::format("its voxels are {:.6g} from the origin, where edges of {:.6g} vanish; move the origin",
                           farthest, edges.minCoeff()));
}

std::string tensor_name(const std::string& array, Take take) {
  const std::string flag = flag_of(take);  // --strain-of
  std::string ending = take == Take::tensor ? "" : "_" + flag.substr(2, flag.size() - 5);
  std::replace(ending.begin(), ending.end(), '-', '_');
  return (array.empty() ? "tensor" : array) + ending;
}

}  // namespace

TensorGrid import_tensors(const ImportSettings& given, const Progress& progress, ImportReport& report) {
  ImportSettings settings = given;
  settings.files = without_other_pieces(given.files);
  if (settings.files.empty() || settings.files.size() > 2)
    throw std::invalid_argument("give one file, or PLOT3D's two: the grid and its q");
  const std::filesystem::path& file = settings.files.front();
  if (settings.origin && lattice_reader(file) != open_npy)
    throw std::invalid_argument(file.string() + ": says itself where it is, only .npy does not: leave --origin out");
  if (settings.voxel && lattice_reader(file) != open_npy)
    throw std::invalid_argument(file.string() + ": --voxel-size: only the voxels of .npy have three edges; give one");
  if (settings.frame && (!lattice_reader(file) || lattice_reader(file) == open_npy))
    throw std::invalid_argument(file.string() + ": is not in an anatomical space: leave --frame out");
  progress.update("reading", 0, 1);
  TensorGrid grid;
  try {
    grid = import_any(settings, progress, report);
  } catch (const Cancelled&) {
    throw;
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(about(file, error.what(), report));
  } catch (const std::bad_alloc&) {
    throw std::runtime_error(
        about(file, "does not fit in memory: it may be damaged, or has many cells; else give --memory, or fewer voxels",
              report));
  } catch (const std::exception& error) {
    throw std::runtime_error(about(file, error.what(), report));
  }
  if (grid.blocks.empty() && !settings.mask.empty())
    throw std::invalid_argument(file.string() + ": --mask: no voxel is inside that has a tensor");
  if (grid.blocks.empty() && settings.sampling.bounds)
    throw std::invalid_argument(file.string() + ": --bounds: no voxel is inside that has a tensor");
  if (grid.blocks.empty())
    fail(file, report.lattice && report.lattice->non_finite > 0
                   ? fmt::format("has no tensor: {} of its {} voxels are NaN or infinite, the others zero (background)",
                                 report.lattice->non_finite, report.lattice->voxels)
                   : "all voxels are background or not finite");
  require_place(file, grid);
  warn_of_same(grid, report);
  if (settings.negate) {
    const auto negated = [](const Eigen::Matrix3f& value) -> Eigen::Matrix3f { return -value; };
    change_tensors(grid.blocks, negated);
    for (TensorBlocks& level : grid.finer) change_tensors(level, negated);
    grid.metadata[negated_key] = "yes";
  }
  grid.name = tensor_name(grid.name, settings.take);
  grid.metadata["tensorray:source"] = file.filename().string();
  return grid;
}

int time_steps(const ImportSettings& settings) {
  const std::vector<std::filesystem::path> files = without_other_pieces(settings.files);
  const std::filesystem::path& file = files.front();
  return files.size() == 1 && !lattice_reader(file) ? time_steps(file) : 1;
}

}  // namespace tensorray
