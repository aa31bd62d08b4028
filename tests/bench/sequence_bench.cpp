/// Measures random access to frames of an .esvr file that holds a sequence, and the memory of a
/// writer.
///
///     bench_sequence read RUNS FILE.esvr
///     bench_sequence write FRAMES FILE.esvr COPY.esvr
///
/// `read` opens the file RUNS times and reads one frame each time, from all parts of the file. It
/// prints a line of JSON with the median milliseconds and bytes. `write` writes a file of FRAMES
/// frames, all with the content of the first frame of FILE.esvr, in groups of 8, and prints the
/// largest amount of memory that the process held.

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "esvr/frame_coding.h"
#include "esvr/sequence_file.h"

namespace esvr {
namespace {

using Clock = std::chrono::steady_clock;

template <class Number>
Number median(std::vector<Number> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Access {
  double milliseconds = 0.0;
  std::uint64_t bytes = 0;
};

Access readOne(const std::string& path, std::size_t frame) {
  const auto start = Clock::now();
  SequenceReader reader(path);
  (void)reader.read(reader.frames()[frame % reader.frames().size()].number);
  return {std::chrono::duration<double, std::milli>(Clock::now() - start).count(),
          reader.bytesRead()};
}

void printReads(const std::string& path, std::size_t runs) {
  constexpr std::size_t kStride = 617;  // a prime, so that the frames are spread over the file
  std::vector<double> milliseconds;
  std::vector<std::uint64_t> bytes;
  for (std::size_t run = 0; run < runs; ++run) {
    const Access access = readOne(path, run * kStride);
    milliseconds.push_back(access.milliseconds);
    bytes.push_back(access.bytes);
  }
  const SequenceReader reader(path);
  std::cout << "{\"frames\": " << reader.frames().size()
            << ", \"file_bytes\": " << reader.fileBytes()
            << ", \"milliseconds\": " << median(milliseconds)
            << ", \"bytes_read\": " << median(bytes) << "}\n";
}

void printWriting(std::int64_t frames, const std::string& from, const std::string& to) {
  constexpr std::int64_t kGroupFrames = 8;
  SequenceReader reader(from);
  const auto frame = encodeFrame(reader.read(reader.frames().front().number), nullptr);
  SequenceWriter writer(to, {.overwrite = true, .partial = PartialSequence::kReplace});
  for (std::int64_t number = 0; number < frames; ++number) {
    if (number % kGroupFrames == 0) writer.endGroup();
    writer.append(number, frame);
  }
  const std::uint64_t bytes = writer.finish();
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  std::cout << "{\"frames\": " << frames << ", \"file_bytes\": " << bytes
            << ", \"peak_memory_kib\": " << usage.ru_maxrss << "}\n";
}

}  // namespace
}  // namespace esvr

int main(int argc, char** argv) {
  const std::string mode = argc > 1 ? argv[1] : "";
  if (mode == "read" && argc == 4)
    esvr::printReads(argv[3], std::strtoull(argv[2], nullptr, 10));
  else if (mode == "write" && argc == 5)
    esvr::printWriting(std::strtoll(argv[2], nullptr, 10), argv[3], argv[4]);
  else
    return std::cerr << "usage: bench_sequence read RUNS FILE.esvr\n"
                        "       bench_sequence write FRAMES FILE.esvr COPY.esvr\n",
           2;
  return 0;
}
