#include "format/bytes.h"

#include <xxhash.h>

namespace esvr::format {
namespace {

constexpr XXH64_hash_t kSeed = 0;

}  // namespace

std::uint64_t checksum(std::span<const std::byte> bytes) {
  return XXH64(bytes.data(), bytes.size(), kSeed);
}

RunningChecksum::RunningChecksum() : state_(XXH64_createState()) {
  XXH64_reset(state_.get(), kSeed);
}

void RunningChecksum::add(std::span<const std::byte> piece) {
  XXH64_update(state_.get(), piece.data(), piece.size());
}

std::uint64_t RunningChecksum::value() const { return XXH64_digest(state_.get()); }

void RunningChecksum::Free::operator()(XXH64_state_s* state) const { XXH64_freeState(state); }

}  // namespace esvr::format
