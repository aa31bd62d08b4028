// Plan: `esvr-compare table` is run as a separate process on a small grid.
// Figures agree with the files, and the command of a row makes the same row.
//
// Records of a few rows are made by hand. The tests check which rival is chosen, and the
// sentence for each outcome: more, less, as much, no rival, no error, several files. A record with
// rows of all groups is ordered. The tests check that each row has one place, that the rows of a
// file of ESVR stand beside it, and which rows stand out.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iomanip>
#include <sstream>

#include "cli/conversion.h"
#include "compare/table_record.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

ProgramRun table(const Words& arguments) { return compare("table", arguments); }

class CompareTable : public FittedBall {
 protected:
  [[nodiscard]] Json reportOf(Words arguments) const {
    arguments.insert(arguments.begin(), at("in.vdb"));
    const auto run = succeeded(table(joined(arguments, "--runs 1 --report -")));
    return Json::parse(run.out, nullptr, false);
  }
  /// Writes the ball's box, from (-4, -4, -4) to (4, 4, 4), as raw float32, with `error` added to
  /// every voxel.
  void writeRaw(const std::string& name, float error) const {
    std::ofstream stream(at(name), std::ios::binary);
    for (int z = -4; z <= 4; ++z)
      for (int y = -4; y <= 4; ++y)
        for (int x = -4; x <= 4; ++x) {
          const float value = std::max(0.0f, 1.0f - float(x * x + y * y + z * z) / 25.0f) + error;
          stream.write(reinterpret_cast<const char*>(&value), sizeof value);
        }
  }
};

const Json* rowOf(const Json& report, const std::string& name, const std::string& group = {}) {
  for (const auto& row : report["rows"])
    if (row["name"] == name && (group.empty() || row["group"] == group)) return &row;
  return nullptr;
}

/// The fields of each line. Quoted fields have neither quotes nor line feeds in these tests.
std::vector<Words> csvFields(const std::string& csv) {
  std::vector<Words> lines;
  std::istringstream stream(csv);
  for (std::string line; std::getline(stream, line);) {
    auto& fields = lines.emplace_back(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      if (c == ',' && !quoted)
        fields.emplace_back();
      else if (c != '"')
        fields.back() += c;
    }
  }
  return lines;
}

/// The number of rows of a group that were made. None of them may have more than `bytes`.
int rowsWithin(const Json& report, const std::string& group, std::uint64_t bytes) {
  int rows = 0;
  for (const auto& row : report["rows"])
    if (row["group"] == group && row.contains("bytes")) {
      EXPECT_LE(row["bytes"].get<std::uint64_t>(), bytes) << row["name"];
      ++rows;
    }
  return rows;
}

TEST_F(CompareTable, refusesWhatTakesMoreMemoryThanAllowed) {
  EXPECT_THAT(table({at("in.vdb"), at("in.esvr"), "--rows", "none", "--max-memory", "1KB"}),
              Fails(5));
}

TEST_F(CompareTable, hasLosslessRowsWithoutError) {
  const auto report = reportOf("--rows lossless");
  for (const char* name : {"OpenVDB float Blosc", "OpenVDB float Zip", "NanoVDB float raw",
                           "NanoVDB float Zip", "NanoVDB float Blosc"}) {
    const Json* row = rowOf(report, name);
    ASSERT_NE(row, nullptr) << name;
    EXPECT_TRUE((*row)["psnr_box"].is_null()) << name << " infinite";
    EXPECT_TRUE((*row)["psnr_t50"].is_null()) << name << " infinite";
    EXPECT_EQ((*row)["max_error"], 0.0) << name;
    EXPECT_EQ((*row)["iou"], 1.0) << name;
    EXPECT_NEAR((*row)["ssim"].get<double>(), 1.0, 1e-12) << name;
    EXPECT_GT((*row)["encode_s"].get<double>(), 0.0);
    EXPECT_GT((*row)["decode_s"].get<double>(), 0.0);
  }
  const Json* half = rowOf(report, "OpenVDB half Blosc", "nearly lossless");
  ASSERT_NE(half, nullptr) << "the values of the ball are not half floats";
  EXPECT_EQ((*half)["ratio"], 1.0) << "what ratios are to";
  for (const auto& row : report["rows"])
    EXPECT_EQ(row["group"] == "lossless", row["max_error"] == 0.0) << row["name"];
}

TEST_F(CompareTable, callsHalfFloatsLosslessWhereTheyAre) {
  writeInput(at("halves.vdb"), {{.voxels = {{{0, 0, 0}, 0.5f}, {{1, 0, 0}, 0.25f}}}});
  const auto run =
      succeeded(table({at("halves.vdb"), "--rows", "lossless", "--runs", "1", "--report", "-"}));
  const Json report = Json::parse(run.out);
  EXPECT_NE(rowOf(report, "OpenVDB half Zip", "lossless"), nullptr);
  for (const auto& row : report["rows"]) EXPECT_EQ(row["group"], "lossless") << row["name"];
}

TEST_F(CompareTable, hasQuantisedRowsWithinTheirBounds) {
  const auto report = reportOf("--rows quantised");
  EXPECT_LE((*rowOf(report, "NanoVDB Fp8 Zip"))["max_error"].get<double>(), 0.51 / 255);
  EXPECT_LE((*rowOf(report, "NanoVDB Fp4 raw"))["max_error"].get<double>(), 0.51 / 15);
  EXPECT_THAT((*rowOf(report, "NanoVDB FpN/256 raw"))["setting"], HasSubstr("tolerance="));
}

TEST_F(CompareTable, matchesACandidatesSizeAndShowsTheSearch) {
  // The smallest VDB file has about 1500 bytes. A candidate must be larger, so that other rows can
  // match its size.
  succeeded(vdb2esvr({at("in.vdb"), at("large.esvr"), "--count", "60", "--iterations", "60",
                      "--storage", "float32"}));
  EXPECT_THAT(succeeded(table({at("in.vdb"), at("large.esvr"), "--rows", "matched,zfp", "--size",
                               "2KB", "--runs", "1", "-v", "--report", at("report.json")}))
                  .out,
              Says("trials", " bytes,"));
  const auto report = Json::parse(readText(at("report.json")), nullptr, false);
  const Json* candidate = rowOf(report, "large.esvr");
  ASSERT_NE(candidate, nullptr);
  const auto bytes = (*candidate)["bytes"].get<std::uint64_t>();
  EXPECT_EQ(bytes, std::filesystem::file_size(at("large.esvr")));
  EXPECT_GT(bytes, 1800u);
  for (const std::uint64_t size : {bytes, std::uint64_t{2000}}) {
    const std::string group = "at " + std::to_string(size) + " bytes";
    const Json* matched = rowOf(report, "OpenVDB half Blosc", group);
    ASSERT_NE(matched, nullptr) << group;
    EXPECT_FALSE((*matched)["search"].empty());
    EXPECT_GT(rowsWithin(report, group, size), 3) << group;
  }
}

TEST_F(CompareTable, namesACommandThatMakesTheSameRow) {
  const auto report = reportOf("--rows matched --size 3KB");
  const Json* row = rowOf(report, "NanoVDB Fp8 Zip", "at 3000 bytes");
  ASSERT_NE(row, nullptr);
  ASSERT_TRUE(row->contains("setting")) << row->dump();
  std::istringstream words((*row)["command"].get<std::string>());
  Words arguments;
  for (std::string word; words >> word;) arguments.push_back(word);
  ASSERT_THAT(Words(arguments.begin(), arguments.begin() + 2),
              ElementsAre("esvr-compare", "table"));
  arguments.erase(arguments.begin(), arguments.begin() + 3);
  const auto alone = reportOf(arguments);
  ASSERT_EQ(alone["rows"].size(), 1u);
  EXPECT_EQ(alone["rows"][0]["bytes"], (*row)["bytes"]);
  EXPECT_EQ(alone["rows"][0]["psnr_box"], (*row)["psnr_box"]);
}

TEST_F(CompareTable, fitsEllipsoidsWhereAsked) {
  const auto report =
      reportOf({"--rows", "none", "--fit", "2KB", "--device", "cpu", "--html", at("p.html")});
  const Json* row = rowOf(report, "ESVR fitted, 2000");
  ASSERT_NE(row, nullptr);
  EXPECT_LE((*row)["bytes"].get<double>(), 2000);
  EXPECT_GT((*row)["psnr_box"].get<double>(), 20.0);
  EXPECT_THAT(readText(at("p.html")), Says("Error over run time", "end to end"));
}

TEST_F(CompareTable, takesExternalResults) {
  writeRaw("out.raw", 0.01f);
  const auto report = reportOf({"--rows", "none", "--external",
                                "Mine=" + at("out.raw") + ":1234:9x9x9:float32:encode=4.5:fps=60",
                                "--external", "Same=" + at("in.vdb") + ":99"});
  const Json* mine = rowOf(report, "Mine");
  ASSERT_NE(mine, nullptr);
  EXPECT_EQ((*mine)["bytes"], 1234);
  EXPECT_EQ((*mine)["encode_s"], 4.5);
  EXPECT_EQ((*mine)["fps"], 60.0);
  EXPECT_NEAR((*mine)["psnr_box"].get<double>(), 40.0, 1e-4) << "an error of 0.01 of a peak of 1";
  EXPECT_EQ((*rowOf(report, "Same"))["max_error"], 0.0);
}

/// A compressor of float arrays: rounds to multiples of the bound and compresses their text.
constexpr const char* kRoundingCompressor = R"(#!/usr/bin/perl
use strict;
my ($job, $from, $to, $nx, $ny, $nz, $bound) = @ARGV;
local $/;
if ($job eq 'encode') {
  open(my $in, '<:raw', $from) or die;
  my @values = unpack('f<*', <$in>);
  die "the array has another size\n" unless @values == $nx * $ny * $nz;
  open(my $out, '|-', "gzip -9n > '$to'") or die;
  print $out join(' ', map { sprintf('%.0f', $_ / $bound) } @values);
  close($out) or die;
} else {
  open(my $in, '-|', "gzip -dc '$from'") or die;
  my @steps = split(/ /, <$in>);
  open(my $out, '>:raw', $to) or die;
  print $out pack('f<*', map { $_ * $bound } @steps);
}
)";

class CompareTableCommand : public CompareTable {
 protected:
  void SetUp() override {
    CompareTable::SetUp();
    std::ofstream(at("rounding.pl")) << kRoundingCompressor;
  }
  [[nodiscard]] std::string option() const { return "Rounding=perl " + at("rounding.pl"); }
};

TEST_F(CompareTableCommand, isSearchedForASize) {
  constexpr std::uint64_t kBytes = 200;
  const auto report = reportOf(
      {"--rows", "none", "--size", std::to_string(kBytes), "--external-command", option()});
  const Json* row = rowOf(report, "Rounding", "at 200 bytes");
  ASSERT_NE(row, nullptr);
  ASSERT_TRUE(row->contains("bytes")) << row->dump();
  EXPECT_LE((*row)["bytes"].get<std::uint64_t>(), kBytes);
  const double bound = std::stod((*row)["setting"].get<std::string>().substr(6));
  EXPECT_LE((*row)["max_error"].get<double>(), 0.5001 * bound) << "values are rounded to the bound";
  EXPECT_GT((*row)["max_error"].get<double>(), 0.0);
  bool triedLarger = false;
  for (const auto& step : (*row)["search"]) {
    const bool fits = step["bytes"].get<std::uint64_t>() <= kBytes;
    triedLarger |= !fits;
    if (fits) {
      EXPECT_GE((*row)["psnr_box"].get<double>(), step["psnr_box"].get<double>());
    }
  }
  EXPECT_TRUE(triedLarger) << "the search ends at the size";
}

TEST_F(CompareTableCommand, isSearchedForThePsnrOfACandidate) {
  const auto report = reportOf({at("in.esvr"), "--rows", "none", "--external-command", option()});
  const double psnr = (*rowOf(report, "in.esvr"))["psnr_box"];
  int rows = 0;
  for (const auto& row : report["rows"]) {
    if (row["name"] != "Rounding" || !row["group"].get<std::string>().ends_with(" dB")) continue;
    ++rows;
    EXPECT_GE(row["psnr_box"].get<double>(), psnr);
    for (const auto& step : row["search"])
      if (step["psnr_box"].get<double>() >= psnr) {
        EXPECT_LE(row["bytes"].get<double>(), step["bytes"].get<double>());
      }
  }
  EXPECT_EQ(rows, 1);
}

TEST_F(CompareTableCommand, isSearchedForAPsnrOverTheBoxOrTheActiveVoxels) {
  const auto report = reportOf(
      {"--rows", "matched", "--psnr", "30", "--psnr-active", "30", "--external-command", option()});
  const auto expectReached = [&](const char* name, const std::string& group, const char* figure) {
    const Json* row = rowOf(report, name, group);
    ASSERT_NE(row, nullptr) << name << ' ' << group;
    ASSERT_TRUE(row->contains(figure)) << row->dump();
    EXPECT_GE((*row)[figure].get<double>(), 30.0) << name;
  };
  for (const char* name : {"NanoVDB FpN Zip", "Rounding"})
    expectReached(name, "at 30.00 dB", "psnr_box");
  for (const char* name : {"NanoVDB FpN Zip", "NanoVDB Fp4 Zip", "Rounding"})
    expectReached(name, "at 30.00 dB over active voxels", "psnr_active");
}

TEST_F(CompareTableCommand, leavesTheReasonWhereItFails) {
  const auto report =
      reportOf({"--rows", "none", "--size", "1KB", "--external-command",
                "Bad=echo out of luck; false", "--external-command", "Silent=true"});
  EXPECT_THAT((*rowOf(report, "Bad"))["note"].get<std::string>(), HasSubstr("ended with code 1"));
  EXPECT_THAT((*rowOf(report, "Silent"))["note"].get<std::string>(), HasSubstr("wrote no file"));
}

TEST_F(CompareTableCommand, hasALimitOnTheArray) {
  const auto report = reportOf(
      {"--rows", "none", "--size", "1KB", "--max-dense", "100", "--external-command", option()});
  EXPECT_THAT((*rowOf(report, "Rounding"))["note"].get<std::string>(),
              HasSubstr("more than the bound"));
}

TEST_F(CompareTable, writesReportsInEachForm) {
  succeeded(
      table({at("in.vdb"), at("in.esvr"), "--rows", "lossless", "--runs", "1", "--markdown",
             at("t.md"), "--csv", at("t.csv"), "--html", at("t.html"), "--report", at("t.json")}));
  EXPECT_THAT(readText(at("t.md")), Says("| in.esvr |", "OpenVDB 1"));
  EXPECT_THAT(readText(at("t.csv")), HasSubstr("\nOpenVDB float Blosc,lossless,vdb-float-blosc,"));
  EXPECT_THAT(readText(at("t.html")), Says("<table", "in.esvr"));
  EXPECT_EQ(Json::parse(readText(at("t.json")))["schema"], "esvr-table");
}

/// Whether a row of a page has all figures of a line of a CSV file.
bool hasRow(const std::string& page, const Words& keys, const Words& fields) {
  const std::string begin = "<th scope=\"row\">" + fields.front() + "</th>";
  for (std::size_t at = page.find("All rows"); (at = page.find(begin, at + 1)) < page.size();) {
    const std::string row = page.substr(at, page.find("</dl>", at) - at);
    bool all = true;
    for (std::size_t c = 1; c < fields.size(); ++c) {
      const bool isText = keys[c] == "group" || keys[c] == "setting" || keys[c] == "note";
      const std::string number = fields[c] == "inf" ? "Infinity" : fields[c];
      if (keys[c] != "command" && !number.empty())
        all &= row.find(isText ? ">" + number + "<" : "data-value=\"" + number + "\"") < row.size();
    }
    if (all) return true;
  }
  return false;
}

TEST_F(CompareTable, hasEveryFigureOfTheCsvOnThePage) {
  succeeded(table({at("in.vdb"), at("in.esvr"), "--runs", "1", "--rows", "lossless,quantised,zfp",
                   "--csv", at("t.csv"), "--markdown", at("t.md"), "--html", at("t.html")}));
  const std::string page = readText(at("t.html")), markdown = readText(at("t.md"));
  const auto lines = csvFields(readText(at("t.csv")));
  ASSERT_GT(lines.size(), 20u);
  for (std::size_t line = 1; line < lines.size(); ++line) {
    EXPECT_THAT(markdown, HasSubstr("| " + lines[line].front() + " |"));
    EXPECT_TRUE(hasRow(page, lines[0], lines[line])) << lines[line].front();
  }
}

TEST_F(CompareTable, hasItsFindingAsTheHeadline) {
  writeRaw("good.raw", 1e-6f);
  const auto headline = [&](const Words& rows) {
    succeeded(table(joined({at("in.vdb"), at("in.esvr"), "--rows", "none", "--runs", "1", "--html",
                            at("p.html"), "--force"},
                           rows)));
    const std::string page = readText(at("p.html"));
    const std::size_t begin = page.find("<h1>") + 4;
    return page.substr(begin, page.find("</h1>") - begin);
  };
  EXPECT_THAT(headline({}), HasSubstr("; no other row is that small."));
  EXPECT_THAT(readText(at("p.html")), Not(HasSubstr("best rival</h2>")));
  EXPECT_THAT(headline({"--external", "A<b>=" + at("good.raw") + ":10:9x9x9:float32"}),
              HasSubstr("\u00a0dB less than the best rival, A&lt;b&gt;."));
  EXPECT_THAT(readText(at("p.html")), HasSubstr("ESVR and its best rival</h2>"));
}

TEST_F(CompareTable, comparesEachFileWithItsBestRival) {
  writeRaw("good.raw", 0.001f);
  succeeded(quickFit(at("in.vdb"), at("other.esvr")));
  succeeded(table({at("in.vdb"), at("in.esvr"), at("other.esvr"), "--rows", "none", "--runs", "1",
                   "--external", "A=" + at("good.raw") + ":10:9x9x9:float32", "--html",
                   at("p.html"), "--csv", at("p.csv")}));
  const std::string page = readText(at("p.html"));
  EXPECT_THAT(page, Says("<h1>ESVR has a higher PSNR than the best rival for none of 2",
                         "ESVR and its best rivals</h2>"));
  // An error of 0.001 of a peak of 1 is 60 dB.
  const double ours = std::stod(csvFields(readText(at("p.csv")))[1][6]);
  EXPECT_LT(ours, 59.0);
  std::ostringstream lead;
  lead << std::fixed << std::setprecision(2) << ours - 60.0;
  EXPECT_THAT(page, HasSubstr(">60.00</td>"));
  EXPECT_THAT(page, HasSubstr(">" + lead.str() + "</td>"));
}

TEST_F(CompareTable, SlowFitsHundredColumns) {
  const auto run = succeeded(table({at("in.vdb"), at("in.esvr"), "--runs", "1"}));
  std::istringstream lines(run.out);
  for (std::string line; std::getline(lines, line);)
    EXPECT_TRUE(line.find(':') != std::string::npos || line.size() <= 100) << line;
}

TEST_F(CompareTable, leavesRowsThatCannotBeWithTheirReason) {
  if (reportOf("--rows none")["versions"]["zfp"].is_null()) GTEST_SKIP() << "built without ZFP";
  const auto report = reportOf("--rows zfp --size 2KB --max-dense 100");
  const Json* row = rowOf(report, "ZFP accuracy", "at 2000 bytes");
  ASSERT_NE(row, nullptr);
  EXPECT_THAT((*row)["note"].get<std::string>(), HasSubstr("more than the bound"));
}

TEST_F(CompareTable, SlowComparesPictures) {
  const auto report = reportOf({at("in.esvr"), "--rows", "lossless", "--images", "2",
                                "--image-size", "40", "--colors", "viridis:tent"});
  const Json* same = rowOf(report, "OpenVDB float Blosc");
  EXPECT_TRUE((*same)["image_psnr"].is_null()) << "infinite";
  EXPECT_EQ((*same)["flip"], 0.0);
  EXPECT_NEAR((*same)["image_ssim"].get<double>(), 1.0, 1e-12);
  const Json* fit = rowOf(report, "in.esvr");
  EXPECT_GT((*fit)["flip"].get<double>(), 0.0);
  EXPECT_GT((*fit)["image_psnr"].get<double>(), 15.0);
  EXPECT_GT((*fit)["fps"].get<double>(), 0.0);
}

TEST_F(CompareTable, takesLpipsFromAProgramOfTheUsers) {
  // This script takes the place of LPIPS. It prints a line that is no figure, and then 0 for equal
  // pictures and 0.25 for others. It accepts PNG files only, and the reference must come first.
  writeText(at("metric.sh"),
            "for f; do [ \"$(head -c 4 \"$f\" | tail -c 3)\" = PNG ] || exit 9; done\n"
            "echo \"$# files\"; echo \"$1\" >> \"$0.references\"\n"
            "if cmp -s \"$1\" \"$2\"; then echo 0; else echo 0.25; fi\n");
  const auto report = reportOf({at("in.esvr"), "--row", "nvdb-float", "--images", "1",
                                "--image-size", "16", "--lpips", "sh " + at("metric.sh")});
  EXPECT_EQ((*rowOf(report, "in.esvr"))["lpips"], 0.25);
  EXPECT_EQ((*rowOf(report, "NanoVDB float raw"))["lpips"], 0.0);
  EXPECT_THAT(readText(at("metric.sh.references")), Not(HasSubstr("picture.png\n")));
  const auto run = [&](const std::string& program) {
    return table({at("in.vdb"), at("in.esvr"), "--rows", "none", "--images", "1", "--image-size",
                  "16", "--lpips", program});
  };
  const auto failed = run("false"), wordy = run("echo no figure #");
  EXPECT_THAT(failed, Fails(1, "ended with code 1"));
  EXPECT_THAT(wordy, Fails(1, "not a number"));
}

TEST_F(CompareTable, SlowPutsPicturesOnThePage) {
  const auto run =
      succeeded(table({at("in.vdb"), at("in.esvr"), "--rows", "none", "--runs", "1", "--images",
                       "1", "--image-size", "32", "--html", at("p.html")}));
  const std::string page = readText(at("p.html"));
  EXPECT_THAT(page, Says("data:image/png;base64,", "errors of in.esvr", "type=\"range\"",
                         "class=\"scale\""));
  EXPECT_THAT(run.out, HasSubstr("FLIP"));
}

TEST_F(CompareTable, SlowKeepsTheRowsThatAreMadeWhenInterrupted) {
  // With this number of runs a row takes seconds. The program is interrupted when it has made one.
  const auto run = runInterrupted(
      ESVR_COMPARE,
      {"table", at("in.vdb"), at("in.esvr"), "--runs", "200", "--csv", at("t.csv"), "-v"},
      "made ESVR");
  EXPECT_THAT(run, Fails(1, "interrupted; ", " made, the others are missing"));
  EXPECT_THAT(run.out, Says("in.esvr", Not(HasSubstr("NanoVDB FpN/64 Zip"))));
  EXPECT_THAT(readText(at("t.csv")), HasSubstr("\nin.esvr,ESVR,"));
}

class RefusedTable : public CompareTable, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedTable, isExplainedAndLeavesNoFile) {
  writeRaw("out.raw", 0.0f);
  writeInput(at("zero.vdb"), {{.voxels = {{{0, 0, 0}, 0.0f}}}});
  writeInput(at("none.vdb"), {{.voxels = {}}});
  writeInput(at("far.vdb"), {{.voxels = softBall({100, 0, 0})}});
  succeeded(quickFit(at("far.vdb"), at("far.esvr")));
  const auto before = folder_.names();
  GetParam().expectOf(table(GetParam().argumentsIn(folder_)));
  EXPECT_EQ(folder_.names(), before);
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedTable,
    testing::Values(Refusal{{}, 2, "REF.vdb"}, Refusal{"DIR/in.vdb --rows best", 2, "best"},
                    Refusal{"DIR/in.vdb --row gzip", 2, "gzip"},
                    Refusal{"DIR/in.vdb --runs 0", 2, "--runs"},
                    Refusal{"DIR/in.vdb --images 0", 2, "--images"},
                    Refusal{"DIR/in.vdb --images 1 --colors mauve", 2, "mauve"},
                    Refusal{"DIR/in.vdb --colors viridis", 2, "--images"},
                    Refusal{"DIR/in.vdb --external DIR/out.raw:1", 2, "NAME=FILE:BYTES"},
                    Refusal{"DIR/in.vdb --external A=DIR/out.raw:1:9x9x9", 2, "come together"},
                    Refusal{"DIR/in.vdb --external A=DIR/out.raw:1:nine", 2, "nine"},
                    Refusal{"DIR/in.vdb --external A=DIR/out.raw:1:8x9x9:float32", 3, "(9, 9, 9)"},
                    Refusal{"DIR/in.vdb --external A=DIR/out.raw:1:9x9x9:uint8", 3, "729"},
                    Refusal{"DIR/in.vdb --external A=DIR/no.raw:1:9x9x9:uint8", 3, "no.raw"},
                    Refusal{"DIR/in.vdb --external A=DIR/out.raw:1", 3, "out.raw"},
                    Refusal{"DIR/in.vdb --external-command A=true", 2, "--size"},
                    Refusal{"DIR/in.vdb --psnr inf", 2, "--psnr"},
                    Refusal{"DIR/in.vdb --psnr-active -1", 2, "--psnr-active"},
                    Refusal{"DIR/in.vdb --psnr-active nan", 2, "--psnr-active"},
                    Refusal{"DIR/in.vdb --size 1KB --external-command true", 2, "NAME=COMMAND"},
                    Refusal{"DIR/in.vdb DIR/far.esvr", 3, "do not meet"},
                    Refusal{"DIR/in.vdb DIR/far.vdb", 3, "--external"},
                    Refusal{"DIR/in.vdb DIR/no.esvr", 3, "no.esvr"},
                    Refusal{"DIR/in.vdb -g heat", 3, "heat"},
                    Refusal{"DIR/none.vdb", 3, "active voxel"},
                    Refusal{"DIR/in.vdb --csv DIR/in.vdb", 2, "one file"},
                    Refusal{"DIR/in.vdb --csv DIR/out.txt", 2, ".csv"}));

}  // namespace
}  // namespace esvr::test

namespace esvr::compare {
namespace {

using testing::ElementsAre;

TableRow row(const std::string& name, const std::string& group, std::uint64_t bytes, double psnr) {
  TableRow made{.name = name, .group = group, .bytes = bytes};
  made.metrics = VolumeMetrics{};
  made.metrics->psnrBox = psnr;
  return made;
}
TableRow ours(std::uint64_t bytes, double psnr) {
  return row("fit" + std::to_string(bytes) + ".esvr", kOurGroup, bytes, psnr);
}
TableRow rival(std::uint64_t bytes, double psnr, const std::string& name = "ZFP") {
  return row(name, "at some bytes", bytes, psnr);
}

std::string finding(const std::vector<TableRow>& rows) {
  TableRecord record;
  record.rows = rows;
  return findingOf(record);
}

TEST(Finding, saysHowMuchMoreEsvrHas) {
  EXPECT_EQ(finding({ours(46000, 52.34), rival(45900, 43.2), rival(45000, 40.0, "FpN")}),
            "At 46 KB, ESVR has a PSNR of 52.3 dB, 9.1 dB more than the best rival, ZFP.");
}

TEST(Finding, saysHowMuchLessEsvrHas) {
  EXPECT_EQ(finding({ours(46000, 40.0), rival(45900, 43.24)}),
            "At 46 KB, ESVR has a PSNR of 40.0 dB, 3.2 dB less than the best rival, ZFP.");
}

TEST(Finding, isATieWhereTheDifferenceWouldBeZero) {
  for (const double psnr : {40.04, 40.0, 39.96})
    EXPECT_EQ(finding({ours(46000, 40.0), rival(46000, psnr)}),
              "At 46 KB, ESVR has a PSNR of 40.0 dB, as much as the best rival, ZFP.");
}

TEST(Finding, saysThatThereIsNoRival) {
  EXPECT_EQ(finding({ours(46000, 40.0), rival(60000, 43.0)}),
            "At 46 KB, ESVR has a PSNR of 40.0 dB; no other row is that small.");
  EXPECT_EQ(finding({rival(60000, 43.0)}), "") << "nothing of ESVR";
}

TEST(Finding, isOpenAboutARivalWithoutAnError) {
  EXPECT_EQ(finding({ours(46000, 40.0), rival(30000, INFINITY, "zip")}),
            "At 46 KB, ESVR has a PSNR of 40.0 dB; the best rival, zip, has no error.");
}

TEST(Finding, comparesSizesWhereEsvrHasNoError) {
  EXPECT_EQ(finding({ours(46000, INFINITY), rival(60000, INFINITY, "zip"), rival(40000, 90.0)}),
            "ESVR stores the volume without an error in 46 KB, the best rival, zip, in 60 KB.");
  EXPECT_EQ(finding({ours(46000, INFINITY), rival(40000, 90.0)}),
            "ESVR stores the volume without an error in 46 KB.");
}

TEST(Finding, hasAllFilesOfEsvr) {
  EXPECT_EQ(finding({ours(90000, 52.0), rival(90000, 48.5), ours(6500, 35.0), rival(6400, 33.8)}),
            "ESVR has a higher PSNR than the best rival for all 2 files, from 6.5 KB to 90 KB, by "
            "1.2 to 3.5 dB.");
  EXPECT_EQ(
      finding({ours(90000, 47.0), rival(90000, 48.5), ours(6500, 35.0), rival(6400, 33.8)}),
      "ESVR has a higher PSNR than the best rival for 1 of 2 files, from 6.5 KB to 90 KB; the "
      "difference is between -1.5 dB and 1.2 dB.");
  EXPECT_EQ(finding({ours(90000, 47.0), rival(90000, 48.5), ours(6500, 33.0), rival(6400, 33.8)}),
            "ESVR has a higher PSNR than the best rival for none of 2 files, from 6.5 KB to 90 KB; "
            "the difference is between -1.5 dB and -0.8 dB.");
}

TEST(Finding, countsFilesWithoutARivalAndFilesWithoutAnError) {
  EXPECT_EQ(finding({ours(2000, 30.0), ours(3000, 32.0), ours(46000, 52.3), rival(45900, 43.2)}),
            "At 46 KB, ESVR has a PSNR of 52.3 dB, 9.1 dB more than the best rival, ZFP. No other "
            "row is as small as its 2 smallest files.");
  EXPECT_EQ(finding({ours(46000, 52.3), rival(45900, 43.2), ours(99000, INFINITY)}),
            "At 46 KB, ESVR has a PSNR of 52.3 dB, 9.1 dB more than the best rival, ZFP. ESVR "
            "stores the volume without an error in 99 KB.");
}

TEST(Duels, takeTheBestRowThatIsNotLarger) {
  TableRecord record;
  record.rows = {ours(10000, 40.0),
                 rival(10200, 38.0, "as large"),
                 rival(10201, 50.0, "larger"),
                 rival(9000, 37.0, "worse"),
                 rival(9500, 38.0, "smaller"),
                 {.name = "none", .group = "at some bytes", .note = "out of reach"}};
  const auto duels = duelsOf(record);
  ASSERT_EQ(duels.size(), 1u);
  ASSERT_NE(duels[0].rival, nullptr);
  EXPECT_EQ(duels[0].rival->name, "smaller") << "of equal PSNR";
}

using report::Emphasis;

TableRecord orderedRows() {
  TableRecord made;
  made.rows = {row("large", kOurGroup, 9000, 50.0),    row("small", kOurGroup, 1000, 40.0),
               row("Blosc", "lossless", 99000, 140.0), row("a", "at 1000 bytes", 990, 30.0),
               row("b", "at 9000 bytes", 8990, 45.0),  row("c", "at 40.00 dB", 2000, 40.1),
               row("d", "at 500 bytes", 490, 20.0)};
  made.rows[3].matchedBytes = 1000;
  made.rows[4].matchedBytes = 9000;
  made.rows[5].matchedPsnr = 40.0;
  made.rows[6].matchedBytes = 500;
  return made;
}

std::vector<std::string> linesOf(const PageOrder& order) {
  std::vector<std::string> lines;
  for (const auto& group : order.groups()) {
    lines.push_back(group.heading + (group.ofOneSize ? " =" : ""));
    for (const TableRow* row : group.rows) lines.push_back("  " + row->name);
  }
  return lines;
}

TEST(PageOrder, putsRowsBesideTheFileOfTheirSize) {
  const TableRecord rows = orderedRows();
  EXPECT_THAT(linesOf(PageOrder(rows)),
              ElementsAre("at most 1000 bytes (1 KB) =", "  small", "  a", "at 40.00 dB", "  c",
                          "at most 9000 bytes (9 KB) =", "  large", "  b", "lossless", "  Blosc",
                          "at 500 bytes =", "  d"));
}

TEST(PageOrder, marksEsvrAndItsRivals) {
  const TableRecord rows = orderedRows();
  const PageOrder order(rows);
  EXPECT_EQ(order.emphasisOf(rows.rows[0]), Emphasis::kOurs);
  EXPECT_EQ(order.emphasisOf(rows.rows[3]), Emphasis::kRival);
  EXPECT_EQ(order.emphasisOf(rows.rows[4]), Emphasis::kRival);
  EXPECT_EQ(order.emphasisOf(rows.rows[6]), Emphasis::kNone);
}

}  // namespace
}  // namespace esvr::compare
