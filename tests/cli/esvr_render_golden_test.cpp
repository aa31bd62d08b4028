// Plan: a separate process draws a blob by each method. The folder golden/ has the expected
// pictures, with which the tests compare the results.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "cli/esvr_render_fixture.h"

namespace esvr::test {
namespace {

/// The options with which the blob is drawn.
struct Golden {
  const char *name, *input;
  std::vector<std::string> options;
};
std::ostream& operator<<(std::ostream& out, const Golden& golden) { return out << golden.name; }

class GoldenPicture : public EsvrRender, public testing::WithParamInterface<Golden> {
 protected:
  [[nodiscard]] static std::filesystem::path golden() {
    return std::string(ESVR_SOURCE_DIR "/tests/cli/golden/") + GetParam().name + ".png";
  }
};

// Instruction sets differ by about 1e-6 of a value, which can change a channel by one level of 8
// bits. A ray may also end one sample later, which changes a channel by at most 1/4096.
// ESVR_UPDATE_GOLDEN=1 stores the pictures of this machine after an intended change.
TEST_P(GoldenPicture, isDrawnAgain) {
  auto options = GetParam().options;
  options.insert(options.end(), {"--device", "cpu", "--resolution", "48x48"});
  const Pixels found = picture(GetParam().input, options);
  if (std::getenv("ESVR_UPDATE_GOLDEN"))
    std::filesystem::copy_file(folder_ / "out.png", golden(),
                               std::filesystem::copy_options::overwrite_existing);
  const Pixels expected = readPng(golden());
  ASSERT_EQ(found.rgba.size(), expected.rgba.size());
  int largest = 0, visible = 0;
  for (std::size_t i = 0; i < expected.rgba.size(); ++i) {
    largest = std::max(largest, std::abs(int(found.rgba[i]) - int(expected.rgba[i])));
    visible += expected.rgba[i] > 0;
  }
  EXPECT_LE(largest, 2);
  EXPECT_GT(visible, 1000) << "an empty picture proves nothing";
}

INSTANTIATE_TEST_SUITE_P(
    Pictures, GoldenPicture,
    testing::Values(Golden{"default", "in.esvr", {}}, Golden{"voxels", "in.vdb", {}},
                    Golden{"sum", "in.esvr", {"--between", "sum", "--colors", "inferno"}},
                    Golden{"tent", "in.esvr", {"--opacity", "tent"}},
                    Golden{"post", "in.vdb", {"--classification", "post"}},
                    Golden{"maximum", "in.esvr", {"--mode", "maximum", "--background", "1,1,1"}},
                    Golden{"slice", "in.vdb", {"--slice", "z=15", "--opacity-length", "0.2"}},
                    Golden{"orthographic", "in.esvr", {"--orthographic", "--eye", "15,15,90"}}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace esvr::test
