// The function of the module that loaded_library.cpp loads.

#include "esvr/progress.h"
#include "vdb/open_vdb.h"

extern "C" const esvr::vdb::Library* esvrVdbLibrary(esvr::CancelSlot slot) {
  esvr::useCancelSlot(slot);
  static const esvr::vdb::OpenVdb library;
  return &library;
}
