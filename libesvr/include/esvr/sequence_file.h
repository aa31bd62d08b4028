#pragma once
/// Writes and reads .esvr files that hold a sequence. docs/format.md specifies every byte.
///
/// The frames of a sequence are in groups. The first frame of a group refers to no other frame;
/// every other one may refer to the frame before it. A reader therefore needs at most the frames of
/// one group to decode a frame, and damaged bytes lose no frame outside their group.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr {

/// A frame of a sequence in a file.
struct SequenceFrame {
  std::int64_t number = 0;              ///< number that the user gave it; may be negative
  std::size_t group = 0;                ///< index of its group, counted from 0
  std::uint64_t offset = 0, bytes = 0;  ///< where its bytes are in the file, and how many
  bool dependsOnPrevious = false;       ///< it refers to the frame before it
  friend bool operator==(const SequenceFrame&, const SequenceFrame&) = default;
};

/// What happens to the partial file of a writer that did not finish.
enum class PartialSequence {
  kRefuse,   ///< it is an error
  kReplace,  ///< it is discarded
  kResume    ///< its complete groups are kept; it need not exist
};

struct SequenceWriteOptions {
  bool overwrite = false;  ///< replace a file that exists
  PartialSequence partial = PartialSequence::kRefuse;
  std::uint64_t origin =
      0;  ///< a hash of what decides the frames; a partial file of another one is not continued
};

/// Writes a sequence to PATH.partial, group by group, and renames the file when it is complete.
/// Each complete group is on the disk before the next one begins, so that a process that is killed
/// loses at most one group. The writer holds the bytes of one group in memory, and about 80 bytes
/// for each frame of the file.
class SequenceWriter {
 public:
  /// Creates the partial file, or continues it after its last complete group.
  /// \throws RuntimeFailure  the file exists (without overwrite), or the partial file (kRefuse); it
  ///                         is not writable; another process writes it
  /// \throws UsageError  the partial file to resume has another origin
  /// \throws BadInput  the partial file to resume is not that of a sequence of this version
  SequenceWriter(const std::filesystem::path& path, const SequenceWriteOptions& options = {});
  /// Leaves the partial file, unless it has no group.
  ~SequenceWriter();
  SequenceWriter(const SequenceWriter&) = delete;
  SequenceWriter& operator=(const SequenceWriter&) = delete;

  /// PATH.partial
  [[nodiscard]] static std::filesystem::path partialPath(const std::filesystem::path& path);

  /// The frames of all complete groups, by increasing numbers.
  [[nodiscard]] const std::vector<SequenceFrame>& frames() const;
  [[nodiscard]] std::size_t groupCount() const;

  /// Removes all groups from the index `group` on. The group that is being written must be empty.
  /// \throws RuntimeFailure  the file is not writable
  void dropGroups(std::size_t group);

  /// Appends a frame to the group.
  /// \param frame  its bytes, from encodeFrame
  /// \throws UsageError  the number is not above that of the frame before it; the first frame of
  ///                     the group refers to another one
  /// \throws BadInput  as for dependsOnPrevious
  void append(std::int64_t number, std::vector<std::byte> frame);

  /// Writes the group to the disk. A group without frames is not written.
  /// \throws RuntimeFailure  the disk is full, or the file is not writable
  void endGroup();

  /// Ends the group, writes the index and renames the file. No frame can be appended afterwards.
  /// \return the number of bytes of the file
  /// \throws RuntimeFailure  there is no frame; as for endGroup
  std::uint64_t finish();

 private:
  class File;
  std::unique_ptr<File> file_;
};

/// True if an .esvr file holds a sequence. Its header and section table are read.
/// \throws BadInput  as for inspectEsvr
[[nodiscard]] bool holdsSequence(const std::filesystem::path& path);

/// Reads frames of a sequence in any order. Only one thread may use a reader at a time.
class SequenceReader {
 public:
  /// Reads the index.
  /// \param limits  of the memory of a decoded frame and, if it refers to it, of the one before it
  /// \throws BadInput  the file is missing, holds no sequence, or its index is damaged
  explicit SequenceReader(const std::filesystem::path& path, const ReadLimits& limits = {});
  ~SequenceReader();
  SequenceReader(const SequenceReader&) = delete;
  SequenceReader& operator=(const SequenceReader&) = delete;

  /// The frames by increasing numbers.
  [[nodiscard]] const std::vector<SequenceFrame>& frames() const;
  [[nodiscard]] std::size_t groupCount() const;
  [[nodiscard]] std::uint64_t fileBytes() const;

  /// Reads a frame and, if it refers to others, those before it in its group. The frame that was
  /// read last is kept, so that reading forward decodes each frame once.
  /// \return the frame, which the next call replaces
  /// \throws BadInput  there is no such frame; it is damaged, or one to which it refers is
  /// \throws MemoryExceeded  as for readEsvr
  const EsvrFile& read(std::int64_t number);

  /// The sections of a frame. Its bytes are read, but not those of other frames.
  /// \throws BadInput  there is no such frame, or it is damaged
  [[nodiscard]] EsvrSummary inspect(std::int64_t number);

  /// The first frame with the properties and the metadata of its grids, but without their data, as
  /// readEsvrPart reads it with an empty ReadPart::grids. Nothing is decoded.
  /// \throws BadInput  the frame is damaged
  [[nodiscard]] EsvrFile propertiesOfFirst() const;

  /// Bytes that were read from the file so far.
  [[nodiscard]] std::uint64_t bytesRead() const;

 private:
  class File;
  std::unique_ptr<File> file_;
};

/// What is wrong with a sequence.
struct SequenceFault {
  std::optional<std::int64_t> frame;  ///< nothing: no frame is lost by it
  std::string text;                   ///< with the name of the file and of the frame
};

/// Reads the whole file, decodes every frame and verifies every byte.
/// \return the faults in the order of the file; empty if it is valid. A frame that refers to a
///         damaged one has a fault, too
/// \throws BadInput  the file holds no sequence, or its index is damaged
/// \throws MemoryExceeded  as for readEsvr
[[nodiscard]] std::vector<SequenceFault> checkSequence(const std::filesystem::path& path,
                                                       const ReadLimits& limits = {});

}  // namespace esvr
