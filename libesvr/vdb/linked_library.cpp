#include "vdb/open_vdb.h"

namespace esvr::vdb {

const Library& library() {
  static const OpenVdb linked;
  return linked;
}

}  // namespace esvr::vdb
