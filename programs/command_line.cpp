// A program's command line: what it says of itself, its description, what --help prints, parsing, and inputs that come through
// a pipe.

#include "programs/command_line.h"

#include <algorithm>
#include <boost/program_options/cmdline.hpp>
#include <boost/program_options/errors.hpp>
#include <boost/program_options/parsers.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/did_you_mean.h"
#include "esvr/vdb_io.h"
#include "programs/resources.h"

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

// ---- The command line

namespace {

constexpr unsigned kLineLength = 80;
constexpr unsigned kMinDescriptionLength = 44;
/// Far more than any machine has processors; each thread takes memory of its own.
constexpr int kMostThreads = 4096;
constexpr const char* kDevice = "device";
constexpr const char* kRest = "unexpected arguments";  // no option can have this name

po::options_description commonOptions() {
  po::options_description common("Common options", kLineLength, kMinDescriptionLength);
  // clang-format off
  common.add_options()
    ("threads", po::value<int>()->value_name("N"), "number of threads (default: as many as the machine has)")
    ("quiet,q", po::bool_switch(), "print errors only")
    ("verbose,v", po::bool_switch(), "print more messages")
    ("help,h", po::bool_switch(), "print this text and exit")
    ("version", po::bool_switch(), "print the versions of all parts and exit");
  // clang-format on
  return common;
}

Arguments withCommonOptions(po::variables_map values) {
  Arguments arguments{.values = std::move(values)};
  if (arguments.get<bool>("verbose")) arguments.verbosity = Verbosity::kVerbose;
  if (arguments.get<bool>("quiet")) arguments.verbosity = Verbosity::kQuiet;
  if (const auto threads = arguments.find<int>("threads")) {
    requireRange("threads", *threads, 1, kMostThreads);
    arguments.threads = *threads;
  }
  return arguments;
}

/// The texts that a value holds, which may be replaced.
std::vector<std::string*> textsOf(po::variable_value& value) {
  if (value.empty()) return {};
  if (auto* one = boost::any_cast<std::string>(&value.value())) return {one};
  std::vector<std::string*> texts;
  for (std::string& text : value.as<std::vector<std::string>>()) texts.push_back(&text);
  return texts;
}

/// Replaces the name of a pipe by that of a file with a copy of its bytes.
void takePipe(const Arguments& arguments, std::string& input, InputFiles& files) {
  files.piped.push_back(std::make_shared<PipedInput>(input, scratchFolderOf(arguments)));
  input = files.piped.back()->path().string();
}

/// Fills Arguments::inputs.
void collectInputs(const std::vector<std::string>& volumes, const std::vector<std::string>& texts,
                   Arguments& arguments) {
  InputFiles files;
  bool hasStandardInput = false;
  const auto collect = [&](const std::string& name, bool isVolume) {
    if (!arguments.has(name)) return;
    for (std::string* input : textsOf(arguments.values.at(name))) {
      if (isVolume && *input == kStandardInput && std::exchange(hasStandardInput, true))
        throw UsageError("standard input (-) is one file; it cannot be two inputs");
      if (isVolume && PipedInput::isPipe(*input)) takePipe(arguments, *input, files);
      files.paths.emplace_back(*input);
    }
  };
  for (const std::string& name : volumes) collect(name, true);
  for (const std::string& name : texts) collect(name, false);
  arguments.inputs = std::move(files);
}

void appendSection(std::ostream& out, const char* title, const std::string& text) {
  if (!text.empty()) out << title << '\n' << text << "\n\n";
}

}  // namespace

CommandLine::CommandLine(ProgramText text)
    : text_(std::move(text)),
      own_("Options", kLineLength, kMinDescriptionLength),
      common_(commonOptions()),
      rest_(kRest) {}

void CommandLine::argument(const std::string& name, const std::string& shown) {
  arguments_.push_back({name, shown, true});
}

void CommandLine::optionalArgument(const std::string& name, const std::string& shown) {
  arguments_.push_back({name, shown, false});
}

void CommandLine::repeatedArgument(const std::string& name) { rest_ = name; }

/// The own options that --help shows, or those that it leaves to `--help expert`.
po::options_description CommandLine::shown(bool isExpert) const {
  po::options_description part(isExpert ? "Expert options" : "Options", kLineLength,
                               kMinDescriptionLength);
  for (const auto& option : own_.options()) {
    const bool isMain = main_.empty() || std::ranges::count(main_, option->long_name()) > 0;
    if (isMain != isExpert) part.add(option);
  }
  return part;
}

std::string CommandLine::helpText() const {
  std::ostringstream out;
  out << wrapped(text_.purpose, kLineLength) << "\n\n";
  appendSection(out, "Usage:", text_.usage);
  if (const auto options = shown(false); !options.options().empty()) out << options << '\n';
  out << common_ << '\n';
  appendSection(out, "Notes:", wrapped(text_.notes, kLineLength));
  if (hasExpertHelp()) out << text_.name << " --help expert shows further options and notes.\n\n";
  appendSection(out, "Examples:", text_.examples);
  std::string help = out.str();
  help.pop_back();  // removes the empty line after the last section
  return help;
}

std::string CommandLine::expertText() const {
  std::ostringstream out;
  if (const auto options = shown(true); !options.options().empty()) out << options << '\n';
  appendSection(out, "Notes:", wrapped(text_.details, kLineLength));
  std::string help = out.str();
  help.pop_back();
  return help;
}

void CommandLine::helpTopic(const std::string& name, const std::string& text) {
  helpTopics_[name] = text;
}

/// The arguments without a dash.
std::vector<std::string> CommandLine::words(const po::variables_map& values) const {
  std::vector<std::string> all;
  for (const Argument& argument : arguments_)
    if (values.count(argument.name) != 0) all.push_back(values[argument.name].as<std::string>());
  if (values.count(rest_) != 0)
    for (const auto& word : values[rest_].as<std::vector<std::string>>()) all.push_back(word);
  return all;
}

std::vector<OptionGroup> CommandLine::groups() const {
  return {{"OPTIONS", &own_}, {"COMMON OPTIONS", &common_}};
}

/// The names of all options with their dashes.
std::vector<std::string> CommandLine::longNames() const {
  std::vector<std::string> names;
  for (const OptionGroup& group : groups())
    for (const auto& option : group.options->options()) names.push_back("--" + option->long_name());
  return names;
}

std::optional<std::string> CommandLine::topic(const std::string& name) const {
  if (name == "man") return manPage(text_, groups());
  if (name == "options") return optionNames(groups());
  if (name == "expert") return hasExpertHelp() ? expertText() : helpText();
  const auto found = helpTopics_.find(name);
  return found == helpTopics_.end() ? std::nullopt : std::optional(found->second);
}

/// The text of the topic that is among the arguments, or the whole help.
/// \param following  the word right behind --help; empty: there is none
std::string CommandLine::helpAskedFor(const po::variables_map& values,
                                      const std::string& following) const {
  for (const auto& word : words(values))
    if (const auto text = topic(word)) return *text;
  if (following.empty()) return helpText();
  std::vector<std::string> topics{"expert", "man", "options"};
  for (const auto& [name, text] : helpTopics_) topics.push_back(name);
  std::string list;
  for (const auto& name : topics) list += (list.empty() ? "" : ", ") + name;
  throw UsageError("--help has no topic '" + following + "', but " + list +
                   didYouMean(following, topics));
}

po::variables_map CommandLine::parseValues(int argc, const char* const* argv) const {
  po::options_description all, hidden;
  po::positional_options_description places;
  for (const Argument& argument : arguments_) {
    hidden.add_options()(argument.name.c_str(), po::value<std::string>());
    places.add(argument.name.c_str(), 1);
  }
  hidden.add_options()(rest_.c_str(), po::value<std::vector<std::string>>());
  places.add(rest_.c_str(), -1);
  all.add(own_).add(common_).add(hidden);

  po::variables_map values;
  po::store(po::command_line_parser(argc, argv).options(all).positional(places).run(), values);
  po::notify(values);
  return values;
}

namespace {

/// The word right behind --help, which would be a topic; empty: there is none, or an option.
std::string wordBehindHelp(int argc, const char* const* argv) {
  for (int i = 1; i + 1 < argc; ++i) {
    const std::string word = argv[i], next = argv[i + 1];
    if (word == "--help" || word == "-h") return next.starts_with('-') ? "" : next;
  }
  return {};
}

}  // namespace

void CommandLine::requireArguments(const po::variables_map& values) const {
  for (const Argument& argument : arguments_)
    if (argument.required && values.count(argument.name) == 0)
      throw UsageError("missing argument " + argument.shown);
  if (values.count(kRest) != 0)
    throw UsageError("unexpected argument '" +
                     values[kRest].as<std::vector<std::string>>().front() + "'");
}

std::optional<Arguments> CommandLine::parse(int argc, const char* const* argv) const try {
  po::variables_map values = parseValues(argc, argv);
  if (values["help"].as<bool>()) {
    std::cout << helpAskedFor(values, wordBehindHelp(argc, argv));
    return std::nullopt;
  }
  if (values["version"].as<bool>()) {
    std::cout << versionText(text_.name);
    return std::nullopt;
  }
  requireArguments(values);
  Arguments arguments = withCommonOptions(std::move(values));
  collectInputs(volumeInputs_, textInputs_, arguments);
  return arguments;
} catch (const po::unknown_option& error) {
  throw UsageError(error.what() + didYouMean(error.get_option_name(), longNames()));
} catch (const po::error& error) {
  throw UsageError(error.what());
}

void refuseOptions(const Arguments& arguments, const std::string& files,
                   std::initializer_list<const char*> options) {
  for (const char* option : options)
    if (arguments.isGiven(option))
      throw UsageError("--" + std::string(option) + " says nothing for " + files);
}

void addDevice(po::options_description& options, const std::string& purpose,
               const std::string& more) {
  const std::string help = purpose + "auto (a GPU if one is usable), cpu, cuda or cuda:N" + more;
  options.add_options()(kDevice, po::value<std::string>()->value_name("D")->default_value("auto"),
                        help.c_str());
}

std::string deviceOf(const Arguments& arguments) { return arguments.get<std::string>(kDevice); }

}  // namespace esvr::cli
