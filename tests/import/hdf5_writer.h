#pragma once
/// Writes HDF5 files for the tests of readers.

#include <vtk_hdf5.h>

#include "tests/names.h"

namespace tensorray {

/// An HDF5 file that is being written. Groups are made where they are needed.
class Hdf5Writer {
 public:
  explicit Hdf5Writer(const std::filesystem::path& path)
      : file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)),
        with_groups_(H5Pcreate(H5P_LINK_CREATE)) {
    H5Pset_create_intermediate_group(with_groups_, 1);
  }
  ~Hdf5Writer() {
    H5Pclose(with_groups_);
    H5Fclose(file_);
  }
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  void group(const std::string& name) {
    H5Gclose(H5Gcreate2(file_, name.c_str(), with_groups_, H5P_DEFAULT, H5P_DEFAULT));
  }

  void write(const std::string& name, const std::vector<hsize_t>& shape, const std::vector<double>& values) {
    write(name, shape, values.data(), H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE);
  }
  void write(const std::string& name, const std::vector<hsize_t>& shape, const std::vector<int>& values) {
    write(name, shape, values.data(), H5T_NATIVE_INT, H5T_STD_I64LE);
  }

  /// A dataset that has a shape, and no numbers yet.
  void announce(const std::string& name, const std::vector<hsize_t>& shape) {
    write(name, shape, nullptr, H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE);
  }

  void text(const std::string& name, const std::string& value) {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, value.size());
    write(name, {1}, value.data(), type, type);
    H5Tclose(type);
  }

  /// What a VTKHDF file begins with.
  void begin_vtk(const std::string& type, const std::vector<double>& version = {2, 0}) {
    group("/VTKHDF");
    attribute("/VTKHDF", "Version", version);
    attribute("/VTKHDF", "Type", type);
  }

  void attribute(const std::string& object, const std::string& name, const std::vector<double>& values) {
    const hsize_t count = values.size();
    attribute(object, name, values.data(), H5T_NATIVE_DOUBLE, H5Screate_simple(1, &count, nullptr));
  }
  void attribute(const std::string& object, const std::string& name, const std::string& text) {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, text.size());
    attribute(object, name, text.data(), type, H5Screate(H5S_SCALAR));
    H5Tclose(type);
  }

 private:
  void write(const std::string& name, const std::vector<hsize_t>& shape, const void* values, hid_t memory,
             hid_t stored) {
    const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t data = H5Dcreate2(file_, name.c_str(), stored, space, with_groups_, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_TRUE(!values || H5Dwrite(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
    H5Dclose(data);
    H5Sclose(space);
  }

  /// Closes `space`.
  void attribute(const std::string& object, const std::string& name, const void* values, hid_t type, hid_t space) {
    const hid_t id =
        H5Acreate_by_name(file_, object.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Awrite(id, type, values), 0);
    H5Aclose(id);
    H5Sclose(space);
  }

  hid_t file_, with_groups_;
};

}  // namespace tensorray
