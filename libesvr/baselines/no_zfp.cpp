#include "baselines/zfp_codec.h"
#include "esvr/error.h"

namespace esvr {
namespace {

[[noreturn]] void refuse() { throw UsageError("this build has no ZFP (libzfp-dev was not found)"); }

}  // namespace

std::string zfpVersion() { return {}; }

namespace baselines {

std::vector<std::byte> compressZfp(const DenseBox&, const ZfpSetting&, const std::string&) {
  refuse();
}
void decompressZfp(std::span<const std::byte>, const std::filesystem::path&, DenseBox&) {
  refuse();
}

}  // namespace baselines
}  // namespace esvr
