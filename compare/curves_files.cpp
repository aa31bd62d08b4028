#include "compare/curves_files.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "cli/bytes_file.h"
#include "cli/json_file.h"
#include "compare/curves_points.h"
#include "report/data_table.h"

namespace esvr::compare {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kCurvesSchema = "esvr-curves";
constexpr int kCurvesVersion = 1;

Json toJson(const report::DataTable& table) {
  Json points = Json::array();
  for (const auto& row : table.rows) {
    Json point = Json::object();
    for (std::size_t i = 0; i < row.size(); ++i) {
      const auto& key = table.columns[i].key;
      if (const auto* text = std::get_if<std::string>(&row[i])) point[key] = *text;
      if (const auto* value = std::get_if<double>(&row[i]))
        point[key] = std::isfinite(*value) ? Json(*value) : Json();
    }
    points.push_back(std::move(point));
  }
  return points;
}

class Writer {
 public:
  Writer(const std::string& prefix, bool overwrite) : prefix_(prefix), overwrite_(overwrite) {}

  void text(const std::string& ending, const std::string& bytes) const {
    cli::writeBytes(prefix_ + ending, std::as_bytes(std::span(bytes)), overwrite_);
  }
  void json(const Json& json) const { cli::writeJson({prefix_ + ".json", overwrite_}, json); }

 private:
  const std::string& prefix_;
  bool overwrite_;
};

}  // namespace

std::vector<std::filesystem::path> curveFiles(const std::string& prefix) {
  std::vector<std::filesystem::path> files;
  for (const char* ending : {".csv", ".json", ".html"}) files.emplace_back(prefix + ending);
  return files;
}

void writeCurves(const std::string& prefix, const CurvesReport& report, bool overwrite) {
  const Writer writer(prefix, overwrite);
  const TableRecord& record = report.record;
  const report::DataTable data = curvePoints(record);
  writer.text(".csv", report::toCsv(data));
  writer.json({{"schema", kCurvesSchema},
               {"schema_version", kCurvesVersion},
               {"command_line", report.commandLine},
               {"grid", record.grid},
               {"peak", record.peak},
               {"interrupted", record.interrupted},
               {"points", toJson(data)}});
  writer.text(".html", curvesPage(report));
}

}  // namespace esvr::compare
