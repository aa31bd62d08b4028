#pragma once
/// Writes HDF5 files for tests.

#include <gtest/gtest.h>
#include <hdf5.h>

#include <filesystem>
#include <string>
#include <vector>

namespace esvr::samples {

using Hdf5Axes = std::vector<hsize_t>;

class Hdf5Writer {
 public:
  explicit Hdf5Writer(const std::filesystem::path& path)
      : file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {}
  ~Hdf5Writer() { H5Fclose(file_); }
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  /// Writes numbers of a type in memory as those of another type.
  /// \param chunk  parts that are compressed; empty for none
  void add(const char* path, const Hdf5Axes& axes, hid_t type, hid_t memoryType, const void* values,
           const Hdf5Axes& chunk = {}) {
    const hid_t space = H5Screate_simple(int(axes.size()), axes.data(), nullptr);
    const hid_t properties = H5Pcreate(H5P_DATASET_CREATE), links = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(links, 1);
    if (!chunk.empty()) {
      H5Pset_chunk(properties, int(chunk.size()), chunk.data());
      H5Pset_deflate(properties, 6);
    }
    const hid_t dataset = H5Dcreate2(file_, path, type, space, links, properties, H5P_DEFAULT);
    EXPECT_GE(H5Dwrite(dataset, memoryType, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), 0);
    H5Dclose(dataset);
    H5Pclose(links);
    H5Pclose(properties);
    H5Sclose(space);
  }

  void addBytes(const char* path, const Hdf5Axes& axes, const std::string& bytes) {
    add(path, axes, H5T_STD_U8LE, H5T_NATIVE_UINT8, bytes.data());
  }

  void addSize(const char* path, const std::vector<double>& zyx) {
    const hid_t dataset = H5Dopen2(file_, path, H5P_DEFAULT);
    const hsize_t count = zyx.size();
    const hid_t space = H5Screate_simple(1, &count, nullptr);
    const hid_t attribute =
        H5Acreate2(dataset, "element_size_um", H5T_IEEE_F64BE, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, H5T_NATIVE_DOUBLE, zyx.data());
    H5Aclose(attribute);
    H5Sclose(space);
    H5Dclose(dataset);
  }

 private:
  hid_t file_;
};

}  // namespace esvr::samples
