#pragma once
/// The XML part of VTK's image data (.vti).

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace esvr::samples {

/// An array of points or cells.
struct VtiArray {
  std::string name, type;  ///< type: "Float32"
  std::uint64_t components = 1;
  bool ofCells = false;
  std::string format;        ///< "ascii", "binary" or "appended"
  std::uint64_t offset = 0;  ///< appended: in the appended data
  /// Else: the bytes of the file that hold the data.
  std::uint64_t begin = 0, end = 0;
};

struct VtiHeader {
  /// First and last index of points along x, then y, then z.
  std::array<double, 6> extent{};
  std::array<double, 3> origin{}, spacing{1.0, 1.0, 1.0};
  std::array<double, 9> direction{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};  ///< row by row
  bool bigEndian = false;
  std::size_t lengthBytes = 4;  ///< bytes of each number before binary data
  bool compressed = false;      ///< binary and appended data is compressed by zlib
  std::vector<VtiArray> arrays;
  std::string activeOfPoints, activeOfCells;  ///< names of arrays; may be empty
  std::uint64_t appended = 0;                 ///< place in the file where the appended data begins
  bool appendedAsBase64 = false;
};

/// Reads the XML up to the appended data.
/// \throws BadInput  the file is not readable, or holds something else than one piece of image data
///                   (the text says what)
[[nodiscard]] VtiHeader readVtiHeader(const std::filesystem::path& path);

}  // namespace esvr::samples
