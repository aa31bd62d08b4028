// What a program says of itself: the texts of --help, its man page and its versions.
#include "programs/help_text.h"

#include <algorithm>
#include <boost/program_options/cmdline.hpp>
#include <nlohmann/json.hpp>
#include <sstream>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/vdb_io.h"

namespace esvr::cli {
namespace {

std::string wrappedLine(const std::string& line, std::size_t width) {
  if (line.starts_with(' ')) return line;
  std::string out, word;
  std::size_t used = 0;
  for (std::istringstream words(line); words >> word; used += word.size()) {
    if (used > 0) {
      const bool fits = used + 1 + word.size() <= width;
      out += fits ? ' ' : '\n';
      used = fits ? used + 1 : 0;
    }
    out += word;
  }
  return out;
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t width) {
  std::istringstream lines(text);
  std::string out;
  for (std::string line; std::getline(lines, line);) out += wrappedLine(line, width) + '\n';
  if (!out.empty()) out.pop_back();
  return out;
}

// The man page. Its language is that of man(7).

namespace {

/// Text for man(7): backslashes and hyphens are escaped, and no line begins with a control
/// character.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const bool beginsLine = out.empty() || out.back() == '\n';
    if (beginsLine && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return out;
}

/// The name of a page: that of a program, or of a program and its command with a hyphen.
std::string pageName(std::string program) {
  std::ranges::replace(program, ' ', '-');
  return program;
}

std::string inCapitals(std::string name) {
  std::ranges::transform(name, name.begin(),
                         [](char c) { return c >= 'a' && c <= 'z' ? char(c - 'a' + 'A') : c; });
  return name;
}

/// The first sentence without its full stop. A full stop in ".esvr" ends no sentence.
std::string firstSentence(const std::string& text) {
  std::string sentence = text.substr(0, text.find(". "));
  if (sentence.ends_with('.')) sentence.pop_back();
  return sentence;
}

/// Adds text whose lines and columns have a meaning.
void addLines(std::ostream& out, const char* title, const std::string& text) {
  if (!text.empty()) out << ".SH " << title << "\n.nf\n" << escaped(text) << "\n.fi\n";
}

/// Adds text whose lines are paragraphs, but for those that begin with a space.
void addParagraphs(std::ostream& out, const char* title, const std::string& text) {
  if (text.empty()) return;
  out << ".SH " << title << '\n';
  std::istringstream lines(text);
  const char* before = "";  // the first paragraph follows its title at once
  for (std::string line; std::getline(lines, line); before = ".PP\n")
    if (line.starts_with(' '))
      out << ".nf\n" << escaped(line) << "\n.fi\n";
    else if (!line.empty())
      out << before << escaped(line) << '\n';
}

/// The name of an option for a man page: "-g, --grid NAME".
std::string titleOf(const boost::program_options::option_description& option) {
  const std::string shortName = option.canonical_display_name(
      boost::program_options::command_line_style::allow_dash_for_short);
  std::string title = "\\fB\\-\\-" + escaped(option.long_name()) + "\\fR";
  if (shortName.size() == 2 && shortName.front() == '-')
    title = "\\fB" + escaped(shortName) + "\\fR, " + title;
  const std::string parameter = option.format_parameter();
  return parameter.empty() ? title : title + " \\fI" + escaped(parameter) + "\\fR";
}

}  // namespace

std::string manPage(const ProgramText& text, const std::vector<OptionGroup>& groups) {
  std::ostringstream out;
  const std::string name = pageName(text.name);
  out << ".TH " << inCapitals(name) << " 1 \"\" \"esvr " << ESVR_VERSION << "\" ESVR\n"
      << ".SH NAME\n"
      << escaped(name) << " \\- " << escaped(firstSentence(text.purpose)) << '\n';
  addLines(out, "SYNOPSIS", text.usage);
  addParagraphs(out, "DESCRIPTION", text.purpose);
  for (const auto& group : groups) {
    if (group.options->options().empty()) continue;
    out << ".SH " << group.title << '\n';
    for (const auto& option : group.options->options())
      out << ".TP\n" << titleOf(*option) << '\n' << escaped(option->description()) << '\n';
  }
  addParagraphs(out, "NOTES",
                text.details.empty() ? text.notes : text.notes + "\n\n" + text.details);
  addLines(out, "EXAMPLES", text.examples);
  return out.str();
}

std::string optionNames(const std::vector<OptionGroup>& groups) {
  std::string names;
  for (const auto& group : groups)
    for (const auto& option : group.options->options()) names += "--" + option->long_name() + '\n';
  return names;
}

// Versions.

std::string programVersion() { return ESVR_VERSION; }

std::string versionText(const std::string& program) {
  return program + " " + programVersion() + "\n" + ".esvr format " +
         std::to_string(kFormatVersion) + "\n" + vdbVersions() + "\n" + cudaVersions() + "\n";
}

nlohmann::ordered_json versionJson() {
  return {{"esvr", programVersion()},
          {"format", kFormatVersion},
          {"vdb", vdbVersions()},
          {"cuda", cudaVersions()}};
}

}  // namespace esvr::cli
