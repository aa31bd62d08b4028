// Plan: the JSON report of a run agrees with the file that the run wrote, the voxels that come back
// from it, and the options. docs/report.md names exactly the keys that the reports of several runs,
// which together have every key, have.

#include <limits>
#include <map>
#include <regex>
#include <set>

#include "cli/conversion.h"
#include "field/random_field.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;

TEST_F(Vdb2Esvr, reportsWhatTheFileHolds) {
  const auto run = succeeded(fitQuickly("--report -"));
  const Json report = Json::parse(run.out);
  EXPECT_TRUE(report["error"].is_null());
  const Json& grid = report["grids"][0];
  EXPECT_TRUE(grid["paper"].is_null());
  EXPECT_EQ(report["schema"], "esvr-report");
  EXPECT_EQ(report["exit_code"], 0);
  EXPECT_EQ(report["output"]["bytes"], std::filesystem::file_size(out()));
  EXPECT_EQ(grid["ellipsoids"], readEsvr(out()).grids[0].field.ellipsoidCount());
  EXPECT_EQ(grid["source"]["active_voxels"], softBall({}).size());
  EXPECT_EQ(grid["curve"].size(), readEsvr(out()).grids[0].curve.size());
}

TEST_F(Vdb2Esvr, reportsWhatThePapersMethodUsed) {
  const auto run =
      succeeded(vdb2esvr({in(), out(), "--paper", "epochs=28,points=60,beta=0.5", "--paper",
                          "prune-score=no-fa,densify-threshold=0,rates=1e-4:2e-3:1e-3:1e-2",
                          "--count", "40", "--report", "-", "--device", "cpu"}));
  const Json report = Json::parse(run.out);
  EXPECT_EQ(report["asked"]["method"], "paper");
  EXPECT_EQ(report["asked"]["storage"], "float32");
  const Json& paper = report["grids"][0]["paper"];
  EXPECT_EQ(paper["k"], 5.0);
  EXPECT_EQ(paper["kernel"], "ellipsoid");
  EXPECT_EQ(paper["beta"], 0.5);
  EXPECT_EQ(paper["points"], 60);
  EXPECT_EQ(paper["rates"]["scale"], 2e-3);
  EXPECT_EQ(paper["prune_score"], "no-fa");
  EXPECT_EQ(paper["densify"]["until"], 4);  // 400 of 2800 epochs in the paper
  EXPECT_EQ(paper["prunes"][0]["epoch"], 12);
  EXPECT_EQ(paper["prunes"][0]["after"], 40);
  EXPECT_GT(paper["prunes"][0]["hits_before"], 1.0);
  EXPECT_GT(paper["hits"], 1.0);
}

TEST_F(Vdb2Esvr, dividesByTheGridsThatWereConverted) {
  writeInput(in(), {{.name = "density", .voxels = softBall({})},
                    {.name = "heat", .voxels = softBall({40, 0, 0})}});
  const std::string path = folder_ / "r.json";
  EXPECT_THAT(succeeded(fitQuickly({"-g", "heat", "--report", path})).out,
              HasSubstr("1 of 2 grids"));
  const Json report = Json::parse(readText(path));
  const double converted = report["input"]["bytes_converted"], all = report["input"]["bytes"];
  EXPECT_LT(converted, 0.6 * all);  // two equal grids
  EXPECT_GT(converted, 0.2 * all);
  EXPECT_DOUBLE_EQ(report["ratio"], converted / double(report["output"]["bytes"]));
}

TEST_F(Vdb2Esvr, reportsAFailureToo) {
  const std::string report = folder_ / "r.json";
  const auto run = vdb2esvr({in(), out(), "--size", "99", "--report", report});
  ASSERT_EQ(run.exitCode, 2);
  const Json json = Json::parse(readText(report));
  EXPECT_EQ(json["exit_code"], 2);
  EXPECT_EQ(json["error"]["kind"], "usage");
  EXPECT_THAT(std::string(json["error"]["message"]), HasSubstr("99"));
  EXPECT_EQ(json["input"]["path"], in());
}

TEST_F(Vdb2Esvr, reportsNullForAPsnrWithoutError) {
  writeInput(in(), {{.voxels = softBall({}, 0.0f)}});
  const std::string report = folder_ / "r.json";
  succeeded(fitQuickly({"--report", report}));
  const Json json = Json::parse(readText(report));
  EXPECT_TRUE(json["grids"][0]["metrics"]["psnr_box"].is_null());
}

TEST_F(Vdb2Esvr, reportsTheErrorOfTheVoxelsThatComeBack) {
  const auto run = fitQuickly("--report -");
  const Json grid = Json::parse(run.out)["grids"][0], metrics = grid["metrics"];
  const std::string back = folder_ / "back.vdb";
  succeeded(esvr2vdb({out(), back}));
  const VolumeMetrics m = compareVolumes(readGrid(in(), "density").volume,
                                         readGrid(back, "density").volume, {.transmittance = true});
  EXPECT_EQ(metrics["psnr_box"].get<double>(), m.psnrBox);
  EXPECT_EQ(metrics["psnr_active"].get<double>(), m.psnrActive);
  EXPECT_EQ(metrics["max_error"].get<double>(), m.maxError);
  EXPECT_EQ(metrics["iou"].get<double>(), m.iou);
  EXPECT_EQ(grid["quality"]["median_depth"].get<double>(), m.transmittance->medianDepth);
  EXPECT_EQ(grid["quality"]["psnr_t90"].get<double>(), m.transmittance->psnr90);
  EXPECT_EQ(grid["quality"]["psnr_t50"].get<double>(), m.transmittance->psnr50);
  EXPECT_EQ(grid["quality"]["psnr_t10"].get<double>(), m.transmittance->psnr10);
}

TEST_F(Vdb2Esvr, reportsTransmittanceOnlyOfWhatIsLookedThrough) {
  writeInput(in(), {{.voxels = softBall({})},
                    {.name = "cold", .voxels = softBall({}, -1.0f)},
                    {.name = "ambient", .voxels = softBall({}, 1.0f, 2.0f), .background = 2.0f}});
  const auto run = succeeded(fitQuickly("--report -"));
  const Json grids = Json::parse(run.out)["grids"];
  EXPECT_TRUE(grids[0]["quality"].is_object());
  EXPECT_TRUE(grids[1]["quality"].is_null()) << "no column has a depth above 0";
  EXPECT_TRUE(grids[2]["quality"].is_null()) << "space without voxels is not empty";
}

using Keys = std::set<std::string>;
using Table = std::map<std::string, std::string>;  // meaning of each key

/// Words in backticks in the document that are values, or keys of another object.
const Keys kNoKeys{"blocks", "default", "drawing", "learned", "mask",
                   "null",   "paper",   "vec3d",   "vec3s",   "voxels"};

/// Words in backticks that may be keys: options have dashes, and values capitals or spaces.
Keys namedIn(const std::string& text) {
  static const std::regex kWord("`([a-z0-9_]+)`");
  Keys words;
  for (std::sregex_iterator it(text.begin(), text.end(), kWord), end; it != end; ++it)
    words.insert((*it)[1]);
  return words;
}

Keys keysOf(const Json& object) {
  Keys keys;
  for (const auto& item : object.items()) keys.insert(item.key());
  return keys;
}

Keys without(Keys keys, const Keys& others) {
  for (const auto& key : others) keys.erase(key);
  return keys;
}

/// Merges `report` into `all`: objects get the keys of both, and lists become one element.
void merge(Json& all, const Json& report) {
  if (report.is_object()) {
    if (!all.is_object()) all = Json::object();
    for (const auto& item : report.items()) merge(all[item.key()], item.value());
  } else if (report.is_array() && !report.empty() && report[0].is_object()) {
    for (const auto& element : report) merge(all, element);
  } else if (all.is_null()) {
    all = report;
  }
}

std::string from(const std::string& text, const std::string& start) {
  const std::size_t at = text.find(start);
  EXPECT_NE(at, std::string::npos) << "docs/report.md has no '" << start << "'";
  return at == std::string::npos ? "" : text.substr(at);
}

std::string paragraphFrom(const std::string& text, const std::string& start) {
  const std::string rest = from(text, start);
  return rest.substr(0, rest.find("\n\n"));
}

/// The first table after `start`: the keys in its first column, with the text of its last column.
Table tableAfter(const std::string& text, const std::string& start) {
  Table table;
  const std::string rest = from(from(text, start), "\n|");
  std::istringstream lines(rest.substr(1));
  for (std::string line; std::getline(lines, line) && line.starts_with("|");) {
    const std::size_t first = line.find(" |"), last = line.rfind(" | ", line.size() - 3);
    for (const auto& key : namedIn(line.substr(0, first))) table[key] = line.substr(last);
  }
  return table;
}

Keys keysOf(const Table& table) {
  Keys keys;
  for (const auto& [key, meaning] : table) keys.insert(key);
  return keys;
}

/// The keys of an object and of the objects in it.
Keys allKeysOf(const Json& object) {
  Keys keys = keysOf(object);
  for (const auto& item : object.items())
    if (item.value().is_object()) keys.merge(keysOf(item.value()));
  return keys;
}

/// Checks that a text names the keys of an object. It may name keys of inner objects too. A text
/// without keys explains the object in words, and is not checked.
void expectNamed(const Json& object, const std::string& text, const std::string& where) {
  const Keys named = namedIn(text);
  if (!object.is_object() || without(named, kNoKeys).empty()) return;
  EXPECT_EQ(without(keysOf(object), named), Keys{}) << where << ": not documented";
  EXPECT_EQ(without(without(named, kNoKeys), allKeysOf(object)), Keys{})
      << where << ": not written";
}

/// Checks an object against a table, and its inner objects against the rows of the table.
/// \param others  inner objects that have a table of their own
void expectTable(const Json& object, const Table& table, const Keys& others,
                 const std::string& where) {
  EXPECT_EQ(keysOf(object), keysOf(table)) << where;
  for (const auto& [key, meaning] : table)
    if (!others.contains(key) && object.contains(key))
      expectNamed(object[key], meaning, where + "." + key);
}

class ReportDoc : public FittedBall {
 protected:
  /// Runs a program and merges its report into `all_`.
  void add(const char* program, const Words& arguments, int exitCode = 0) {
    EXPECT_THAT(runProgram(program, joined(arguments, {"--report", at("r.json"), "--force"})),
                Fails(exitCode));
    merge(all_, Json::parse(readText(at("r.json"))));
  }

  std::string document_ = readText(ESVR_SOURCE_DIR "/docs/report.md");
  Json all_;
};

TEST_F(ReportDoc, namesTheKeysOfAConversion) {
  writeMixedInput(at("in.vdb"), {{.voxels = softBall({})}});
  writeInput(at("cloud.vdb"), {{.voxels = cloud(12)}});
  const Words quick{"--device", "cpu", "--iterations", "60"};
  const auto convert = [&](const char* input, const Words& more) {
    add(VDB2ESVR, joined(joined({at(input), at("out.esvr")}, more), quick));
  };
  convert("in.vdb", "--count 30");
  std::vector<InputVoxel> gaps = softBall({});
  gaps.front().value = std::numeric_limits<float>::quiet_NaN();
  writeInput(at("gaps.vdb"), {{.voxels = gaps}});
  convert("gaps.vdb", "--max-error 5% --nonfinite keep");
  convert("cloud.vdb", "--max-error 5%");
  writeInput(at("surface.vdb"), {{.voxels = distances(10), .background = 20.0f, .levelSet = true}});
  convert("surface.vdb", "--max-error 5%");
  writeVectorInput(at("wind.vdb"), {.voxels = softBall({})});
  convert("wind.vdb", "--count 30 --representation ellipsoids");
  add(VDB2ESVR, {at("in.vdb"), at("out.esvr"), "--paper", "epochs=28,points=60", "--count", "40",
                 "--device", "cpu"});

  expectTable(all_, tableAfter(document_, "## The report of a conversion"),
              {"error", "grids", "seconds"}, "report");
  const Table grid = tableAfter(document_, "### Each grid");
  expectTable(all_["grids"], grid, {"curve", "fit", "paper"}, "grid");
  expectTable(all_["grids"]["fit"], tableAfter(document_, "The object `fit`:"), {}, "fit");
  expectTable(all_["grids"]["paper"], tableAfter(document_, "The object `paper`:"), {}, "paper");
  const std::string curve = from(paragraphFrom(document_, "The list `curve`"), "point: ");
  expectNamed(all_["grids"]["curve"], curve.substr(0, curve.find(". ")), "curve");
  const std::string seconds = tableAfter(document_, "## The report of a conversion")["seconds"];
  expectNamed(all_["seconds"], grid.at("seconds") + seconds, "seconds");
}

TEST_F(ReportDoc, namesTheKeysOfASequence) {
  writeInput(at("in.1.vdb"), {{.voxels = softBall({})}});
  writeText(at("in.2.vdb"), "no volume");
  add(VDB2ESVR,
      {at("in.@.vdb"), at("out.@.esvr"), "--frames", "1-2", "--count", "30", "--iterations", "60",
       "--device", "cpu"},
      3);
  add(VDB2ESVR, {at("in.@.vdb"), at("all.esvr"), "--frames", "1", "--count", "30", "--iterations",
                 "60", "--device", "cpu"});
  const Table report = tableAfter(document_, "## The report of a sequence");
  // The table names the words of the states for the frames.
  expectTable(all_, report, {"asked", "command_line", "frames", "states", "versions"}, "sequence");
  expectTable(all_["frames"], tableAfter(document_, "The objects of `frames`:"),
              {"grids", "input", "output", "seconds", "skipped"}, "frame");
}

TEST_F(ReportDoc, namesTheKeysOfTheProgressOfASequence) {
  writeInput(at("in.1.vdb"), {{.voxels = softBall({})}});
  const auto run = quickFit(at("in.@.vdb"), at("out.@.esvr"), "--progress json");
  const Table table = tableAfter(document_, "For a sequence, there is a line");
  EXPECT_EQ(keysOf(Json::parse(run.err)), keysOf(table));
}

TEST_F(ReportDoc, namesTheKeysOfAFailure) {
  add(VDB2ESVR, {at("in.vdb"), at("out.esvr"), "--size", "99"}, 2);
  const std::string text = paragraphFrom(document_, "A run that writes no file");
  Keys keys = keysOf(all_);
  for (const char* object : {"error", "input"})
    for (const auto& key : keysOf(all_[object])) keys.insert(key);
  EXPECT_EQ(keys, without(namedIn(text), {"usage", "device", "failure"}));
}

TEST_F(ReportDoc, namesTheKeysOfAPicture) {
  add(ESVR_RENDER, {at("in.esvr"), at("p.png"), "--ref", at("in.vdb"), "--resolution", "16x16"});
  add(ESVR_RENDER, {at("in.esvr"), "--bench", "--turntable", "2", "--ref", at("in.vdb"),
                    "--resolution", "16x16", "--device", "cpu"});
  const Keys timed{"drawn", "reference"};
  expectTable(all_, tableAfter(document_, "## The report of a picture"), timed, "report");
  const Table figures = tableAfter(document_, "The objects `drawn` and `reference`:");
  for (const auto& object : timed) expectTable(all_[object], figures, {}, object);
}

TEST_F(ReportDoc, namesTheKeysOfACheck) {
  // NanoVDB has no place for some metadata, which gives differences.
  succeeded(esvr2vdb({at("in.esvr"), at("back.nvdb")}));
  add(ESVR_COMPARE, {"check", at("in.vdb"), at("back.nvdb"), "--ssim"});
  for (const std::string frame : {"1", "2"})
    writeInput(at("s." + frame + ".vdb"), {{.voxels = softBall({})}});
  add(ESVR_COMPARE, {"check", at("s.@.vdb"), at("s.@.vdb")});
  writeInput(at("surface.vdb"), {{.voxels = distances(10), .background = 20.0f, .levelSet = true}});
  add(ESVR_COMPARE, {"check", at("surface.vdb"), at("surface.vdb"), "--max-mesh-distance", "1",
                     "--max-relative-error", "1%"});
  expectTable(all_, tableAfter(document_, "The report of `check`"), {}, "check");
}

TEST_F(ReportDoc, namesTheKeysOfATable) {
  add(ESVR_COMPARE, {"table", at("in.vdb"), at("in.esvr"), "--runs", "1", "--images", "1",
                     "--image-size", "16", "--device", "cpu"});
  expectTable(all_, tableAfter(document_, "The report of `table`"), {"rows"}, "table");
  const Table row = tableAfter(document_, "A row has only the keys");
  EXPECT_EQ(keysOf(all_["rows"]), without(keysOf(row), {"device_bytes", "lpips"}));
  for (const char* object : {"encode", "decode", "search"})
    expectNamed(all_["rows"][object], row.at(object), object);
}

}  // namespace
}  // namespace esvr::test
