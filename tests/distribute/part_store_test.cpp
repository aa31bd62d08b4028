// Plan: a store gives back what was put, also to a later process. It refuses damaged results, another
// origin, and a process that wants it while another one uses it.

#include "esvr/workers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "distribute/fake_parts.h"
#include "esvr/error.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

using Access = PartStore::Access;
using test::keyOfPart;
using test::resultOfPart;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

class PartStoreTest : public testing::Test {
 protected:
  [[nodiscard]] std::string path() const { return folder_ / "parts"; }
  [[nodiscard]] std::string onlyResult() const {
    for (const auto& entry : std::filesystem::directory_iterator(path()))
      if (entry.path().extension() == ".part") return entry.path();
    return {};
  }
  std::vector<PartOrigin> origin_{{"input", "a.vdb"}, {"count", "300"}};
  test::TemporaryFolder folder_;
};

TEST_F(PartStoreTest, GivesBackWhatWasPutAlsoLater) {
  {
    PartStore store(path(), origin_, Access::kAlone);
    EXPECT_FALSE(store.find(keyOfPart(1)).has_value());
    store.put(keyOfPart(1), resultOfPart(1));
    store.put(keyOfPart(2), {});
  }
  const PartStore store(path(), origin_, Access::kAlone);
  EXPECT_EQ(store.find(keyOfPart(1)), resultOfPart(1));
  EXPECT_EQ(store.find(keyOfPart(2)), std::vector<std::byte>{});
  EXPECT_FALSE(store.find(keyOfPart(3)).has_value());
}

TEST_F(PartStoreTest, RefusesADamagedResultAndNamesIt) {
  PartStore store(path(), origin_, Access::kAlone);
  for (const auto offset : {0, 9, 17, 26}) {  // magic, size, hash and content
    store.put(keyOfPart(5), resultOfPart(5));
    std::fstream file(onlyResult(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(offset);
    file.put('!');
    file.close();
    EXPECT_THAT([&] { (void)store.find(keyOfPart(5)); },
                ThrowsMessage<BadInput>(HasSubstr(onlyResult() + " is damaged")))
        << offset;
  }
  std::filesystem::resize_file(onlyResult(), 10);
  EXPECT_THROW((void)store.find(keyOfPart(5)), BadInput);
}

TEST_F(PartStoreTest, RefusesAnotherOriginAndNamesBoth) {
  { const PartStore store(path(), origin_, Access::kAlone); }
  const auto open = [&](std::vector<PartOrigin> origin) {
    return [this, origin] { const PartStore store(path(), origin, Access::kAlone); };
  };
  EXPECT_THAT(open({{"input", "b.vdb"}, {"count", "300"}}),
              ThrowsMessage<BadInput>(HasSubstr("its input is a.vdb, not b.vdb")));
  EXPECT_THAT(open({{"input", "a.vdb"}, {"count", "30"}}),
              ThrowsMessage<BadInput>(HasSubstr("its count is 300, not 30")));
  EXPECT_THAT(open({{"input", "a.vdb"}, {"count", "300"}, {"seed", "1"}}),
              ThrowsMessage<BadInput>(HasSubstr("its seed is unknown")));
}

TEST_F(PartStoreTest, IsUsedByOneProcessOrSharedBySeveral) {
  const auto opening = [&](Access access) {
    return [this, access] { const PartStore store(path(), origin_, access); };
  };
  const auto inUse = ThrowsMessage<RuntimeFailure>(HasSubstr("another process uses"));
  {
    const PartStore store(path(), origin_, Access::kAlone);
    EXPECT_THAT(opening(Access::kAlone), inUse);
    EXPECT_THAT(opening(Access::kShared), inUse);
  }
  const PartStore store(path(), origin_, Access::kShared);
  EXPECT_NO_THROW(opening(Access::kShared)());
  EXPECT_THAT(opening(Access::kAlone), inUse);
}

TEST_F(PartStoreTest, RemovesItsFolder) {
  PartStore store(path(), origin_, Access::kAlone);
  store.put(keyOfPart(1), resultOfPart(1));
  store.remove();
  EXPECT_FALSE(std::filesystem::exists(path()));
}

TEST_F(PartStoreTest, NamesAFolderThatCannotBeMade) {
  std::ofstream(folder_ / "file") << "text";
  const std::string inFile = folder_ / "file/parts";
  EXPECT_THAT([&] { const PartStore store(inFile, origin_, Access::kAlone); },
              ThrowsMessage<RuntimeFailure>(HasSubstr(inFile)));
}

}  // namespace
}  // namespace esvr
