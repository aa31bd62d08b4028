#pragma once
/// The options and the jobs of esvr2vdb. Each job throws an esvr::Error if it fails.

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"
#include "esvr/device.h"
#include "esvr/grid_coding.h"
#include "esvr/splats.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"
#include "programs/option_values.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "programs/sequence.h"
#include "programs/splat_input.h"

namespace esvr::esvr2vdb {

inline constexpr const char* kProgram = "esvr2vdb";

enum class Job { kConvert, kList, kCheck };

/// What options say about splats that are written or read. The colors are over the values 0 to 1.
struct SplatWish {
  SplatOptions made;
  cli::SplatInput read;
};

/// The size of the voxels that are written.
struct Resolution {
  double factor = 1.0;  ///< edge of a voxel relative to that of the source's
  std::optional<double>
      voxelSize{};      ///< their shortest edge in units of the world, instead of `factor`
  bool isAuto = false;  ///< the grids fit into the memory
};

struct Options {
  Job job = Job::kConvert;
  std::filesystem::path input, output;
  cli::InputFiles inputs;
  /// The frames, if the input and the output are patterns. The reference is a pattern, too.
  std::optional<cli::Sequence> sequence;
  std::vector<std::string> grids;  ///< names of the grids; empty: all
  DecodeOptions decode;
  ReadPart part;  ///< the part of the file that is read
  Resolution resolution;
  std::optional<std::size_t> maxEllipsoids;  ///< keep those of each grid with the largest weight
  WriteOptions write;
  SplatWish splats;
  std::optional<std::filesystem::path> reference;
  std::optional<Box> box;  ///< box of the PSNR against the reference
  cli::HostMemory memory;  ///< memory that input may take
  int threads = 0;         ///< number of threads; 0: all
  cli::Verbosity verbosity = cli::Verbosity::kNormal;
};

/// True if the whole file is wanted.
[[nodiscard]] bool readsAll(const Options& options);

/// True if the output is a file of splats.
[[nodiscard]] bool writesSplats(const Options& options);

// The resolution of the written grids (--coarsen, --voxel-size).

/// True if grids may be written with other voxels than those of the source.
[[nodiscard]] bool changesResolution(const Options& options);

/// What `auto` becomes for these grids: the least factor of 1, 2, 4 and 8 with which all of them fit into the memory. Says
/// so if it is above 1. Another wish is returned as it is.
/// \param grids   components of vectors are grids of their own
/// \throws MemoryExceeded  the coarsest grids do not fit either
[[nodiscard]] Resolution resolved(const Resolution& wish, std::span<const StoredGrid* const> grids,
                                  const DecodeOptions& decode, const cli::Log& log);

/// The factor of the voxels of a grid. `auto` must be resolved.
/// \throws UsageError  as for factorFor and transformAt; the text names the grid
[[nodiscard]] double factorOf(const Resolution& wish, const GridDescriptor& grid);

/// For --coarsen. \throws UsageError  the text is no factor
[[nodiscard]] Resolution resolutionOf(const std::optional<std::string>& coarsen,
                                      const std::optional<double>& voxelSize);

// Jobs.

/// Writes the VDB. If there is a reference, prints the errors of the written grids.
void convert(const Options& options);

/// The same for one file whose paths were checked. \param out  gets the errors
/// \throws Cancelled  nothing was written
void convertFile(const Options& options, const CancelToken& cancel, const cli::Log& log,
                 std::ostream& out);

/// The content of a file, or a part of it.
struct Content {
  const EsvrFile& file;
  std::vector<std::uint64_t> ellipsoidsInFile{};  ///< as in PartOfFile; empty if all is there
};

/// The same for the content of a file, which may be a frame of a sequence.
/// \throws Cancelled  nothing was written
void convertContent(const Options& options, const Content& content, const CancelToken& cancel,
                    const cli::Log& log, std::ostream& out);

/// The limits with which the input is read.
[[nodiscard]] ReadLimits limitsOf(const Options& options);

/// Writes a grid of a file as splats.
/// \throws BadInput  there is no such grid, or its ellipsoids cannot become splats (makeSplats)
/// \throws UsageError  several grids are named
void exportSplats(const Options& options, const EsvrFile& file, const cli::Log& log);

/// Writes a VDB with the density and the colors of the splats in the input.
void importSplats(const Options& options);

/// Writes a VDB for each frame of the sequence, on several threads.
/// \throws Error  the kind of the first frame that failed; RuntimeFailure if the run was
///                interrupted. Frames may have been written
void convertSequence(const Options& options);

/// Prints the grids of a file and, for an .esvr file, its sections, or a row for each frame of a file or
/// a pattern of files. It evaluates no voxel.
/// \throws Error  the failure of the first frame that cannot be read, after the others were listed
void list(const Options& options);

/// Reads the whole file, or those of all frames of a pattern, and prints OK.
/// \throws BadInput  the file is damaged (the text says where, and names each frame that is lost)
void check(const Options& options);

/// A grid of a file and the name that --grid takes (GridNames::unique).
struct ListedGrid {
  GridOfFile grid;
  std::string name;
  std::size_t place = 0;  ///< number of grids before it in the file
};

/// All grids in file order.
[[nodiscard]] std::vector<ListedGrid> listedGrids(const EsvrFile& file);

/// A grid that is not carried, or the components of vectors.
[[nodiscard]] std::span<const StoredGrid> storedParts(const EsvrFile& file, const GridOfFile& grid);

}  // namespace esvr::esvr2vdb
