// One fuzzer, ESVR_FUZZER_NAME, under libFuzzer, which has the main function.

#include <cstdlib>

#include "fuzz/fuzzer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const esvr::fuzz::Fuzzer fuzzer = esvr::fuzz::findFuzzer(ESVR_FUZZER_NAME);
  if (!fuzzer) std::abort();
  return fuzzer(data, size);
}
