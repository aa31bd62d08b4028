// Plan: grids of vectors come back with their names and components. They stand for their components
// in the order of a file, also between carried grids. Components that do not exist, that two
// vectors share or that differ in their descriptors are refused by the writer and by the reader. Files
// without vectors have the version that had none.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "format/crafted_file.h"
#include "format/sample_files.h"
#include "support/messages.h"

namespace esvr::test {
namespace {

using format::SectionKind;
using testing::ElementsAre;
using testing::HasSubstr;

/// A grid of numbers, and vectors with three grids as components.
EsvrFile fileOfVectors() {
  EsvrFile file{{}, {fogGrid(2)}};
  for (std::size_t c = 0; c < kComponents; ++c) {
    file.grids.push_back(fogGrid(c + 1));
    file.grids.back().descriptor.name = componentName("v", c);
    file.grids.back().descriptor.background = double(c);
  }
  file.vectors = {{"v", 1}};
  return file;
}

TEST(StoredVectors, ComeBackWithTheirComponents) {
  const EsvrFile file = fileOfVectors();
  const EsvrFile read = decodeEsvr(encodeEsvr(file), "f.esvr");
  EXPECT_EQ(difference(read, file), "");
  const VectorGrid vectors = decodeVector("v", componentsOf(read, read.vectors.front()));
  EXPECT_EQ(vectors.descriptor.name, "v");
  EXPECT_THAT(vectors.background, ElementsAre(0.0, 1.0, 2.0));
  for (std::size_t c = 0; c < kComponents; ++c)
    EXPECT_EQ(vectors.components[c].values, decodeGrid(file.grids[1 + c]).values);
}

TEST(StoredVectors, StandForTheirComponentsInTheOrderOfTheFile) {
  EsvrFile file = fileOfVectors();
  file.carried = {carriedGrid(1, "a"), carriedGrid(5, "b")};
  const GridOfFile fog{false, 0}, v{false, 0, true}, a{true, 0}, b{true, 1};
  EXPECT_THAT(gridsInOrder(file), ElementsAre(fog, a, v, b));
  EXPECT_THAT(namesInOrder(file), ElementsAre("density", "velocity", "v", "velocity"));
  EXPECT_EQ(lossOf(file), "");
}

TEST(StoredVectors, AreNotDividedByACarriedGrid) {
  for (const std::uint32_t place : {2u, 3u}) {
    EsvrFile file = fileOfVectors();
    file.carried = {carriedGrid(place, "a")};
    EXPECT_THAT(refusalToWrite(file), HasSubstr("cannot have place"));
  }
}

TEST(StoredVectors, WithoutComponentsOfTheirOwnAreNotWritten) {
  const std::vector<std::vector<StoredVector>> impossible{
      {{"v", 2}}, {{"v", 4}}, {{"v", 1}, {"w", 1}}, {{"v", 0}, {"w", 2}}, {{"v", std::size_t(-1)}}};
  for (const auto& vectors : impossible) {
    EsvrFile file = fileOfVectors();
    file.vectors = vectors;
    EXPECT_THAT(refusalToWrite(file), HasSubstr("no three components of its own"));
  }
}

TEST(StoredVectors, WhoseComponentsDifferAreNotWritten) {
  EsvrFile file = fileOfVectors();
  file.grids[2].descriptor.valueType = ValueType::kDouble;
  EXPECT_THAT(refusalToWrite(file), Says("'v'", "differ"));
}

TEST(StoredVectors, WithoutComponentsOfTheirOwnAreNotRead) {
  CraftedFile crafted(encodeEsvr(fileOfVectors()));
  crafted.section(SectionKind::kVector).entry.id.grid = 2;
  EXPECT_THAT(refusalToRead(crafted.assemble()),
              Says("lie.esvr", "no three components of its own"));
}

TEST(StoredVectors, NeedTheVersionThatHasThem) {
  constexpr std::size_t kMinorVersionAt = 10;
  EsvrFile file = fileOfVectors();
  EXPECT_EQ(encodeEsvr(file)[kMinorVersionAt], std::byte{2});
  file.vectors.clear();
  EXPECT_EQ(encodeEsvr(file)[kMinorVersionAt], std::byte{0});
}

TEST(StoredVectors, AddAtMostTheBytesThatTheyAreSaidToAdd) {
  EsvrFile file = fileOfVectors();
  const std::size_t with = encodeEsvr(file).size();
  const std::uint64_t said = bytesOfVectors(file.vectors);
  file.vectors.clear();
  const std::size_t without = encodeEsvr(file).size();
  EXPECT_LE(with, without + said);
  EXPECT_GT(with + kSectionRowBytes, without + said);
}

}  // namespace
}  // namespace esvr::test
