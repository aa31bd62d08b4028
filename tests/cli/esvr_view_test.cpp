// Plan: a separate process serves small files. Clients reach it by the address that it prints, and
// signals end it. The command that it names makes the picture that it sends. It refuses what it
// cannot serve before it listens.

#include <chrono>
#include <csignal>
#include <functional>
#include <regex>
#include <thread>

#include "cli/esvr_render_fixture.h"
#include "cli/run_program.h"
#include "esvr/device.h"
#include "programs/page_figures.h"
#include "render/view/view_client.h"
#include "support/files.h"

namespace esvr::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

/// Waits until something is true. \return false if it is not in ten seconds
bool becomesTrue(const std::function<bool()>& condition) {
  constexpr int kAttempts = 2000;
  for (int i = 0; i < kAttempts && !condition(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return condition();
}

/// A running server, which is killed at the end of the test.
class ViewProgram {
 public:
  explicit ViewProgram(const Words& arguments) : program_(ESVR_VIEW, arguments) {
    (void)becomesTrue([&] { return program_.out().ends_with("\n") || !program_.runs(); });
    std::smatch parts;
    const std::string out = program_.out();
    static const std::regex kUrl("http://([^:]+):([0-9]+)/([0-9a-f]{32})/\n");
    if (!std::regex_match(out, parts, kUrl)) throw std::runtime_error(out + program_.err());
    host_ = parts[1];
    address_ = {static_cast<unsigned short>(std::stoi(parts[2])), parts[3]};
  }
  [[nodiscard]] const std::string& host() const { return host_; }
  [[nodiscard]] const ViewAddress& address() const { return address_; }
  [[nodiscard]] ProgramRun endBy(int signal) {
    program_.send(signal);
    return program_.wait();
  }

 private:
  RunningProgram program_;
  std::string host_;
  ViewAddress address_;
};

class EsvrView : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const std::string& name) const { return files_ / name; }
  static void expectRefused(const Words& arguments, int exitCode, const std::string& why) {
    const auto run = runProgram(ESVR_VIEW, arguments);
    EXPECT_THAT(run, Fails(exitCode, why));
    EXPECT_THAT(run.out, IsEmpty());
  }
  const ViewFiles files_;
};

TEST_F(EsvrView, HelpAndVersionNeedNoFiles) {
  for (const char* option : {"--help", "-h"})
    EXPECT_THAT(runProgram(ESVR_VIEW, {option}).out, Says("Usage:", "ssh"));
  EXPECT_THAT(runProgram(ESVR_VIEW, "--version").out, HasSubstr("esvr-view 0."));
}

TEST_F(EsvrView, ServesAtTheAddressThatItPrintsUntilASignal) {
  for (const int signal : {SIGINT, SIGTERM}) {
    ViewProgram program({at("blob.esvr")});
    EXPECT_EQ(program.host(), "127.0.0.1");
    ViewClient client(program.address());
    EXPECT_EQ(client.draw(drawMessage(1)).back().head["type"], "picture");
    succeeded(program.endBy(signal));
    EXPECT_THROW((void)client.receive(), SocketClosed);
  }
}

TEST_F(EsvrView, EndsInTheMiddleOfAPicture) {
  ViewProgram program({at("blob.vdb"), "--device", "cpu"});
  ViewClient client(program.address());
  Json message = drawMessage(1, {{"step", 0.05}, {"opacityLength", 1e5}});
  message["width"] = message["height"] = 2000;
  client.send(message);
  EXPECT_EQ(client.receive().head["last"], false);
  const auto begin = std::chrono::steady_clock::now();
  succeeded(program.endBy(SIGINT));
  // Without cancelling, the passes take a minute.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
}

TEST_F(EsvrView, HasATokenOfItsOwnInEveryRun) {
  const ViewProgram one({at("blob.esvr")}), other({at("blob.esvr")});
  EXPECT_NE(one.address().token, other.address().token);
  EXPECT_THROW(ViewClient({one.address().port, other.address().token}), SocketClosed);
}

TEST_F(EsvrView, ListensAtTheGivenPortAndAddress) {
  // A port that was free a moment ago.
  unsigned short port = 0;
  {
    const ViewProgram other({at("blob.esvr")});
    port = other.address().port;
  }
  const ViewProgram program(
      {at("blob.esvr"), "--port", std::to_string(port), "--bind", "127.0.0.2"});
  EXPECT_EQ(program.host(), "127.0.0.2");
  EXPECT_EQ(program.address().port, port);
  expectRefused({at("blob.esvr"), "--port", std::to_string(port), "--bind", "127.0.0.2"}, 1,
                "cannot listen at 127.0.0.2, port " + std::to_string(port));
}

TEST_F(EsvrView, SendsClientsAwayThatAreTooMany) {
  const ViewProgram program({at("blob.esvr"), "--clients", "1"});
  const ViewClient first(program.address());
  EXPECT_THROW(ViewClient{program.address()}, SocketClosed);
}

TEST_F(EsvrView, TheCommandMakesThePictureOfThePngFile) {
  const ViewProgram program({at("blob.esvr"), at("frames.esvr"), "--device", "cpu"});
  ViewClient client(program.address());
  const Json view{{"eye", {40, 20, 50}}, {"center", {8, 8, 8}}, {"fov", 40}};
  const Json transfer{{"colors", {{0.0, 0, 0, 1}, {2.0, 1, 1, 0}}},
                      {"opacity", {{0.0, 0, 0.5, 0}, {0.5, 0.9, 0.5, 0}, {2.0, 0.2, 0.5, 0}}}};
  for (const Json& scene :
       std::vector<Json>{{{"camera", view}},
                         {{"transfer", transfer}, {"opacityLength", 3}},
                         {{"file", 1}, {"frame", 9}, {"shade", true}},
                         {{"slice", {{"axis", "y"}, {"place", 8}}}},
                         {{"clip", {{2, 2, 2}, {9, 9, 9}}}, {"background", {0, 0.5, 1}}},
                         {{"mode", "maximum"}, {"lod", "off"}, {"between", "sum"}}}) {
    Json png = drawMessage(1, scene);
    png["type"] = "png";
    writeText(at("sent.png"), client.ask(png).bytes);
    const Json command = client
                             .ask({{"type", "command"},
                                   {"width", png["width"]},
                                   {"height", png["height"]},
                                   {"scene", png["scene"]}})
                             .head;
    if (!command["transfer"].is_null()) writeText(at("transfer.json"), command["transfer"]);
    const std::string folder = fs::path(at("x")).parent_path();
    const ProgramRun run =
        runShell("cd '" + folder + "' && PATH='" + fs::path(ESVR_RENDER).parent_path().string() +
                 ":'$PATH " + command["text"].get<std::string>() +
                 " --device cpu --force && mv picture*.png made.png");
    ASSERT_EQ(run.exitCode, 0) << command << run.err;
    EXPECT_EQ(readPng(at("made.png")).rgba, readPng(at("sent.png")).rgba) << command;
  }
}

TEST_F(EsvrView, OpensThePageByAFileThatOnlyItsOwnerCanRead) {
  const SearchPath path;
  path.add("xdg-open", "stat -c %a \"$1\" > " + at("mode") + " && cat \"$1\" > " + at("page.part") +
                           " && mv " + at("page.part") + " " + at("page"));
  ViewProgram program({at("blob.esvr"), "--open"});
  ASSERT_TRUE(becomesTrue([&] { return fs::exists(at("page")); }));
  EXPECT_EQ(readText(at("mode")), "600\n");
  EXPECT_THAT(readText(at("page")), HasSubstr("url=http://" + program.address().host() + "/" +
                                              program.address().token + "/\""));
  succeeded(program.endBy(SIGINT));
}

TEST_F(EsvrView, NeedsAProgramToOpenThePage) {
  const SearchPath path;
  path.hideOthers();
  EXPECT_THAT(runProgram(ESVR_VIEW, {at("blob.esvr"), "--open"}),
              Fails(2, "--open needs the program xdg-open"));
}

TEST_F(EsvrView, PrintsTheAddressAloneWhereQuiet) {
  ViewProgram quiet({at("blob.esvr"), "--quiet"});
  EXPECT_THAT(quiet.endBy(SIGINT).err, IsEmpty());
  ViewProgram usual({at("blob.esvr"), "--verbose"});
  EXPECT_THAT(usual.endBy(SIGINT).err, HasSubstr("Ctrl-C"));
}

TEST_F(EsvrView, DrawsOnTheNumberOfThreadsAndTheDeviceThatAreAsked) {
  const ViewProgram program({at("blob.esvr"), "--threads", "1", "--device", "cpu"});
  ViewClient client(program.address());
  EXPECT_EQ(client.ask({{"type", "describe"}}).head["device"], "CPU, 1 thread");
}

TEST_F(EsvrView, RefusesWhatItCannotServe) {
  expectRefused({}, 2, "FILE is missing");
  expectRefused({at("none.esvr")}, 3, "none.esvr");
  expectRefused({at("blob.esvr"), at("none.vdb")}, 3, "none.vdb");
  writeText(at("damaged.esvr"), "no ellipsoids");
  expectRefused({at("damaged.esvr")}, 3, "damaged.esvr");
  expectRefused({at("blob.esvr"), "--port", "70000"}, 2, "--port");
  expectRefused({at("blob.esvr"), "--bind", "nowhere"}, 2, "--bind must be an address");
  expectRefused({at("blob.esvr"), "--clients", "0"}, 2, "--clients");
  expectRefused({at("blob.esvr"), "--threads", "0"}, 2, "threads");
  expectRefused({at("blob.esvr"), "--device", "tpu"}, 2, "tpu");
  expectRefused({at("blob.vdb"), "--max-memory", "1KB"}, 5, "blob.vdb");
  expectRefused({at("blob.vdb"), "--scratch", at("nowhere")}, 2, "nowhere");
}

using EsvrViewExport = EsvrView;

TEST_F(EsvrViewExport, WritesAPageWithTheFile) {
  EXPECT_THAT(succeeded(runProgram(ESVR_VIEW, {"--export", at("page.html"), at("blob.esvr")})).err,
              HasSubstr("page.html"));
  const std::string page = readText(at("page.html"));
  // The magic number of .esvr files and the first byte of their version, in base64.
  const std::string magic = readText(at("blob.esvr")).substr(0, 6);
  EXPECT_THAT(page, HasSubstr("data-name=\"blob.esvr\">" + report::base64(magic)));
  // Nothing is loaded from elsewhere.
  for (const char* loads : {"src=\"", "<link rel=\"stylesheet\"", "@import"})
    EXPECT_THAT(page, testing::Not(HasSubstr(loads)));
}

TEST_F(EsvrViewExport, KeepsAPageThatIsThereUnlessForced) {
  writeText(at("page.html"), "mine");
  expectRefused({"--export", at("page.html"), at("blob.esvr")}, 1, "page.html");
  EXPECT_EQ(readText(at("page.html")), "mine");
  succeeded(runProgram(ESVR_VIEW, {"--export", at("page.html"), at("blob.esvr"), "-f"}));
  EXPECT_NE(readText(at("page.html")), "mine");
}

TEST_F(EsvrViewExport, RefusesWhatAPageCannotShow) {
  const std::string page = at("page.html");
  expectRefused({"--export", page, at("blob.vdb")}, 2, "make one by vdb2esvr");
  expectRefused({"--export", page, at("frames.esvr")}, 2, "frames.esvr holds a sequence");
  expectRefused({"--export", page, at("none.esvr")}, 3, "none.esvr");
  expectRefused({"--export", page, at("blob.esvr"), at("frames.esvr")}, 2, "one FILE.esvr");
  expectRefused({"--export", page, at("blob.esvr"), "--open"}, 2, "--open");
  expectRefused({"--export", at("page.txt"), at("blob.esvr")}, 2, ".html");
  writeText(at("damaged.esvr"), "no ellipsoids");
  expectRefused({"--export", page, at("damaged.esvr")}, 3, "damaged.esvr");
  EXPECT_FALSE(fs::exists(page));
}

}  // namespace
}  // namespace esvr::test
