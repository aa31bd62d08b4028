#pragma once
/// The numbers of an array of a .vti file, read from the first to the last.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "images/vti_header.h"

namespace esvr::samples {

class VtiData {
 public:
  virtual ~VtiData() = default;
  /// Reads the chosen component of the next points or cells.
  /// \throws BadInput  the data is damaged or ends too early
  virtual void read(std::span<float> out) = 0;
};

/// What is read of an array.
struct VtiSelection {
  std::uint64_t tuples = 0;  ///< points or cells
  std::size_t component = 0;
};

/// The name of the type of an array's numbers for elementType().
/// \throws BadInput  VTK's type is unknown
[[nodiscard]] std::string elementNameOf(const VtiArray& array);

/// \throws BadInput  the length that the file names is not that of the array
[[nodiscard]] std::unique_ptr<VtiData> openVtiData(const std::filesystem::path& path,
                                                   const VtiHeader& header, const VtiArray& array,
                                                   const VtiSelection& selection);

}  // namespace esvr::samples
