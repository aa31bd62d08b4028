#pragma once
/// Command lines that a program refuses.

#include <gmock/gmock.h>

#include <ostream>
#include <string>
#include <vector>

#include "cli/run_program.h"

namespace esvr::test {

struct Refusal {
  std::vector<std::string> arguments;  ///< "DIR/" stands for the test's folder
  int code;
  const char* words;  ///< in the message

  [[nodiscard]] std::vector<std::string> argumentsIn(const TemporaryFolder& folder) const {
    const std::string place = folder / "";
    std::vector<std::string> all = arguments;
    for (std::string& argument : all)
      for (std::size_t i = 0; (i = argument.find("DIR/", i)) != std::string::npos;
           i += place.size())
        argument.replace(i, 4, place);
    return all;
  }
  void expectOf(const ProgramRun& run) const {
    EXPECT_EQ(run.exitCode, code) << run.err;
    EXPECT_THAT(run.err, testing::HasSubstr(words));
  }
};
inline std::ostream& operator<<(std::ostream& out, const Refusal& refusal) {
  return out << testing::PrintToString(refusal.arguments);
}

}  // namespace esvr::test
