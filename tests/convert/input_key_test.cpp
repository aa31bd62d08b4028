// Plan: the key of a grid changes with every bit of its volume and with the properties on which a
// conversion depends, and with nothing else.

#include <gtest/gtest.h>

#include <functional>

#include "convert/volumes.h"
#include "esvr/convert.h"

namespace esvr {
namespace {

struct Input {
  GridDescriptor descriptor;
  SparseVolume volume = test::tubeVolume();
  [[nodiscard]] InputKey key() const { return keyOf({descriptor, volume}); }
};

struct Change {
  const char* name;
  std::function<void(Input&)> make;
};
void PrintTo(const Change& change, std::ostream* out) { *out << change.name; }

class InputKeyChange : public testing::TestWithParam<Change> {};

TEST_P(InputKeyChange, IsNoticed) {
  Input input;
  GetParam().make(input);
  EXPECT_NE(input.key(), Input{}.key());
}

void toggle(BrickMask& mask) { mask.words[7] ^= std::uint64_t{1} << 63; }

INSTANTIATE_TEST_SUITE_P(
    All, InputKeyChange,
    testing::Values(
        Change{"value", [](Input& i) { i.volume.values.back() += 1e-6f; }},
        Change{"sign of zero", [](Input& i) { i.volume.background = -i.volume.background; }},
        Change{"activity", [](Input& i) { toggle(i.volume.active.back()); }},
        Change{"origin", [](Input& i) { i.volume.origin.z += kBrickSide; }},
        Change{"position of a brick", [](Input& i) { i.volume.bricks.back().z += 1; }},
        Change{"level set", [](Input& i) { i.descriptor.gridClass = GridClass::kLevelSet; }},
        Change{"doubles", [](Input& i) { i.descriptor.valueType = ValueType::kDouble; }}));

TEST(InputKey, DoesNotDependOnTheRestOfTheDescriptor) {
  Input input;
  input.descriptor.name = "other";
  input.descriptor.gridClass = GridClass::kFogVolume;
  input.descriptor.valueType = ValueType::kHalf;
  input.descriptor.transform.mapType = "AffineMap";
  input.descriptor.metadata = {{"note", "string", {}}};
  EXPECT_EQ(input.key(), Input{}.key());
}

}  // namespace
}  // namespace esvr
