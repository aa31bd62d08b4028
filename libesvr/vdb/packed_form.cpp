#include "esvr/voxel_packer.h"

namespace esvr {

bool isNanoVdb(PackedForm form) {
  return form != PackedForm::kOpenVdbFloat && form != PackedForm::kOpenVdbHalf;
}

NanoValues nanoValues(PackedForm form) {
  switch (form) {
    case PackedForm::kNanoFp16:
      return NanoValues::kFp16;
    case PackedForm::kNanoFp8:
      return NanoValues::kFp8;
    case PackedForm::kNanoFp4:
      return NanoValues::kFp4;
    case PackedForm::kNanoFpN:
      return NanoValues::kFpN;
    default:
      return NanoValues::kFloat;
  }
}

}  // namespace esvr
