#include "vdb2esvr/options.h"

#include <limits>

#include "cli/box_option.h"
#include "cli/byte_size.h"
#include "cli/choice.h"
#include "cli/command_line.h"
#include "cli/error_bound.h"
#include "cli/table.h"
#include "vdb2esvr/paper_options.h"

namespace esvr::vdb2esvr {
namespace {

using cli::Arguments;
using cli::requireRange;
using cli::po::bool_switch;
using cli::po::value;

constexpr std::int64_t kMaxEllipsoids = std::numeric_limits<std::uint32_t>::max();
constexpr std::int64_t kMaxIterations = 10'000'000;
constexpr double kHighestPsnr = 300.0;  // dB; float32 ends at about 150
constexpr double kLongestRun = 1e9;     // seconds
constexpr double kLargestRatio = 1e9;
constexpr double kMaxLoss = 20.0;                  // dB
constexpr double kMinVram = 1e-3, kMaxVram = 1e6;  // GB
constexpr float kLargestKappa = 1e4f;              // kernel.h

cli::ProgramText programText() {
  return {
      .name = kProgram,
      .purpose =
          "Fits ellipsoids to the sparse grids of a VDB file and writes them as .esvr, which\n"
          "esvr2vdb turns back into the VDB: transforms, names and metadata exactly, voxels\n"
          "as close as asked.",
      .usage = "  vdb2esvr IN.vdb OUT.esvr [-g NAME]... [--size 50KB | --psnr DB | --count N]",
      .notes =
          "Without -g all float and double grids are fitted, the others are listed and skipped.\n"
          "--size and --ratio choose the number of ellipsoids and of bits, for the best file that\n"
          "is not larger (at most 2 % smaller); --psnr alone looks for the smallest that reaches "
          "it.\n"
          "Several grids share the bytes by their active voxels.\n"
          "--count, --psnr and --seconds combine: the run ends at the first that is met.\n"
          "An ordinary run prints a table on stdout: PSNR and the largest error are those of\n"
          "the voxels that the written file gives back.\n"
          "\n"
          "Ctrl-C ends the fit; what was reached is written or not, as --on-cancel says, and the\n"
          "exit code is 1. A second Ctrl-C ends the program at once. OUT.esvr is never half a "
          "file.\n"
          "\n"
          "Exit codes: 0 done, 1 failure or interrupted, 2 wrong options, 3 input that cannot be\n"
          "used, 4 --psnr not reached (the file is written), 5 device or memory.",
      .examples =
          "  vdb2esvr smoke.vdb smoke.esvr                       choose everything from the data\n"
          "  vdb2esvr smoke.vdb smoke.esvr --size 100KB          the best of 100 KB\n"
          "  vdb2esvr smoke.vdb smoke.esvr --psnr 45             the smallest of 45 dB\n"
          "  vdb2esvr smoke.vdb smoke.esvr -g density --count 12000 --report smoke.json\n"
          "  vdb2esvr ct.vdb ct.esvr --max-error 0.5%            every voxel within the bound\n"
          "  vdb2esvr ct.vdb ct.esvr --seconds 30 --box 0,0,0,255,255,255"};
}

void addFitOptions(cli::po::options_description& options) {
  const double beta = FitOptions{}.beta;
  // clang-format off
  options.add_options()
    ("count", value<std::int64_t>()->value_name("N"), "ellipsoids; with --psnr: at most so many")
    ("size", value<std::string>()->value_name("BYTES"),
     "the best file of at most so many bytes: 50000, 50KB, 2.6MB")
    ("ratio", value<double>()->value_name("R"), "the same, IN's size over R")
    ("psnr", value<double>()->value_name("DB"), "reach this PSNR over the box, in few bytes")
    ("lossless", bool_switch(), "voxels and active mask bit for bit, no ellipsoids")
    ("max-error", value<std::string>()->value_name("E"),
     "every voxel within E of the source, or E% of its range: voxels alone or ellipsoids with a "
     "residual, whichever is smaller")
    ("voxels-only", bool_switch(), "with --max-error: voxels alone, without trying ellipsoids")
    ("topology", value<std::string>()->value_name("T")->default_value("threshold"),
     "threshold (voxels are active by their values) or exact (the source's mask is stored)")
    ("seconds", value<double>()->value_name("S"), "the best within this time, each grid")
    ("iterations", value<std::int64_t>()->value_name("N"), "length of the fit's schedule")
    ("preset", value<std::string>()->value_name("P")->default_value("standard"),
     "draft, standard or high: what is not given otherwise; paper: the paper's method")
    ("kappa", value<float>()->value_name("K"),
     "edge of the ellipsoids (default: fitted with the rest, for squared errors)")
    ("loss", value<std::string>()->value_name("L")->default_value("squared"),
     "squared (what PSNR asks for) or paper (L1 + D-SSIM)")
    ("beta", value<double>()->value_name("B")->default_value(beta, cli::shortNumber(beta)),
     "share of L1 in the paper's loss, 0 to 1")
    ("box", value<std::string>()->value_name("BOX"),
     "x0,y0,z0,x1,y1,z1 of the PSNR (default: the active voxels' bounding box)")
    ("seed", value<std::int64_t>()->value_name("N")->default_value(std::int64_t(FitOptions{}.seed)),
     "of the random choices; the same seed gives the same ellipsoids")
    ("storage", value<std::string>()->value_name("S")->default_value("compact"),
     "compact (quantised, about 9 bytes an ellipsoid) or float32 (about 34)")
    ("storage-loss",
     value<double>()->value_name("DB")->default_value(CompactOptions::kDefaultLoss),
     "PSNR that --storage compact may cost; with --psnr: whatever that leaves")
    ("device", value<std::string>()->value_name("D")->default_value("auto"),
     "auto (a GPU where there is one), cpu, cuda or cuda:N")
    ("max-vram", value<double>()->value_name("GB"), "GPU memory to use (default: what is free)");
  // clang-format on
}

void addFileOptions(cli::po::options_description& options) {
  // clang-format off
  options.add_options()
    ("grid,g", value<std::vector<std::string>>()->value_name("NAME")->composing(),
     "fit this grid only; may be repeated; 'density[1]' is the second of that name")
    ("nonfinite", value<std::string>()->value_name("W")->default_value("refuse"),
     "refuse grids with NaN or infinite voxels, or take them as zero")
    ("on-cancel", value<std::string>()->value_name("W")->default_value("keep"),
     "keep or discard the best so far when interrupted")
    ("report", value<std::string>()->value_name("FILE"),
     "write a JSON report to FILE.json, '-' for stdout")
    ("hits", bool_switch(), "report how many ellipsoids a voxel meets on average")
    ("force,f", bool_switch(), "replace OUT.esvr and the report if they exist");
  // clang-format on
}

cli::CommandLine commandLine() {
  cli::CommandLine line(programText());
  line.argument("input", "IN.vdb");
  line.argument("output", "OUT.esvr");
  addFileOptions(line.options());
  addFitOptions(line.options());
  line.options().add(paperOptions());
  return line;
}

/// A number within [low, high], as the type that takes it.
template <class To, class From>
std::optional<To> bounded(const Arguments& arguments, const std::string& option, From low,
                          From high) {
  const auto given = arguments.find<From>(option);
  if (!given) return std::nullopt;
  requireRange(option, *given, low, high);
  return To(*given);
}

FitOptions fitOptions(const Arguments& a) {
  FitOptions fit;
  fit.count = bounded<std::size_t>(a, "count", std::int64_t{1}, kMaxEllipsoids);
  fit.psnr = bounded<double>(a, "psnr", 0.0, kHighestPsnr);
  fit.seconds = bounded<double>(a, "seconds", 1e-3, kLongestRun);
  fit.iterations = bounded<std::uint32_t>(a, "iterations", std::int64_t{1}, kMaxIterations);
  fit.paper = paperMethod(a);
  fit.preset = cli::choose<Preset>("preset", a.get<std::string>("preset"),
                                   {{"draft", Preset::kDraft},
                                    {"standard", Preset::kStandard},
                                    {"high", Preset::kHigh},
                                    {"paper", Preset::kStandard}});
  fit.loss = cli::choose<Loss>("loss", a.get<std::string>("loss"),
                               {{"squared", Loss::kSquared}, {"paper", Loss::kPaper}});
  fit.beta = *bounded<double>(a, "beta", 0.0, 1.0);
  if (const auto gigabytes = bounded<double>(a, "max-vram", kMinVram, kMaxVram))
    fit.maxDeviceBytes = std::size_t(*gigabytes * 1e9);
  fit.kappa = bounded<float>(a, "kappa", -kLargestKappa, kLargestKappa);
  if (const auto box = a.find<std::string>("box")) fit.box = cli::parseBox(*box);
  fit.seed =
      *bounded<std::uint64_t>(a, "seed", std::int64_t{0}, std::numeric_limits<std::int64_t>::max());
  return fit;
}

Storage storage(const Arguments& a) {
  return cli::choose<Storage>("storage", a.get<std::string>("storage"),
                              {{"compact", Storage::kCompact}, {"float32", Storage::kFloat32}});
}

/// As the paper stores them, unless asked otherwise. \throws UsageError  k of each and compact
Storage storageOfPaper(const Arguments& a, const PaperMethod& method) {
  if (a.values["storage"].defaulted()) return Storage::kFloat32;
  const Storage asked = storage(a);
  if (method.learnK && asked == Storage::kCompact)
    throw UsageError("--sharpness learned needs --storage float32: the compact form has one edge");
  return asked;
}

/// "0.01", or "1%" of the range of values.
void readBound(const std::string& text, VoxelDemand& demand) {
  const cli::ErrorBound bound = cli::parseErrorBound("max-error", text);
  demand.bound = bound.amount;
  demand.relative = bound.relative;
}

void readVoxels(const Arguments& a, Options& options) {
  const bool exact = a.get<bool>("lossless");
  const auto bound = a.find<std::string>("max-error");
  const bool alone = a.get<bool>("voxels-only");
  if (alone && !bound) throw UsageError("--voxels-only says how --max-error is met; give that too");
  if (!exact && !bound) return;
  if (exact && bound) throw UsageError("--lossless leaves no error: it takes no --max-error");
  const std::string given = exact ? "--lossless" : "--max-error";
  for (const char* option : {"count", "psnr", "seconds", "size", "ratio"})
    if (a.has(option))
      throw UsageError(given + " chooses itself what to store; it takes no --" + option);
  VoxelDemand demand;
  demand.exact = exact;
  demand.alone = alone;
  if (bound) readBound(*bound, demand);
  options.voxels = demand;
}

Activity activity(const Arguments& a) {
  return cli::choose<Activity>("topology", a.get<std::string>("topology"),
                               {{"threshold", Activity::kByValue}, {"exact", Activity::kExact}});
}

void readSize(const Arguments& a, Options& options) {
  if (const auto size = a.find<std::string>("size"))
    options.size = cli::parseByteSize("size", *size);
  options.ratio = bounded<double>(a, "ratio", 1.0, kLargestRatio);
  if (!options.size && !options.ratio) return;
  const std::string given = options.size ? "--size" : "--ratio";
  if (options.fit.paper) throw UsageError("--preset paper has no " + given + ": use --count");
  if (options.size && options.ratio) throw UsageError("--size and --ratio are two sizes; give one");
  for (const char* option : {"count", "psnr", "seconds"})
    if (a.has(option))
      throw UsageError(given + " chooses the number of ellipsoids itself; it takes no --" + option);
  if (options.storage != Storage::kCompact)
    throw UsageError(given + " needs --storage compact, where bits can be chosen");
}

NonFinite nonFinite(const Arguments& a) {
  return cli::choose<NonFinite>("nonfinite", a.get<std::string>("nonfinite"),
                                {{"refuse", NonFinite::kRefuse}, {"zero", NonFinite::kZero}});
}

OnCancel onCancel(const Arguments& a) {
  return cli::choose<OnCancel>("on-cancel", a.get<std::string>("on-cancel"),
                               {{"keep", OnCancel::kKeep}, {"discard", OnCancel::kDiscard}});
}

}  // namespace

bool searchesForPsnr(const Options& options) {
  return options.fit.psnr && !options.fit.count && !options.fit.seconds && !options.fit.paper &&
         options.storage == Storage::kCompact;
}

std::optional<Options> parseOptions(int argc, const char* const* argv) {
  const auto arguments = commandLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const Arguments& a = *arguments;
  Options options;
  options.input = a.get<std::string>("input");
  options.output = a.get<std::string>("output");
  options.grids = a.find<std::vector<std::string>>("grid").value_or(std::vector<std::string>{});
  options.fit = fitOptions(a);
  options.storage = options.fit.paper ? storageOfPaper(a, *options.fit.paper) : storage(a);
  options.storageLoss = *bounded<double>(a, "storage-loss", 0.0, kMaxLoss);
  options.activity = activity(a);
  readVoxels(a, options);
  readSize(a, options);
  options.read.nonFinite = nonFinite(a);
  options.device = a.get<std::string>("device");
  options.onCancel = onCancel(a);
  options.report = a.find<std::string>("report").value_or("");
  options.countHits = a.get<bool>("hits");
  options.overwrite = a.get<bool>("force");
  options.threads = a.threads;
  options.verbosity = a.verbosity;
  options.commandLine.assign(argv, argv + argc);
  return options;
}

}  // namespace esvr::vdb2esvr
