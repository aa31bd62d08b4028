// vdb2esvr: fits ellipsoids to the grids of a VDB file.

#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "esvr/error.h"
#include "programs/run_main.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/run.h"

namespace esvr::vdb2esvr {
namespace {

/// Keeps what a rank other than rank 0 prints, since all ranks print the same about wrong options,
/// missing files and interruptions. Only what a rank that fails alone has to say is printed.
class KeptMessages {
 public:
  KeptMessages() : out_(std::cout.rdbuf(kept_.rdbuf())), err_(std::cerr.rdbuf(messages_.rdbuf())) {}
  KeptMessages(const KeptMessages&) = delete;
  KeptMessages& operator=(const KeptMessages&) = delete;
  ~KeptMessages() {
    std::cout.rdbuf(out_);
    std::cerr.rdbuf(err_);
  }

  void print(int rank) const {
    std::ostream(err_) << "rank " << rank << ": " << messages_.str() << std::flush;
  }

 private:
  std::ostringstream kept_, messages_;
  std::streambuf *out_, *err_;
};

/// Seconds for which a rank that failed waits for the others to fail, too: after an interruption, rank 0
/// writes what it has meanwhile. All ranks see wrong options and missing files at about the same time.
double patienceAfter(int code) { return code == int(ErrorKind::kRuntime) ? 5.0 : 1.0; }

/// Ends the ranks together after this one has failed.
void endAfterFailure(Ranks& ranks, int code, const KeptMessages* messages) {
  if (ranks.allEnd(patienceAfter(code))) return;
  if (messages) messages->print(ranks.rank());
  ranks.abort(code);  // the other ranks would wait for this one
}

}  // namespace
}  // namespace esvr::vdb2esvr

int main(int argc, char** argv) {
  using namespace esvr;
  std::unique_ptr<Ranks> ranks;
  std::optional<vdb2esvr::KeptMessages> messages;
  const int code = cli::runMain(vdb2esvr::kProgram, [&] {
    ranks = joinRanks();
    if (ranks && ranks->rank() > 0) messages.emplace();
    const auto options = vdb2esvr::parseOptions(argc, argv);
    if (!options) return 0;
    return vdb2esvr::run(*options, ranks.get());
  });
  // Where a target was missed, all have ended.
  if (ranks && code != 0 && code != int(ErrorKind::kTargetMissed))
    vdb2esvr::endAfterFailure(*ranks, code, messages ? &*messages : nullptr);
  return code;
}
