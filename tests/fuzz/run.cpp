// Runs fuzzers: one, ESVR_FUZZER_NAME, under libFuzzer, which has the main function; or without a fuzzing engine the one
// that is named, on the files of folders: replay FUZZER FOLDER...

#include <cstdlib>
#include <iostream>
#include <iterator>

#include "fuzz/fuzzer.h"

#ifdef ESVR_FUZZER_NAME

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const esvr::fuzz::Fuzzer fuzzer = esvr::fuzz::findFuzzer(ESVR_FUZZER_NAME);
  if (!fuzzer) std::abort();
  return fuzzer(data, size);
}

#else

namespace {

int replay(esvr::fuzz::Fuzzer fuzzer, const std::filesystem::path& folder) {
  int inputs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::cout << entry.path().string() << std::endl;  // flushed before a crash
    std::ifstream in(entry.path(), std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(in), {});
    fuzzer(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    ++inputs;
  }
  return inputs;
}

}  // namespace

int main(int argc, char** argv) {
  const esvr::fuzz::Fuzzer fuzzer = argc > 2 ? esvr::fuzz::findFuzzer(argv[1]) : nullptr;
  if (!fuzzer) {
    std::cerr << "replay FUZZER FOLDER...\n";
    return 2;
  }
  for (int i = 2; i < argc; ++i)
    if (replay(fuzzer, argv[i]) == 0) {
      std::cerr << argv[i] << ": no input\n";
      return 1;
    }
  return 0;
}

#endif
