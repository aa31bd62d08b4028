#include <dlfcn.h>

#include "esvr/error.h"
#include "esvr/progress.h"
#include "vdb/library.h"

namespace esvr::vdb {
namespace {

const Library& load() {
  void* const module = ::dlopen(kModule, RTLD_NOW | RTLD_LOCAL);  // stays loaded
  if (!module)
    throw RuntimeFailure(std::string("OpenVDB is needed but cannot be loaded: ") + ::dlerror());
  const auto get =
      reinterpret_cast<const Library* (*)(CancelSlot)>(::dlsym(module, kModuleFunction));
  if (!get) throw RuntimeFailure(std::string(kModule) + " is not a part of this program");
  return *get(cancelSlot());
}

}  // namespace

const Library& library() {
  static const Library& loaded = load();
  return loaded;
}

}  // namespace esvr::vdb
