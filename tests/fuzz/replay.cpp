// Runs a fuzzer on the files of folders without a fuzzing engine: replay FUZZER FOLDER...

#include <iostream>
#include <iterator>

#include "fuzz/fuzzer.h"

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
