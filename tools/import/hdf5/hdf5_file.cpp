#include "tools/import/hdf5/hdf5_file.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkIdTypeArray.h>
#include <vtk_hdf5.h>

#include "base/errors.h"

namespace tensorray {
namespace {

/// An identifier of HDF5, and the function that closes it.
class Id {
 public:
  Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Id() {
    if (id_ >= 0) close_(id_);
  }
  Id(const Id&) = delete;
  Id& operator=(const Id&) = delete;
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// An array for numbers of a type, and the type in memory; null if it is none of numbers.
std::pair<vtkSmartPointer<vtkDataArray>, hid_t> array_for(hid_t type) {
  switch (H5Tget_class(type)) {
    case H5T_FLOAT:
      if (H5Tget_size(type) <= 4) return {vtkSmartPointer<vtkFloatArray>::New(), H5T_NATIVE_FLOAT};
      return {vtkSmartPointer<vtkDoubleArray>::New(), H5T_NATIVE_DOUBLE};
    case H5T_INTEGER:
    case H5T_ENUM:
      static_assert(sizeof(vtkIdType) == sizeof(long long));
      return {vtkSmartPointer<vtkIdTypeArray>::New(), H5T_NATIVE_LLONG};
    default:
      return {nullptr, -1};
  }
}

/// Whether HDF5 made up all numbers of a part: they are the fill value, and its first chunk was not written.
bool is_made_up(hid_t data, hid_t memory_type, vtkDataArray& array, const HyperSlab& part) {
  const Id creation(H5Dget_create_plist(data), H5Pclose);
  const auto size = static_cast<std::size_t>(array.GetDataTypeSize());
  std::string fill(size, '\0');
  H5Pget_fill_value(creation, memory_type, fill.data());
  const auto* const bytes = static_cast<const char*>(array.GetVoidPointer(0));
  for (vtkIdType i = 0; i < array.GetNumberOfTuples(); ++i)
    if (std::memcmp(bytes + static_cast<std::size_t>(i) * size, fill.data(), size) != 0) return false;
  H5D_space_status_t status = H5D_SPACE_STATUS_ALLOCATED;
  H5Dget_space_status(data, &status);
  if (status != H5D_SPACE_STATUS_PART_ALLOCATED) return status != H5D_SPACE_STATUS_ALLOCATED;
  const std::size_t rank = part.start.size();
  std::vector<hsize_t> chunk(rank, 1), corner(rank);
  H5Pget_chunk(creation, static_cast<int>(rank), chunk.data());
  for (std::size_t i = 0; i < rank; ++i) corner[i] = part.start[i] / chunk[i] * chunk[i];
  unsigned filters = 0;
  haddr_t address = HADDR_UNDEF;
  hsize_t stored = 0;
  return H5Dget_chunk_info_by_coord(data, corner.data(), &filters, &address, &stored) >= 0 && address == HADDR_UNDEF;
}

}  // namespace

bool HyperSlab::is_inside(const std::vector<std::uint64_t>& shape) const {
  const std::size_t rank = shape.size();
  bool fits = start.size() == rank && stride.size() == rank && count.size() == rank;
  for (std::size_t i = 0; fits && i < rank; ++i)  // Not by multiplying, which overflows for hostile numbers.
    fits = stride[i] > 0 && count[i] <= (start[i] < shape[i] ? (shape[i] - 1 - start[i]) / stride[i] + 1 : 0);
  return fits;
}

struct Hdf5File::Handle {
  Id id;
};

Hdf5File::Hdf5File(const std::filesystem::path& path) : path_(path) {
  [[maybe_unused]] static const herr_t silenced = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  if (!std::filesystem::is_regular_file(path)) tensorray::fail(path, "is missing; copy it there too");
  file_.reset(new Handle{{H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose}});
  if (file_->id < 0) fail("is no HDF5 file, or cut off; copy or write it again");
}

Hdf5File::~Hdf5File() = default;

void Hdf5File::fail(const std::string& what) const { tensorray::fail(path_, what); }

bool Hdf5File::has(const std::string& name) const {
  for (std::size_t end = name.find('/', 1);; end = name.find('/', end + 1)) {  // H5Lexists fails where a group lacks.
    const std::string part = name.substr(0, end);
    if (part != "/" && !part.empty() && H5Lexists(file_->id, part.c_str(), H5P_DEFAULT) <= 0) return false;
    if (end == std::string::npos) return true;
  }
}

bool Hdf5File::has_attribute(const std::string& object, const std::string& attribute) const {
  return has(object) && H5Aexists_by_name(file_->id, object.c_str(), attribute.c_str(), H5P_DEFAULT) > 0;
}

bool Hdf5File::has_numbers(const std::string& dataset) const {
  if (!has(dataset)) return false;
  const Id data(H5Dopen2(file_->id, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  const Id type(data < 0 ? -1 : H5Dget_type(data), H5Tclose);
  return type >= 0 && array_for(type).first;
}

std::vector<std::string> Hdf5File::children(const std::string& group) const {
  std::vector<std::string> names;
  if (!has(group)) return names;
  const Id id(H5Gopen2(file_->id, group.c_str(), H5P_DEFAULT), H5Gclose);
  if (id < 0) return names;
  const auto add = [](hid_t, const char* name, const H5L_info_t*, void* list) -> herr_t {
    static_cast<std::vector<std::string>*>(list)->emplace_back(name);
    return 0;
  };
  H5Literate(id, H5_INDEX_NAME, H5_ITER_INC, nullptr, add, &names);
  return names;
}

/// Names the file that a link on the way leads to, if there is one.
void Hdf5File::fail_missing(const std::string& dataset) const {
  for (std::size_t end = dataset.find('/', 1);; end = dataset.find('/', end + 1)) {
    const std::string part = dataset.substr(0, end);
    H5L_info_t link{};
    if (H5Lget_info(file_->id, part.c_str(), &link, H5P_DEFAULT) >= 0 && link.type == H5L_TYPE_EXTERNAL) {
      std::string value(link.u.val_size, '\0');
      const char *file = "", *object = "";
      H5Lget_val(file_->id, part.c_str(), value.data(), value.size(), H5P_DEFAULT);
      H5Lunpack_elink_val(value.data(), value.size(), nullptr, &file, &object);
      fail("its " + part + " is " + object + " in the file " + file +
           ", which is missing or lacks it; copy it there too");
    }
    if (end == std::string::npos) fail("has no dataset " + dataset);
  }
}

/// Of a dataset whose numbers are elsewhere: in datasets of other files (a virtual one), or in other files.
void Hdf5File::require_sources(const std::string& dataset, int depth) const {
  const Id data(H5Dopen2(file_->id, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  const Id creation(H5Dget_create_plist(data), H5Pclose);
  H5D_space_status_t status = H5D_SPACE_STATUS_ALLOCATED;
  H5Dget_space_status(data, &status);
  if (depth > 0 && status == H5D_SPACE_STATUS_NOT_ALLOCATED)
    fail("its dataset " + dataset + " was announced, and not written; write it again");
  std::vector<char> name(4096), source_name(4096);
  for (int i = 0; i < H5Pget_external_count(creation); ++i) {
    off_t offset = 0;
    hsize_t size = 0;
    H5Pget_external(creation, static_cast<unsigned>(i), name.size() - 1, name.data(), &offset, &size);
    std::error_code none;
    const auto held = std::filesystem::file_size(path_.parent_path() / name.data(), none);
    if (none || (size != H5S_UNLIMITED && held < static_cast<hsize_t>(offset) + size))
      fail("the numbers of its dataset " + dataset + " are in the file " + name.data() +
           ", which is missing or cut off; copy it there too");
  }
  std::size_t count = 0;
  if (H5Pget_layout(creation) != H5D_VIRTUAL || H5Pget_virtual_count(creation, &count) < 0) return;
  if (depth > 8) fail("its dataset " + dataset + " is virtual, and refers to itself");
  for (std::size_t i = 0; i < count; ++i) {
    H5Pget_virtual_filename(creation, i, name.data(), name.size());
    H5Pget_virtual_dsetname(creation, i, source_name.data(), source_name.size());
    const std::string file = name.data(), source = source_name.data();
    if ((file + source).find('%') != std::string::npos) continue;  // Of any number of files.
    const std::string lacks =
        "its dataset " + dataset + " is virtual, and its source " + (file == "." ? "" : "is the file " + file + ", ");
    std::filesystem::path there = file == "." ? path_ : path_.parent_path() / file;
    if (!std::filesystem::exists(there)) there = path_.parent_path() / std::filesystem::path(file).filename();
    if (!std::filesystem::exists(there)) fail(lacks + "which is missing; copy it there too");
    const Hdf5File of_source(there);
    if (!of_source.has(source)) fail(lacks + "which has no dataset " + source + "; write it again");
    of_source.require_sources(source, depth + 1);
  }
}

std::vector<std::uint64_t> Hdf5File::shape(const std::string& dataset) const {
  if (!has(dataset)) fail_missing(dataset);
  const Id data(H5Dopen2(file_->id, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  const Id space(data < 0 ? -1 : H5Dget_space(data), H5Sclose);
  if (space < 0 && H5Oexists_by_name(file_->id, dataset.c_str(), H5P_DEFAULT) <= 0) fail_missing(dataset);
  if (space < 0) fail("its " + dataset + " is no dataset");
  const int rank = H5Sget_simple_extent_ndims(space);
  std::vector<hsize_t> extents(static_cast<std::size_t>(std::max(0, rank)));
  if (rank > 0) H5Sget_simple_extent_dims(space, extents.data(), nullptr);
  return {extents.begin(), extents.end()};
}

vtkSmartPointer<vtkDataArray> Hdf5File::read(const std::string& dataset) const {
  const std::vector<std::uint64_t> extents = shape(dataset);
  return read(dataset,
              {std::vector<std::uint64_t>(extents.size(), 0), std::vector<std::uint64_t>(extents.size(), 1), extents});
}

vtkSmartPointer<vtkDataArray> Hdf5File::read(const std::string& dataset, const HyperSlab& part) const {
  const std::vector<std::uint64_t> extents = shape(dataset);
  if (!part.is_inside(extents))
    fail("its dataset " + dataset + " is smaller than what is wanted of it: cut off, or of another mesh");
  std::uint64_t count = 1;
  for (const std::uint64_t extent : part.count) {
    if (extent > 0 && count > ~std::uint64_t{0} / extent) fail("its dataset " + dataset + " is damaged");
    count *= extent;
  }
  require_sources(dataset, 0);
  const Id access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  H5Pset_efile_prefix(access, "${ORIGIN}");  // Its other files are beside it.
  const Id data(H5Dopen2(file_->id, dataset.c_str(), access), H5Dclose);
  const Id space(H5Dget_space(data), H5Sclose), type(H5Dget_type(data), H5Tclose);
  auto [array, memory_type] = array_for(type);
  if (!array) fail("its dataset " + dataset + " has no numbers");
  array->SetNumberOfTuples(static_cast<vtkIdType>(count));
  if (count == 0) return array;
  const std::vector<hsize_t> start(part.start.begin(), part.start.end()),
      stride(part.stride.begin(), part.stride.end()), counts(part.count.begin(), part.count.end());
  if (!extents.empty()) H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), stride.data(), counts.data(), nullptr);
  const hsize_t total = count;
  const Id memory(H5Screate_simple(1, &total, nullptr), H5Sclose);
  if (H5Dread(data, memory_type, memory, space, H5P_DEFAULT, array->GetVoidPointer(0)) < 0)
    fail("its dataset " + dataset +
         " cannot be read: damaged, cut off, or compressed by a filter that is not installed");
  if (is_made_up(data, memory_type, *array, part))
    fail("its dataset " + dataset + " was announced, and not written there; write it again");
  return array;
}

std::vector<double> Hdf5File::numbers(const std::string& object, const std::string& attribute) const {
  const Id id(H5Aopen_by_name(file_->id, object.c_str(), attribute.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const Id space(id < 0 ? -1 : H5Aget_space(id), H5Sclose);
  const hssize_t count = space < 0 ? 0 : H5Sget_simple_extent_npoints(space);
  std::vector<double> values(static_cast<std::size_t>(std::clamp<hssize_t>(count, 0, 64)));
  if (count < 1 || count > 64 || H5Aread(id, H5T_NATIVE_DOUBLE, values.data()) < 0)
    fail("has no attribute " + attribute + " of " + object + " with numbers");
  return values;
}

std::string Hdf5File::text(const std::string& object, const std::string& attribute) const {
  const Id id(H5Aopen_by_name(file_->id, object.c_str(), attribute.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const Id type(id < 0 ? -1 : H5Aget_type(id), H5Tclose);
  const bool is_text = type >= 0 && H5Tget_class(type) == H5T_STRING;
  if (is_text && H5Tis_variable_str(type) > 0) {
    char* text = nullptr;
    if (H5Aread(id, type, &text) < 0 || !text) fail("its attribute " + attribute + " cannot be read");
    const std::string result = text;
    H5free_memory(text);
    return result;
  }
  std::string result(is_text ? std::min<std::size_t>(H5Tget_size(type), 4096) : 0, '\0');
  if (!is_text || result.size() != H5Tget_size(type) || H5Aread(id, type, result.data()) < 0)
    fail("has no attribute " + attribute + " of " + object + " with text");
  return result.c_str();
}

}  // namespace tensorray
