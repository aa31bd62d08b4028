// Reads baselines of `esvr-compare check` and compares the record of one grid with them.

#include <cstdint>

#include "compare/check.h"
#include "esvr/error.h"
#include "fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static esvr::fuzz::InputFile file(".json");
  esvr::compare::CheckRecord record;
  record.candidateBytes = 1000;
  record.grids.push_back({.name = "density", .candidateName = "density"});
  record.grids[0].figures = esvr::compare::figuresOf(record.grids[0].metrics);
  const auto& path = file.write(data, size);
  try {
    (void)esvr::compare::baselineHasSsim(path);
    esvr::compare::judgeBaseline(path, record);
    esvr::compare::updateBaseline(path, record);
    esvr::compare::judgeBaseline(path, record);
  } catch (const esvr::BadInput&) {
  }
  return 0;
}
