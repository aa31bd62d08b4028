// The function of the module that loaded_library.cpp loads.

#include "vdb/open_vdb.h"

extern "C" const esvr::vdb::Library* esvrVdbLibrary() {
  static const esvr::vdb::OpenVdb library;
  return &library;
}
