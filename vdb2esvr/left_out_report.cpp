#include "vdb2esvr/left_out_report.h"

namespace esvr::vdb2esvr {

nlohmann::ordered_json leftOutJson(const std::vector<LeftOut>& notes) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& note : notes) {
    nlohmann::ordered_json entry{{"part", note.part}, {"why", note.why}, {"used", note.used}};
    if (note.bytesSaved > 0) entry["raw_bytes_saved"] = note.bytesSaved;
    if (note.bytesWith) entry["bytes_with"] = *note.bytesWith;
    if (note.bytesWithout) entry["bytes_without"] = *note.bytesWithout;
    if (note.seconds) entry["seconds"] = *note.seconds;
    list.push_back(entry);
  }
  return list;
}

}  // namespace esvr::vdb2esvr
