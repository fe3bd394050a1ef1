#pragma once
/// Reads datasets of HDF5 files as VTK's arrays. Only the .cpp file includes HDF5.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

class vtkDataArray;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// A part of a dataset: from `start` on, every `stride`-th, `count` in all, along each of its axes.
struct HyperSlab {
  std::vector<std::uint64_t> start, stride, count;

  bool is_inside(const std::vector<std::uint64_t>& shape) const;
};

/// An open file. Errors are thrown as std::runtime_error that names the file and the dataset.
class Hdf5File {
 public:
  explicit Hdf5File(const std::filesystem::path& path);
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  bool has(const std::string& name) const;
  bool has_attribute(const std::string& object, const std::string& attribute) const;
  bool has_numbers(const std::string& dataset) const;  ///< False for text, groups, ...

  /// The names of what is in a group, sorted; empty if there is no such group.
  std::vector<std::string> children(const std::string& group) const;

  std::vector<std::uint64_t> shape(const std::string& dataset) const;

  /// The numbers of a dataset, or of a part of it, in their order: float or double as in the file, integers as
  /// vtkIdType. One component. Checks that the part is inside the dataset before it allocates memory. Numbers that HDF5
  /// would make up are an error: of virtual datasets whose sources are missing, and where nothing of the part was
  /// written.
  vtkSmartPointer<vtkDataArray> read(const std::string& dataset) const;
  vtkSmartPointer<vtkDataArray> read(const std::string& dataset, const HyperSlab& part) const;

  std::vector<double> numbers(const std::string& object, const std::string& attribute) const;
  std::string text(const std::string& object, const std::string& attribute) const;

 private:
  [[noreturn]] void fail(const std::string& what) const;
  [[noreturn]] void fail_missing(const std::string& dataset) const;
  void require_sources(const std::string& dataset, int depth) const;

  struct Handle;
  std::filesystem::path path_;
  std::unique_ptr<Handle> file_;
};

}  // namespace tensorray
