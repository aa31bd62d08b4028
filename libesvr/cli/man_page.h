#pragma once
/// The man page of a program, from the texts and options of its --help.

#include <boost/program_options/options_description.hpp>
#include <string>
#include <vector>

#include "cli/program_text.h"

namespace esvr::cli {

/// A group of options of a man page.
struct OptionGroup {
  const char* title;
  const boost::program_options::options_description* options;
};

/// The man page of section 1 in the language of man(7). It has no date, so that the same sources
/// give the same bytes.
[[nodiscard]] std::string manPage(const ProgramText& text, const std::vector<OptionGroup>& groups);

/// The long names of the options with their dashes, one on a line, for completion in a shell.
[[nodiscard]] std::string optionNames(const std::vector<OptionGroup>& groups);

}  // namespace esvr::cli
