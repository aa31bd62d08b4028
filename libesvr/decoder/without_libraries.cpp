// What the decoder-only build has in place of libraries. xxHash: the checksum of the file format
// (format/bytes.h) is XXH64 after its specification (Y. Collet, "xxHash fast digest algorithm", version
// 0.2). Files mapped into memory: voxels are in memory only. Blosc: there are no bytes of carried grids, which
// mean nothing without OpenVDB.

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <new>

#include "esvr/error.h"
#include "esvr/volume.h"
#include "format/bytes.h"
#include "format/section_table.h"

namespace {

constexpr std::uint64_t kPrime1 = 0x9E3779B185EBCA87u, kPrime2 = 0xC2B2AE3D27D4EB4Fu,
                        kPrime3 = 0x165667B19E3779F9u, kPrime4 = 0x85EBCA77C2B2AE63u,
                        kPrime5 = 0x27D4EB2F165667C5u;
constexpr std::size_t kStripe = 32;  ///< bytes of a stripe, which has a word for each lane
constexpr std::size_t kLanes = 4;

/// The number at a place, which is little endian.
template <class Number>
Number numberAt(const std::byte* place) {
  static_assert(std::endian::native == std::endian::little);
  Number number;
  std::memcpy(&number, place, sizeof number);
  return number;
}

std::uint64_t round(std::uint64_t lane, std::uint64_t word) {
  return std::rotl(lane + word * kPrime2, 31) * kPrime1;
}

std::uint64_t avalanche(std::uint64_t hash) {
  hash = (hash ^ (hash >> 33)) * kPrime2;
  hash = (hash ^ (hash >> 29)) * kPrime3;
  return hash ^ (hash >> 32);
}

}  // namespace

/// The name is that of xxHash's state, which format/bytes.h declares.
struct XXH64_state_s {
  std::array<std::uint64_t, kLanes> lanes{kPrime1 + kPrime2, kPrime2, 0, 0 - kPrime1};
  std::array<std::byte, kStripe> rest{};  ///< bytes after the last whole stripe
  std::uint64_t bytes = 0;

  void addStripe(const std::byte* stripe) {
    for (std::size_t i = 0; i < kLanes; ++i)
      lanes[i] = round(lanes[i], numberAt<std::uint64_t>(stripe + i * sizeof(std::uint64_t)));
  }

  void add(std::span<const std::byte> piece) {
    while (!piece.empty()) {
      const std::size_t held = bytes % kStripe;
      const std::size_t taken = std::min(kStripe - held, piece.size());
      std::copy_n(piece.begin(), taken, rest.begin() + std::ptrdiff_t(held));
      if (held + taken == kStripe) addStripe(rest.data());
      bytes += taken;
      piece = piece.subspan(taken);
    }
  }

  [[nodiscard]] std::uint64_t merged() const {
    if (bytes < kStripe) return kPrime5;
    constexpr int kTurns[kLanes] = {1, 7, 12, 18};
    std::uint64_t hash = 0;
    for (std::size_t i = 0; i < kLanes; ++i) hash += std::rotl(lanes[i], kTurns[i]);
    for (const std::uint64_t lane : lanes) hash = (hash ^ round(0, lane)) * kPrime1 + kPrime4;
    return hash;
  }

  [[nodiscard]] std::uint64_t value() const {
    std::uint64_t hash = merged() + bytes;
    const std::byte* at = rest.data();
    const std::byte* const end = at + bytes % kStripe;
    for (; end - at >= 8; at += 8)
      hash = std::rotl(hash ^ round(0, numberAt<std::uint64_t>(at)), 27) * kPrime1 + kPrime4;
    if (end - at >= 4) {
      hash = std::rotl(hash ^ numberAt<std::uint32_t>(at) * kPrime1, 23) * kPrime2 + kPrime3;
      at += 4;
    }
    for (; at < end; ++at) hash = std::rotl(hash ^ std::uint64_t(*at) * kPrime5, 11) * kPrime1;
    return avalanche(hash);
  }
};

namespace esvr::format {

std::uint64_t checksum(std::span<const std::byte> bytes) {
  XXH64_state_s state;
  state.add(bytes);
  return state.value();
}

RunningChecksum::RunningChecksum() : state_(new XXH64_state_s) {}

void RunningChecksum::add(std::span<const std::byte> piece) { state_->add(piece); }

std::uint64_t RunningChecksum::value() const { return state_->value(); }

void RunningChecksum::Free::operator()(XXH64_state_s* state) const { delete state; }

}  // namespace esvr::format

namespace esvr {

VoxelMemory::VoxelMemory(const Files&) {
  throw RuntimeFailure("this decoder keeps voxels in memory only, not in files");
}

bool VoxelMemory::isInFile(std::uint64_t) const { return false; }

VoxelMemory VoxelMemory::forAllSizes() const { return *this; }

void* VoxelMemory::allocate(std::size_t bytes) const { return ::operator new(bytes); }

void VoxelMemory::deallocate(void* array, std::size_t) const noexcept { ::operator delete(array); }

namespace format {

VoxelArray<std::byte> readCarried(const ByteSource&, const SectionTable&, std::size_t,
                                  const VoxelMemory&) {
  throw RuntimeFailure("this decoder has no carried grids");
}

}  // namespace format

}  // namespace esvr
