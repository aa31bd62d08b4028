#include "format/carried_record.h"

namespace esvr::format {

void putCarried(ByteWriter& out, const CarriedGrid& grid) {
  out.putSized(grid.name);
  out.putSized(grid.treeType);
  out.put(std::uint8_t(grid.savedAsHalf));
  out.put(grid.vdbVersion);
  out.put(grid.place);
  out.put(grid.blocksAt);
}

CarriedGrid getCarried(ByteReader& in) {
  enum class SavedAsHalf { kNo, kYes };
  CarriedGrid grid;
  grid.name = in.getString();
  grid.treeType = in.getString();
  grid.savedAsHalf = in.getEnum(SavedAsHalf::kYes, "mark of half floats") == SavedAsHalf::kYes;
  grid.vdbVersion = in.get<std::uint32_t>();
  grid.place = in.get<std::uint32_t>();
  grid.blocksAt = in.get<std::uint64_t>();
  return grid;
}

}  // namespace esvr::format
