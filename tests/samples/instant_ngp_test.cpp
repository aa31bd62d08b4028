// Plan: a model comes back from its file as it was written, a file that is cut or changed in its header
// is refused, and so is an array with another number of voxels. The fit itself needs a GPU.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "compressors/instant_ngp/volume.h"

namespace {

const ngp::Stored kModel{{5, 6, 7}, {8, 10, 32}, 2.5f, {1, 2, 65535}};

class InstantNgp : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string path() const { return folder_ / "model.ngp"; }

  /// Overwrites a byte of the file.
  void change(std::streamoff at, char to) const {
    std::fstream stream(path(), std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(at);
    stream.put(to);
  }

  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("ngp" + std::to_string(::getpid()));
};

TEST_F(InstantNgp, readsTheModelThatWasWritten) {
  ngp::writeModel(path(), kModel);
  const ngp::Stored read = ngp::readModel(path());
  EXPECT_EQ(read.sides, kModel.sides);
  EXPECT_EQ(read.shape.levels, 8u);
  EXPECT_EQ(read.shape.tableBits, 10u);
  EXPECT_EQ(read.shape.neurons, 32u);
  EXPECT_EQ(read.peak, 2.5f);
  EXPECT_EQ(read.parameters, kModel.parameters);
  EXPECT_EQ(std::filesystem::file_size(path()), ngp::kHeaderBytes + 3 * sizeof(std::uint16_t));
}

TEST_F(InstantNgp, refusesOtherFiles) {
  ngp::writeModel(path(), kModel);
  std::filesystem::resize_file(path(), ngp::kHeaderBytes - 1);
  EXPECT_THROW((void)ngp::readModel(path()), std::runtime_error) << "it was cut";
  for (const std::streamoff at : {0, 20, 24, 28}) {  // the name, levels, bits of a table, neurons
    ngp::writeModel(path(), kModel);
    change(at, 99);
    EXPECT_THROW((void)ngp::readModel(path()), std::runtime_error) << "byte " << at;
  }
  EXPECT_THROW((void)ngp::readModel(path() + ".missing"), std::runtime_error);
}

TEST_F(InstantNgp, refusesArraysOfAnotherSize) {
  ngp::writeVoxels(path(), std::vector<float>(6, 1.5f));
  EXPECT_EQ(ngp::readVoxels(path(), {1, 2, 3}), std::vector<float>(6, 1.5f));
  EXPECT_THROW((void)ngp::readVoxels(path(), {2, 2, 2}), std::runtime_error);
}

}  // namespace
