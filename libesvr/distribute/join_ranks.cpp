#include <dlfcn.h>

#include <cstdlib>
#include <string>

#include "core/parse_text.h"
#include "esvr/error.h"
#include "esvr/ranks.h"

namespace esvr {
namespace {

/// The module with MPI, which only processes that MPI has started load. Other processes thus need no
/// MPI.
constexpr const char* kModule = "esvr_mpi.so";
constexpr const char* kFunction = "esvrJoinMpi";

/// The number of processes that were started together, by the variables of Open MPI, of MPICH and of
/// Slurm's plugins for them.
std::int64_t processes() {
  if (std::getenv("PMIX_RANK") == nullptr && std::getenv("PMI_RANK") == nullptr) return 1;
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"})
    if (const char* text = std::getenv(name)) return parseWhole(text).value_or(1);
  return 1;
}

}  // namespace

std::unique_ptr<Ranks> joinRanks() {
  const std::int64_t count = processes();
  if (count <= 1) return nullptr;
  const std::string problem = "this process is one of " + std::to_string(count) +
                              " that were started together, but MPI cannot be used: ";
  void* const module = ::dlopen(kModule, RTLD_NOW | RTLD_LOCAL);  // stays loaded
  if (!module) throw RuntimeFailure(problem + ::dlerror());
  const auto join = reinterpret_cast<Ranks* (*)()>(::dlsym(module, kFunction));
  if (!join) throw RuntimeFailure(problem + kModule + " is not a part of this program");
  return std::unique_ptr<Ranks>(join());
}

}  // namespace esvr
