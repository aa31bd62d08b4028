#pragma once
/// Dense arrays of voxels in files, and the file of a model.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace ngp {

/// Number of voxels along x, y and z. x is fastest in an array.
using Sides = std::array<std::uint32_t, 3>;

[[nodiscard]] std::size_t voxelsOf(const Sides& sides);

/// \throws std::runtime_error  the file cannot be read, or does not have these voxels as float32
[[nodiscard]] std::vector<float> readVoxels(const std::string& path, const Sides& sides);

/// \throws std::runtime_error  the file cannot be written
void writeVoxels(const std::string& path, const std::vector<float>& voxels);

inline constexpr std::uint32_t kMostLevels = 16, kMostTableBits = 24;

/// What determines a model besides its parameters.
struct Shape {
  std::uint32_t levels = 16;    ///< of the hash grid; each has 2 features
  std::uint32_t tableBits = 8;  ///< logarithm of the largest number of entries of a level
  std::uint32_t neurons = 64;   ///< of each of the 2 hidden layers: 16, 32 or 64
};

/// A model as it is stored.
struct Stored {
  Sides sides{};
  Shape shape;
  float peak = 0.0f;                      ///< factor of the values
  std::vector<std::uint16_t> parameters;  ///< the bits of float16
};

/// Bytes of a file with no parameters.
inline constexpr std::size_t kHeaderBytes = 8 + 6 * sizeof(std::uint32_t) + sizeof(float);

/// \throws std::runtime_error  the file cannot be written
void writeModel(const std::string& path, const Stored& model);

/// \throws std::runtime_error  the file cannot be read or is damaged
[[nodiscard]] Stored readModel(const std::string& path);

}  // namespace ngp
