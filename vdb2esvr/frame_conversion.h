#pragma once
/// What runs over sequences have in common, whether they write a file for each frame or one for
/// all.

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "cli/frame_warnings.h"
#include "cli/log.h"
#include "cli/memory_gate.h"
#include "cli/sequence.h"
#include "cli/stopwatch.h"
#include "esvr/device.h"
#include "esvr/progress.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/progress_bar.h"
#include "vdb2esvr/run.h"
#include "vdb2esvr/sequence_record.h"

namespace esvr::vdb2esvr {

/// Converts frames, and records and tells what became of each. Several threads may convert frames
/// at the same time.
class FrameConversion {
 public:
  FrameConversion(const Options& options, const std::vector<cli::Frame>& frames,
                  const CancelToken& cancel);

  /// The number of workers for tasks that each convert one or several frames.
  [[nodiscard]] int workers(std::size_t tasks) const;

  /// Runs an action that gives a frame its output, records whether it failed, and tells that the
  /// frame has ended.
  void attempt(FrameRecord& frame, const std::function<void()>& action);

  /// The options with which a frame is converted. The bar of a fit is not shown.
  [[nodiscard]] Options optionsOf(const cli::Frame& frame, int worker) const;

  /// Converts a frame as soon as there is memory for it, on the host and on its GPU. If its GPU fails,
  /// another one of several converts it.
  /// \param own  options of the frame
  void convert(const Options& own, FrameRecord& frame, const StoreFile& store);

  [[nodiscard]] std::vector<FrameRecord>& frames() { return record_.frames; }

  /// Ends the run and tells the warnings.
  [[nodiscard]] SequenceRecord finish();

 private:
  void convertOnDevice(const Options& own, FrameRecord& frame, const StoreFile& store);
  [[nodiscard]] Device deviceFor(std::size_t worker) const;
  bool replaceDevice(const DeviceError& error, Options& own);
  void fail(FrameRecord& frame, const Error& error);
  void tellEnd(const FrameRecord& frame);
  [[nodiscard]] double secondsSoFar();

  const Options& options_;
  const CancelToken& cancel_;
  const std::vector<Device> devices_;
  cli::MemoryGate gate_;
  std::map<int, cli::MemoryGate> deviceGates_;  ///< by Device::index
  cli::FrameWarnings warnings_;
  SequenceRecord record_;
  mutable std::mutex mutex_;     ///< of the members below
  std::vector<Device> working_;  ///< the devices that have not failed
  ProgressBar bar_;
  const cli::Log log_;
  SequenceProgress progress_;
  cli::Stopwatch watch_;
  double seconds_ = 0.0;
};

}  // namespace esvr::vdb2esvr
