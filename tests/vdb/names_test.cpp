/// Plan: the name that a user gives finds the right grid, also for empty names, shared names and
/// names that look like numbered ones. Grids that cannot be fitted are listed by name and type.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "esvr/error.h"
#include "vdb/empty_grid.h"
#include "vdb/made_files.h"
#include "vdb/test_files.h"

namespace esvr {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// Grids with these names. The voxel (0, 0, 0) of the first one holds 1, of the second one 2, ...
openvdb::GridPtrVec gridsNamed(const std::vector<std::string>& names) {
  openvdb::GridPtrVec grids;
  for (const auto& name : names) {
    auto grid = test::smallGrid();
    grid->setName(name);
    grid->tree().setValue({0, 0, 0}, float(grids.size() + 1));
    grids.push_back(grid);
  }
  return grids;
}

/// Names of grids in a file and their unique names.
struct Order {
  std::vector<std::string> names, unique;
};

class Names : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return directory_ / "in.vdb"; }
  [[nodiscard]] std::vector<std::string> uniqueNames() const {
    std::vector<std::string> names;
    for (const auto& grid : inspectVdb(path()).grids) names.push_back(grid.uniqueName);
    return names;
  }
  [[nodiscard]] float mark(const std::string& name) const {
    return valueAt(readGrid(path(), name).volume, {0, 0, 0});
  }
  test::TemporaryFolder directory_;
};

TEST_F(Names, StandInFileOrder) {
  test::save(path(), gridsNamed({"zebra", "ant", "mole"}));
  EXPECT_THAT(uniqueNames(), ElementsAre("zebra", "ant", "mole"));
  EXPECT_EQ(mark("ant"), 2.0f);
}

TEST_F(Names, SharedByGridsAreNumberedFromZero) {
  test::save(path(), gridsNamed({"a", "b", "a", "a"}));
  EXPECT_THAT(uniqueNames(), ElementsAre("a[0]", "b", "a[1]", "a[2]"));
  EXPECT_THAT([&] { (void)mark("a"); }, ThrowsMessage<BadInput>(HasSubstr("has 3 grids \"a\"")));
  EXPECT_EQ(mark("a[0]"), 1.0f);
  EXPECT_EQ(mark("a[1]"), 3.0f);
  EXPECT_EQ(mark("a[2]"), 4.0f);
  EXPECT_EQ(mark("b[0]"), 2.0f);
}

TEST_F(Names, MayBeEmpty) {
  test::save(path(), gridsNamed({""}));
  EXPECT_THAT(uniqueNames(), ElementsAre("(unnamed)"));
  EXPECT_EQ(mark(""), 1.0f);
  EXPECT_EQ(mark("(unnamed)"), 1.0f);
  test::save(path(), gridsNamed({"", "", "x"}));
  EXPECT_THAT(uniqueNames(), ElementsAre("(unnamed)[0]", "(unnamed)[1]", "x"));
  EXPECT_EQ(mark("[1]"), 2.0f);
  EXPECT_EQ(readGrid(path(), "[1]").descriptor.name, "");
}

TEST_F(Names, MayLookNumbered) {
  test::save(path(), gridsNamed({"a[1]", "b"}));
  EXPECT_THAT(uniqueNames(), ElementsAre("a[1]", "b"));
  EXPECT_EQ(mark("a[1]"), 1.0f);
}

/// OpenVDB's own look-up finds "a[1]" for the grid of this very name and for the second "a".
TEST_F(Names, ThatLookNumberedWinAndNoGridIsTakenForAnother) {
  const std::vector<Order> orders{{{"a", "a", "a[1]"}, {"a[0]", "a#2", "a[1]"}},
                                  {{"a[0]", "a", "a"}, {"a[0]", "a#2", "a[1]"}}};
  for (const auto& [names, unique] : orders) {
    test::save(path(), gridsNamed(names));
    EXPECT_EQ(uniqueNames(), unique);
    for (std::size_t g = 0; g < unique.size(); ++g) {
      EXPECT_EQ(mark(unique[g]), float(g + 1));
      EXPECT_EQ(valueAt(readGrid(path(), g).volume, {0, 0, 0}), float(g + 1));
    }
  }
}

/// A written file has no grid that OpenVDB finds for the name of another.
TEST_F(Names, OfWrittenGridsAreToldApartByOpenVdb) {
  std::vector<VolumeGrid> grids;
  for (const char* name : {"a", "a", "a[1]"})
    grids.push_back(test::gridOf(name, {{{0, 0, 0}, float(grids.size() + 1)}}));
  writeGrids(path(), {}, grids);
  for (std::size_t g = 0; g < grids.size(); ++g)
    EXPECT_EQ(valueAt(readGrid(path(), g).volume, {0, 0, 0}), float(g + 1));
  const auto found = openvdb::gridPtrCast<openvdb::FloatGrid>(test::load(path(), "a[1]"));
  EXPECT_EQ(found->tree().getValue({0, 0, 0}), 3.0f);
}

TEST_F(Names, OfPlacesThatAreNotThereAreRefused) {
  test::save(path(), gridsNamed({"a", "b"}));
  EXPECT_THAT([&] { (void)readGrid(path(), std::size_t{2}); },
              ThrowsMessage<BadInput>(HasSubstr("has no grid number 3, only 2 grids")));
}

TEST_F(Names, AreListedForAnUnknownName) {
  test::save(path(), gridsNamed({"a", "b", "a"}));
  for (const char* name : {"c", "a[2]", "b[1]", "", "A"})
    EXPECT_THAT([&] { (void)readGrid(path(), name); },
                ThrowsMessage<BadInput>(AllOf(HasSubstr("in.vdb"), HasSubstr(name),
                                              HasSubstr("\"a[0]\", \"b\", \"a[1]\""))));
}

TEST_F(Names, OfAFileWithoutGridsAreNone) {
  test::save(path(), {});
  EXPECT_TRUE(inspectVdb(path()).grids.empty());
  EXPECT_THAT([&] { (void)readGrid(path(), "a"); }, ThrowsMessage<BadInput>(HasSubstr("none")));
}

TEST_F(Names, OfGridsThatCannotBeFittedComeWithTheirType) {
  openvdb::GridPtrVec grids;
  for (const char* type : {"bool", "mask", "int32", "int64", "vec3i", "ptdataidx32"})
    grids.push_back(test::emptyGrid(std::string("Tree_") + type + "_5_4_3", type));
  grids.push_back(test::smallGrid());
  test::save(path(), grids);
  const auto listed = inspectVdb(path()).grids;
  ASSERT_EQ(listed.size(), 7u);
  EXPECT_THAT(listed[0].skipReason, HasSubstr("bool"));
  EXPECT_THAT(listed[1].skipReason, HasSubstr("mask"));
  EXPECT_THAT(listed[2].skipReason, HasSubstr("int32"));
  EXPECT_THAT(listed[3].skipReason, HasSubstr("int64"));
  EXPECT_THAT(listed[4].skipReason, HasSubstr("vec3i"));
  EXPECT_THAT(listed[5].skipReason, HasSubstr("points"));
  EXPECT_EQ(listed[6].skipReason, "");
  EXPECT_THAT([&] { (void)readGrid(path(), "vec3i"); },
              ThrowsMessage<BadInput>(HasSubstr("of type vec3i")));
  EXPECT_EQ(activeVoxelCount(readGrid(path(), "density").volume), 3u);
}

TEST_F(Names, OfTypesThatOpenVdbDoesNotKnowAreListedToo) {
  // The tree has another shape, as in other programs' files: the type of the first grid is
  // rewritten.
  const auto other = test::smallGrid();
  other->setName("other");
  test::save(path(), {other, test::smallGrid()});
  auto bytes = test::bytesOf(path());
  const std::string known = "Tree_float_5_4_3", odd = "Tree_float_4_3_3";
  const auto asByte = [](std::byte b, char c) { return b == std::byte(c); };
  const auto at = std::search(bytes.begin(), bytes.end(), known.begin(), known.end(), asByte);
  ASSERT_NE(at, bytes.end());
  std::memcpy(&*at, odd.data(), odd.size());
  test::writeBytes(path(), bytes);
  const auto listed = inspectVdb(path()).grids;
  ASSERT_EQ(listed.size(), 2u);
  EXPECT_EQ(listed[0].valueType, "float");
  EXPECT_THAT(listed[0].skipReason, HasSubstr("Tree_float_4_3_3"));
  EXPECT_EQ(activeVoxelCount(readGrid(path(), "density").volume), 3u);
}

}  // namespace
}  // namespace esvr
