#include "report/chart.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace esvr::report {
namespace {

using Json = nlohmann::ordered_json;

/// The names of units in charts.js.
const char* nameOf(Unit unit) {
  switch (unit) {
    case Unit::kBytes:
      return "bytes";
    case Unit::kSeconds:
      return "seconds";
    case Unit::kPercent:
      return "percent";
    case Unit::kNone:
      break;
  }
  return "none";
}

bool holds(const ChartAxis& axis, double value) {
  return std::isfinite(value) && (!axis.logarithmic || value > 0.0);
}

Json toJson(const ChartAxis& axis) {
  return {{"label", axis.label}, {"unit", nameOf(axis.unit)}, {"logarithmic", axis.logarithmic}};
}

Json toJson(const Series& series, const Chart& chart) {
  Json points = Json::array();
  for (const Point& point : series.points)
    if (holds(chart.x, point.x) && holds(chart.y, point.y))
      points.push_back(Json::array({point.x, point.y, point.note}));
  return {{"name", series.name},
          {"ours", series.emphasis == Emphasis::kOurs},
          {"joined", series.joined},
          {"points", std::move(points)}};
}

/// The text of JSON within an element `script`, which no name can end.
std::string scriptText(const Json& json) {
  std::string text;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace))
    text += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return text;
}

}  // namespace

Html toHtml(const Chart& chart) {
  Json json{{"x", toJson(chart.x)}, {"y", toJson(chart.y)}, {"series", Json::array()}};
  json["y"]["decibels"] = chart.decibels;
  for (const Series& series : chart.series) json["series"].push_back(toJson(series, chart));
  const std::string said = chart.title + ": " + chart.y.label + " over " + chart.x.label;
  Html content = element("figcaption", {}, element("h3", chart.title));
  content += element("div", {{"class", "drawing"}, {"role", "img"}, {"aria-label", said}}, Html{});
  content += Html{"<script type=\"application/json\">" + scriptText(json) + "</script>\n"};
  return element("figure", {{"class", "chart"}}, content);
}

}  // namespace esvr::report
