// Plan: every option of every program has a test that shows its effect. A table names that test.
// The test here reads --help and --help expert. It fails if an option is missing from the table or
// from both of them, or if the named test does not exist or does not use the option.

#include <map>
#include <regex>

#include "cli/run_program.h"

namespace esvr::test {
namespace {

using Table = std::map<std::string, std::string>;  // "Suite.test" by option

struct Program {
  const char* name;
  const char* path;
  const char* job;  ///< command of esvr-compare
  Table tests;
};
std::ostream& operator<<(std::ostream& out, const Program& program) { return out << program.name; }

/// Options that all programs share.
Table withCommon(Table tests) {
  for (const char* option : {"--help", "--version"})
    tests.try_emplace(option, "EveryProgram.helpAndVersionNeedNoFiles");
  for (const char* option : {"--quiet", "--verbose"})
    tests.try_emplace(option, "EveryProgram.saysNothingWhereQuietAndMoreWhereVerbose");
  tests.try_emplace("--threads", "EveryProgram.takesANumberOfThreads");
  return tests;
}

Table vdb2esvrTests() {
  return {{"--box", "Vdb2EsvrOption.boxIsWherePsnrIsTaken"},
          {"--chunk-voxels", "Vdb2EsvrOption.chunkVoxelsDivideTheFit"},
          {"--count", "Vdb2EsvrOption.countIsTheNumberOfEllipsoids"},
          {"--density-scale", "SplatFiles.HaveTheColorsAndTheDensityThatAreAskedFor"},
          {"--device", "Vdb2EsvrOption.devicesAreTakenAsNamed"},
          {"--effort", "Vdb2EsvrOption.effortLengthensTheFit"},
          {"--force", "Vdb2Esvr.keepsAnExistingFileUnlessForced"},
          {"--frames", "SequenceFiles.haveTheBytesOfSingleFilesOnAnyNumberOfThreads"},
          {"--grid", "Vdb2Esvr.fitsTheGridsThatAreNamedOnly"},
          {"--help", "Vdb2Esvr.listsTheKeysOfThePapersMethod"},
          {"--iterations", "Vdb2EsvrOption.iterationsEndTheFit"},
          {"--keep", "CarriedFile.KeepsANamedGridUnchanged"},
          {"--lossless", "Vdb2Esvr.losslessGivesBackEveryBit"},
          {"--max-error", "Vdb2Esvr.keepsEveryVoxelWithinTheBound"},
          {"--max-memory", "Vdb2Esvr.refusesWhatTakesMoreMemoryThanAllowed"},
          {"--max-relative-error", "Vdb2EsvrOption.maxRelativeErrorHoldsAtEveryVoxel"},
          {"--max-vram", "Vdb2EsvrOption.maxVramBoundsTheDevicesMemoryOnGpu"},
          {"--measure", "Vdb2EsvrOption.measureSaysWhatAPresetMeans"},
          {"--missing", "SequenceFiles.mayBeHeldOrSkippedWhereTheyAreMissing"},
          {"--nonfinite", "NonFiniteFile.comesBackInEveryFormAndOutput"},
          {"--on-error", "SequenceFiles.stopAfterADamagedOneWhereAsked"},
          {"--paper", "Vdb2Esvr.reportsWhatThePapersMethodUsed"},
          {"--picture-psnr", "Vdb2EsvrOption.picturePsnrIsReached"},
          {"--preset", "Vdb2EsvrOption.presetsTakeMoreAndMoreIterations"},
          {"--progress", "Parts.areReportedAsJson"},
          {"--psnr", "Vdb2EsvrOption.psnrIsReached"},
          {"--ratio", "Vdb2EsvrOption.ratioBoundsTheFile"},
          {"--report", "Vdb2Esvr.reportsWhatTheFileHolds"},
          {"--representation", "Vdb2EsvrOption.representationIsTheOneWanted"},
          {"--resume", "Parts.ofAnInterruptedRunAreUsedAgain"},
          {"--scratch", "Scratch.HoldsVoxelsAndChangesNoBit"},
          {"--seconds", "Vdb2EsvrOption.secondsEndTheFit"},
          {"--seed", "Vdb2EsvrOption.seedsGiveOtherFiles"},
          {"--share", "SharingGrids.takeFewerBytesWithTheSameQuality"},
          {"--size", "Vdb2Esvr.keepsToTheSizeAskedFor"},
          {"--skip", "CarriedFile.LeavesOutTheGridsThatAreNamedBySkip"},
          {"--storage", "Vdb2EsvrOption.storageIsCompactOrFloat32"},
          {"--threads", "Vdb2Esvr.givesTheSameBytesInEveryRunOnAnyNumberOfThreads"},
          {"--tone", "Vdb2EsvrOption.toneIsStored"},
          {"--topology", "Vdb2Esvr.storesTheMaskWhereAsked"},
          {"--up", "SplatFiles.AreTurnedAsTheUpwardAxisSays"},
          {"--voxel-size", "SplatFiles.AreConvertedLikeAVdb"}};
}

Table esvr2vdbTests() {
  return {{"--bbox", "Esvr2Vdb.writesAPartOfTheVoxelsWithoutReadingTheRest"},
          {"--box", "Esvr2VdbOption.boxIsWherePsnrIsTaken"},
          {"--check", "Esvr2Vdb.checksAFile"},
          {"--coarsen", "CoarserGrid.hasTheAveragesAndTheTransform"},
          {"--colors", "SplatFiles.HaveTheColorsAndTheDensityThatAreAskedFor"},
          {"--density-scale", "SplatFiles.HaveTheColorsAndTheDensityThatAreAskedFor"},
          {"--force", "Esvr2Vdb.keepsAnExistingFileUnlessForced"},
          {"--frames", "SequenceBack.hasTheVoxelsOfSingleFiles"},
          {"--grid", "Esvr2Vdb.writesTheGridsThatAreNamedOnly"},
          {"--half", "Esvr2Vdb.savesAsHalfWhereAsked"},
          {"--kind", "SplatFiles.AreWrittenInEveryForm"},
          {"--list", "Esvr2Vdb.listsGridsAndSections"},
          {"--lod", "Esvr2Vdb.writesTheHeaviestEllipsoidsOnly"},
          {"--max-ellipsoids", "Esvr2Vdb.writesTheHeaviestEllipsoidsOnly"},
          {"--max-memory", "Esvr2Vdb.refusesWhatNeedsMoreMemoryThanAllowed"},
          {"--missing", "SequenceBack.holdsOrSkipsMissingFrames"},
          {"--no-tiles", "Esvr2VdbOption.noTilesWritesLeaves"},
          {"--on-error", "SequenceBack.namesDamagedFramesAndStopsWhereAsked"},
          {"--reference", "Esvr2Vdb.printsTheErrorAgainstAReference"},
          {"--scratch", "Scratch.HoldsVoxelsOfLosslessFilesOnTheWayThereAndBack"},
          {"--threshold", "Esvr2Vdb.hasFewerActiveVoxelsAtAHigherThreshold"},
          {"--up", "SplatFiles.AreTurnedAsTheUpwardAxisSays"},
          {"--voxel-size", "SplatFiles.HaveLargeVoxelsOnlyWhereTheyAreAskedFor"}};
}

Table renderTests() {
  return {{"--background", "EsvrRender.IsTransparentAroundTheVolumeUnlessABackgroundIsGiven"},
          {"--bench", "EsvrRender.MeasuresWithoutKeepingAPicture"},
          {"--between", "EsvrRender.TheSumIsShownBetweenVoxelsWhereAskedFor"},
          {"--bits", "EsvrRender.APngMayHave16BitsAChannel"},
          {"--camera", "EsvrRender.ACameraFileIsReplacedByOptions"},
          {"--center", "EsvrRender.AGivenCameraIsTaken"},
          {"--classification", "EsvrRender.TheClassificationChangesThePicture"},
          {"--clip", "EsvrRender.ModesAndBoxesChangeThePicture"},
          {"--colors", "EsvrRender.AnExrHasTheSamePictureInLinearLight"},
          {"--depth", "EsvrRender.DistancesAreWrittenWhereLightStops"},
          {"--depth-parts", "EsvrRender.PartsOfTheDepthAndMemoryChangeNothingOnGpu"},
          {"--device", "EsvrRender.PartsOfTheDepthAndMemoryChangeNothingOnGpu"},
          {"--eye", "EsvrRender.AGivenCameraIsTaken"},
          {"--force", "EsvrRender.KeepsAPictureThatIsThere"},
          {"--fov", "EsvrRender.ACameraFileIsReplacedByOptions"},
          {"--fps", "EsvrRenderTurn.FfmpegGetsTheRateAndTheCommandLine"},
          {"--frames", "EsvrRender.SomeFramesOfATurntableAreThoseOfTheWhole"},
          {"--grid", "EsvrRender.TheGridThatIsNamedIsDrawn"},
          {"--height", "EsvrRender.ACameraFileIsReplacedByOptions"},
          {"--help", "EsvrRender.HelpNamesEveryBuiltInFunction"},
          {"--legend", "EsvrRenderLegend.IsRefusedWhereItCannotBeDrawn"},
          {"--light", "EsvrRender.ShadingChangesThePicture"},
          {"--lod", "EsvrRender.LevelsOfDetailChangePicturesOfWidePixels"},
          {"--max-memory", "EsvrRender.PicturesBeyondTheMemoryAllowedAreRefused"},
          {"--max-vram", "EsvrRender.PartsOfTheDepthAndMemoryChangeNothingOnGpu"},
          {"--min-transmittance", "EsvrRender.TheSamplingOfRaysChangesThePicture"},
          {"--mode", "EsvrRender.ModesAndBoxesChangeThePicture"},
          {"--opacity", "EsvrRender.ASavedTransferFunctionDrawsTheSame"},
          {"--opacity-length", "EsvrRender.TheSamplingOfRaysChangesThePicture"},
          {"--orthographic", "EsvrRender.TheMiddleOfTheVolumeIsInTheMiddleOfThePicture"},
          {"--preset", "EsvrRender.APresetAndARangeChangeThePicture"},
          {"--range", "EsvrRender.APresetAndARangeChangeThePicture"},
          {"--ref", "EsvrRender.ComparesWithAReference"},
          {"--ref-supersample", "EsvrRender.ComparesWithAReferenceOfManyRays"},
          {"--report", "EsvrRender.ComparesWithAReference"},
          {"--resolution", "EsvrRender.MeasuresWithoutKeepingAPicture"},
          {"--scratch", "Scratch.IsAFolderThatExistsInEveryProgram"},
          {"--shade", "EsvrRender.ShadingChangesThePicture"},
          {"--sheet", "EsvrRender.ComparesWithAReference"},
          {"--slice", "EsvrRender.ModesAndBoxesChangeThePicture"},
          {"--step", "EsvrRender.TheSamplingOfRaysChangesThePicture"},
          {"--tf", "EsvrRender.APresetAndARangeChangeThePicture"},
          {"--tf-save", "EsvrRender.ASavedTransferFunctionDrawsTheSame"},
          {"--threads", "EsvrRender.TheNumberOfThreadsChangesNothing"},
          {"--turntable", "EsvrRender.ATurntableWritesAPictureForEveryAngle"},
          {"--up", "EsvrRender.AGivenCameraIsTaken"},
          {"--values", "EsvrRender.ValuesOfFewerBitsChangeThePictureALittle"},
          {"--with", "EsvrRenderGrids.EachPartOfALookChangesThePicture"}};
}

Table viewTests() {
  return {{"--bind", "EsvrView.ListensAtTheGivenPortAndAddress"},
          {"--clients", "EsvrView.SendsClientsAwayThatAreTooMany"},
          {"--device", "EsvrView.DrawsOnTheNumberOfThreadsAndTheDeviceThatAreAsked"},
          {"--export", "EsvrViewExport.WritesAPageWithTheFile"},
          {"--force", "EsvrViewExport.KeepsAPageThatIsThereUnlessForced"},
          {"--help", "EsvrView.HelpAndVersionNeedNoFiles"},
          {"--max-memory", "EsvrView.RefusesWhatItCannotServe"},
          {"--open", "EsvrView.OpensThePageByAFileThatOnlyItsOwnerCanRead"},
          {"--port", "EsvrView.ListensAtTheGivenPortAndAddress"},
          {"--quiet", "EsvrView.PrintsTheAddressAloneWhereQuiet"},
          {"--scratch", "EsvrView.RefusesWhatItCannotServe"},
          {"--threads", "EsvrView.DrawsOnTheNumberOfThreadsAndTheDeviceThatAreAsked"},
          {"--verbose", "EsvrView.PrintsTheAddressAloneWhereQuiet"},
          {"--version", "EsvrView.HelpAndVersionNeedNoFiles"}};
}

Table checkTests() {
  return {{"--baseline", "CompareCheck.holdsARunAgainstItsBaseline"},
          {"--box", "CompareOption.checkTakesTheGridTheBoxAndThePeak"},
          {"--fail-on", "CompareCheck.tellsDifferencesBesidesTheVoxels"},
          {"--force", "CompareOption.reportsAreReplacedWhereForced"},
          {"--frames", "SequenceCheck.namesFramesThatOnlyOneSequenceHas"},
          {"--grid", "CompareOption.checkTakesTheGridTheBoxAndThePeak"},
          {"--ignore-grids", "CompareCarried.AMissingGridFailsUnlessItIsIgnored"},
          {"--max-bytes", "CompareCheck.boundsTheFilesBytes"},
          {"--max-error", "CompareLimit.passesOrFailsWithTheFigure"},
          {"--max-mass-error", "CompareLimit.passesOrFailsWithTheFigure"},
          {"--max-p999-error", "CompareLimit.passesOrFailsWithTheFigure"},
          {"--max-relative-error", "CompareCheck.boundsTheErrorRelativeToEachValue"},
          {"--max-mesh-distance", "CompareCheck.boundsTheDistanceOfTheSurfacesOfLevelSets"},
          {"--max-memory", "CompareCheck.refusesWhatTakesMoreMemoryThanAllowed"},
          {"--min-iou", "CompareLimit.passesOrFailsWithTheFigure"},
          {"--min-psnr", "CompareLimit.passesOrFailsWithTheFigure"},
          {"--min-psnr-active", "CompareLimit.passesOrFailsWithTheFigure"},
          {"--min-psnr-t10", "CompareLimit.passesOrFailsWithTheFigure"},
          {"--min-psnr-t50", "CompareLimit.passesOrFailsWithTheFigure"},
          {"--min-psnr-t90", "CompareLimit.passesOrFailsWithTheFigure"},
          {"--min-psnr-temporal", "SequenceCheck.countsErrorsThatChange"},
          {"--min-ssim", "CompareLimit.passesOrFailsWithTheFigure"},
          {"--peak", "CompareOption.checkTakesTheGridTheBoxAndThePeak"},
          {"--report", "CompareOption.reportsAreReplacedWhereForced"},
          {"--scratch", "Scratch.HoldsVoxelsOfLosslessFilesOnTheWayThereAndBack"},
          {"--ssim", "CompareCheck.findsNoErrorInTheFileItself"},
          {"--update", "CompareCheck.holdsARunAgainstItsBaseline"}};
}

Table tableTests() {
  return {{"--box", "CompareOption.tableTakesTheGridTheBoxAndThePeak"},
          {"--colors", "CompareTable.SlowComparesPictures"},
          {"--csv", "CompareTable.writesReportsInEachForm"},
          {"--device", "CompareTable.fitsEllipsoidsWhereAsked"},
          {"--external", "CompareTable.takesExternalResults"},
          {"--external-command", "CompareTableCommand.isSearchedForASize"},
          {"--fit", "CompareTable.fitsEllipsoidsWhereAsked"},
          {"--force", "CompareOption.tablesAreReplacedWhereForced"},
          {"--grid", "CompareOption.tableTakesTheGridTheBoxAndThePeak"},
          {"--html", "CompareTable.writesReportsInEachForm"},
          {"--image-size", "CompareTable.SlowComparesPictures"},
          {"--image-step", "CompareOption.tablesPicturesTakeStepAndTransferFunctions"},
          {"--images", "CompareTable.SlowComparesPictures"},
          {"--lpips", "CompareTable.takesLpipsFromAProgramOfTheUsers"},
          {"--markdown", "CompareTable.writesReportsInEachForm"},
          {"--max-dense", "CompareTable.leavesRowsThatCannotBeWithTheirReason"},
          {"--max-memory", "CompareTable.refusesWhatTakesMoreMemoryThanAllowed"},
          {"--peak", "CompareOption.tableTakesTheGridTheBoxAndThePeak"},
          {"--psnr", "CompareTableCommand.isSearchedForAPsnrOverTheBoxOrTheActiveVoxels"},
          {"--psnr-active", "CompareTableCommand.isSearchedForAPsnrOverTheBoxOrTheActiveVoxels"},
          {"--report", "CompareTable.writesReportsInEachForm"},
          {"--row", "CompareTable.takesLpipsFromAProgramOfTheUsers"},
          {"--rows", "CompareTable.hasLosslessRowsWithoutError"},
          {"--runs", "CompareTable.SlowKeepsTheRowsThatAreMadeWhenInterrupted"},
          {"--scratch", "Scratch.IsAFolderThatExistsInEveryProgram"},
          {"--size", "CompareTable.matchesACandidatesSizeAndShowsTheSearch"},
          {"--tf", "CompareOption.tablesPicturesTakeStepAndTransferFunctions"}};
}

std::vector<Program> programs() {
  return {{"vdb2esvr", VDB2ESVR, "", vdb2esvrTests()},
          {"esvr2vdb", ESVR2VDB, "", esvr2vdbTests()},
          {"render", ESVR_RENDER, "", renderTests()},
          {"view", ESVR_VIEW, "", viewTests()},
          {"check", ESVR_COMPARE, "check", checkTests()},
          {"table", ESVR_COMPARE, "table", tableTests()}};
}

/// The short name of each long name, such as "-g" for "--grid"; empty if there is none.
std::map<std::string, std::string> optionsOf(const Program& program) {
  std::string help;
  for (const char* topic : {"--help", "expert"}) {
    Words arguments{"--help"};
    if (*program.job) arguments.insert(arguments.begin(), program.job);
    if (topic != arguments.back()) arguments.emplace_back(topic);
    help += runProgram(program.path, arguments).out;
  }
  static const std::regex kOption(R"(\n  (?:(-\w) \[ )?(--[\w-]+))");
  std::map<std::string, std::string> options;
  for (std::sregex_iterator it(help.begin(), help.end(), kOption), end; it != end; ++it)
    options[(*it)[2]] = (*it)[1];
  return options;
}

const Words& testSources() {
  static const Words kSources = [] {
    Words sources;
    for (const char* folder : {"/tests/cli", "/tests/programs", "/tests/samples"})
      for (const auto& file :
           std::filesystem::directory_iterator(ESVR_SOURCE_DIR + std::string(folder)))
        if (file.path().string().ends_with("_test.cpp") &&
            file.path().filename() != "option_table_test.cpp")
          sources.push_back(readText(file.path()));
    return sources;
  }();
  return kSources;
}

/// The source text of a test and of its fixture.
std::string sourceOf(const std::string& test) {
  const std::string suite = test.substr(0, test.find('.')), name = test.substr(suite.size() + 1);
  for (const std::string& source : testSources())
    for (const char* macro : {"TEST(", "TEST_F(", "TEST_P("}) {
      const std::size_t begin = source.find(macro + suite + ", " + name + ")");
      if (begin == std::string::npos) continue;
      const std::size_t end = source.find("\nTEST", begin), fixture = source.find("class " + suite);
      std::string text = source.substr(begin, end - begin);
      if (fixture != std::string::npos)
        text += source.substr(fixture, source.find("\n};", fixture) - fixture);
      return text;
    }
  return {};
}

/// True if a test uses an option as an argument: in quotes, without dashes in a table of options,
/// or in a command line.
bool uses(const std::string& source, const std::string& option, const std::string& shortName) {
  for (const std::string& form : {'"' + option + '"', option + ' ', '"' + option.substr(2) + '"',
                                  '"' + (shortName.empty() ? option : shortName) + '"'})
    if (source.find(form) != std::string::npos) return true;
  return false;
}

class OptionTable : public testing::TestWithParam<Program> {};

TEST_P(OptionTable, namesATestOfEachOption) {
  const auto options = optionsOf(GetParam());
  const Table tests = withCommon(GetParam().tests);
  EXPECT_GT(options.size(), 10u);
  for (const auto& [option, shortName] : options) {
    const auto found = tests.find(option);
    if (found == tests.end()) {
      ADD_FAILURE() << option << " has no test that shows its effect; name it in this table";
      continue;
    }
    EXPECT_TRUE(uses(sourceOf(found->second), option, shortName))
        << found->second << " is not there or does not use " << option;
  }
  for (const auto& [option, test] : tests)
    EXPECT_TRUE(options.contains(option)) << option << " is in this table and not in --help";
}

INSTANTIATE_TEST_SUITE_P(Programs, OptionTable, testing::ValuesIn(programs()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace esvr::test
