#pragma once
/// The processes that `mpirun -n N` or `srun -n N` has started together.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace esvr {

/// The processes are called ranks. All ranks call agree(), handOut() and exchange() in the same
/// order. The destructor waits for all ranks, unless allEnd() has done so.
class Ranks {
 public:
  using Bytes = std::vector<std::byte>;

  virtual ~Ranks() = default;

  [[nodiscard]] virtual int rank() const = 0;   ///< number of this rank, from 0
  [[nodiscard]] virtual int count() const = 0;  ///< number of ranks
  [[nodiscard]] virtual int rankOnHost()
      const = 0;  ///< number among the ranks of this host, from 0

  /// \return whether a number is the same on all ranks
  [[nodiscard]] virtual bool agree(std::uint64_t number) = 0;

  /// Begins to hand out the numbers from 0 to count - 1 to the ranks that ask for them.
  virtual void handOut(std::size_t count) = 0;
  /// A number that no other rank gets; nothing if none is left. Any thread may call it, and every
  /// rank calls it until none is left.
  [[nodiscard]] virtual std::optional<std::size_t> next() = 0;

  /// Gives all ranks the results of all numbers. \param own  results of the numbers of this rank
  [[nodiscard]] virtual std::vector<Bytes> exchange(std::vector<std::optional<Bytes>> own) = 0;

  /// Tells the other ranks that this one ends after a failure, and waits until all have told so. A rank
  /// that failed alone must then abort the others, which would wait for it.
  /// \return false if some have not told it within this time
  [[nodiscard]] virtual bool allEnd(double seconds) = 0;

  /// Ends all ranks now.
  [[noreturn]] virtual void abort(int exitCode) = 0;
};

/// Joins the ranks that this process was started with.
/// \return null if it was not started as one of several
/// \throws RuntimeFailure  it was, but this build has no MPI, or MPI cannot be used
[[nodiscard]] std::unique_ptr<Ranks> joinRanks();

}  // namespace esvr
