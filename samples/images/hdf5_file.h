#pragma once
/// The datasets of an HDF5 file.

#include <hdf5.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace esvr::samples {

/// An object of the HDF5 library, which is closed at the end.
class Hdf5Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Hdf5Handle() = default;
  /// An id below 0 is that of an error.
  Hdf5Handle(hid_t id, Close close) : id_(id), close_(close) {}
  ~Hdf5Handle() {
    if (id_ >= 0) close_(id_);
  }
  Hdf5Handle(Hdf5Handle&& other) noexcept;
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept;

  [[nodiscard]] hid_t id() const { return id_; }
  [[nodiscard]] bool isValid() const { return id_ >= 0; }

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

struct Hdf5Dataset {
  std::string path;
  std::vector<std::uint64_t> axes;  ///< lengths; that of x is the last one
  std::string type;                 ///< "uint16", "float32"; "other" if the values are no numbers
  std::optional<double> maximum;    ///< largest value of an integer type

  [[nodiscard]] bool isOfNumbers() const { return type != "other"; }
};

/// "/volume (64 x 128 x 128 uint16)", with the slowest axis first as in HDF5's own tools.
[[nodiscard]] std::string textOf(const Hdf5Dataset& dataset);

class Hdf5File {
 public:
  /// \throws BadInput  the file is not readable
  explicit Hdf5File(std::filesystem::path path);

  /// All datasets in the order of their names.
  [[nodiscard]] std::vector<Hdf5Dataset> datasets() const;

  /// Opens a dataset with a cache of so many bytes for compressed parts.
  /// \throws BadInput  it cannot be opened
  [[nodiscard]] Hdf5Handle open(const Hdf5Dataset& dataset, std::size_t cacheBytes) const;

  /// \throws BadInput  always; the text has what the library says of its last error
  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::filesystem::path path_;
  Hdf5Handle file_;
};

/// The edges of a voxel along x, y and z by the attribute element_size_um of a dataset.
[[nodiscard]] std::optional<std::array<double, 3>> elementSize(const Hdf5Handle& dataset);

/// Bytes of the parts (chunks) of a dataset that a plane through it meets; 0 if it has no parts.
/// \param axis  the axis that is normal to the plane
[[nodiscard]] double chunkBytesOfPlane(const Hdf5Handle& dataset,
                                       const std::vector<std::uint64_t>& axes, std::size_t axis);

}  // namespace esvr::samples
