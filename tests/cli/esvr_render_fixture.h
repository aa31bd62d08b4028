#pragma once
/// The folder of a test of esvr-render.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "cli/png_pixels.h"
#include "cli/run_program.h"
#include "esvr/container.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"
#include "field/random_field.h"

namespace esvr::test {

/// A folder with a blob of ellipsoids, `in.esvr`, and with its voxels, `in.vdb`.
class EsvrRender : public testing::Test {
 protected:
  EsvrRender() {
    Field field = randomField({.count = 12, .extent = 30.0, .smallest = 4.0, .aspect = 2.0});
    for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
    const SparseVolume volume = revoxelise(field, {});
    writeEsvr(folder_ / "in.esvr", {{}, {makeStoredGrid(density(), volume, field)}});
    const VolumeGrid grid{density(), volume, 0};
    writeGrids(folder_ / "in.vdb", {}, std::span(&grid, 1));
  }

  static GridDescriptor density() {
    GridDescriptor d;
    d.name = "density";
    d.gridClass = GridClass::kFogVolume;
    d.transform = uniformTransform(0.5);
    return d;
  }
  /// Draws a small picture unless `more` has a resolution.
  ProgramRun draw(const std::string& input, const std::string& output, Words more = {}) {
    more.insert(more.begin(), {folder_ / input, folder_ / output});
    if (std::find(more.begin(), more.end(), "--resolution") == more.end())
      more.insert(more.end(), {"--resolution", "64x48"});
    return runProgram(ESVR_RENDER, more);
  }
  Pixels picture(const std::string& input, const Words& more = {}) {
    auto arguments = more;
    arguments.emplace_back("-f");
    const auto run = draw(input, "out.png", arguments);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return readPng(folder_ / "out.png");
  }
  void expectRefused(const Words& more, int exitCode, const std::string& why) {
    const auto run = draw("in.esvr", "refused.png", more);
    EXPECT_EQ(run.exitCode, exitCode) << run.err;
    EXPECT_THAT(run.err, testing::HasSubstr(why));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "refused.png"));
  }

  TemporaryFolder folder_;
};

}  // namespace esvr::test
