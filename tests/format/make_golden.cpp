// Writes the golden files: make_golden FOLDER SEQUENCE.esvr. After a release it is used for new files
// only, because existing ones must not change within a version of the format.

#include <filesystem>
#include <iostream>

#include "format/sample_files.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: make_golden FOLDER SEQUENCE.esvr\n";
    return 2;
  }
  for (const auto& golden : esvr::test::goldenFiles())
    esvr::test::writeBytes(std::filesystem::path(argv[1]) / (golden.name + ".esvr"),
                           esvr::test::bytesOf(golden));
  esvr::test::writeGoldenSequence(argv[2]);
}
