#include "compare/table_record.h"

#include <algorithm>
#include <cmath>

#include "programs/run_main.h"

namespace esvr::compare {

// Rivals.

namespace {

double bytesOf(const TableRow& row) { return double(*row.bytes); }
double psnrOf(const TableRow& row) { return row.metrics->psnrBox; }
bool isOurs(const TableRow& row) { return row.group == kOurGroup; }
bool isExact(const TableRow& row) { return std::isinf(psnrOf(row)); }

bool isRivalOf(const TableRow& ours, const TableRow& row) {
  if (isOurs(row) || !row.bytes || !row.metrics) return false;
  return isExact(ours) ? isExact(row) : bytesOf(row) <= (1.0 + kSameSize) * bytesOf(ours);
}

bool isBetter(const TableRow& row, const TableRow& than) {
  if (psnrOf(row) != psnrOf(than)) return psnrOf(row) > psnrOf(than);
  return *row.bytes < *than.bytes;
}

const TableRow* bestRival(const TableRow& ours, const std::vector<TableRow>& rows) {
  const TableRow* best = nullptr;
  for (const auto& row : rows)
    if (isRivalOf(ours, row) && (!best || isBetter(row, *best))) best = &row;
  return best;
}

}  // namespace

double leadOf(const Duel& duel) { return psnrOf(*duel.ours) - psnrOf(*duel.rival); }

std::vector<Duel> duelsOf(const TableRecord& record) {
  std::vector<Duel> duels;
  for (const auto& row : record.rows)
    if (isOurs(row) && row.bytes && row.metrics)
      duels.push_back({&row, bestRival(row, record.rows)});
  std::stable_sort(duels.begin(), duels.end(),
                   [](const Duel& a, const Duel& b) { return *a.ours->bytes < *b.ours->bytes; });
  return duels;
}

// Sentences.

namespace {

using report::bytesText;

constexpr double kVisible = 0.05;  // dB; smaller differences are 0.0 in a sentence

std::string oneDecimal(double value) { return cli::formatted("%.1f", value); }
std::string decibels(double value) { return oneDecimal(value) + " dB"; }

std::string bestRivalName(const Duel& duel) { return "the best rival, " + duel.rival->name; }

std::string leadText(const Duel& duel) {
  if (!duel.rival) return "; no other row is that small.";
  if (isExact(*duel.rival)) return "; " + bestRivalName(duel) + ", has no error.";
  const double lead = leadOf(duel);
  if (std::abs(lead) < kVisible) return ", as much as " + bestRivalName(duel) + ".";
  return ", " + decibels(std::abs(lead)) + (lead > 0 ? " more than " : " less than ") +
         bestRivalName(duel) + ".";
}

std::string sentenceOf(const Duel& duel) {
  return "At " + bytesText(bytesOf(*duel.ours)) + ", ESVR has a PSNR of " +
         decibels(psnrOf(*duel.ours)) + leadText(duel);
}

std::string exactSentence(const Duel& duel) {
  const std::string text =
      "ESVR stores the volume without an error in " + bytesText(bytesOf(*duel.ours));
  if (!duel.rival) return text + ".";
  const std::string size = bytesText(bytesOf(*duel.rival));
  if (*duel.rival->bytes == *duel.ours->bytes)
    return text + ", as does " + bestRivalName(duel) + ".";
  return text + ", " + bestRivalName(duel) + ", in " + size + ".";
}

/// The smallest and the largest lead, or nothing if a rival has no error.
std::string rangeOf(const std::vector<Duel>& duels, bool signs) {
  const auto less = [](const Duel& a, const Duel& b) { return leadOf(a) < leadOf(b); };
  const auto [least, most] = std::minmax_element(duels.begin(), duels.end(), less);
  if (!std::isfinite(leadOf(*least))) return "";
  if (!signs) return ", by " + oneDecimal(leadOf(*least)) + " to " + decibels(leadOf(*most));
  return "; the difference is between " + decibels(leadOf(*least)) + " and " +
         decibels(leadOf(*most));
}

/// \param duels  at least two, which have rivals, by size
std::string sentenceOf(const std::vector<Duel>& duels) {
  const auto wins = std::size_t(std::count_if(
      duels.begin(), duels.end(), [](const Duel& duel) { return leadOf(duel) >= kVisible; }));
  const bool all = wins == duels.size();
  const std::string count = wins == 0 ? "none" : std::to_string(wins);
  return "ESVR has a higher PSNR than the best rival for " + (all ? "all" : count + " of") + " " +
         cli::counted(duels.size(), "file") + ", from " + bytesText(bytesOf(*duels.front().ours)) +
         " to " + bytesText(bytesOf(*duels.back().ours)) + rangeOf(duels, !all) + ".";
}

/// Files without a rival are smaller than those that have one.
std::string sentenceOfUncontested(std::size_t files) {
  if (files == 0) return "";
  return " No other row is as small as its " +
         (files == 1 ? "smallest file." : std::to_string(files) + " smallest files.");
}

}  // namespace

std::string findingOf(const TableRecord& record) {
  std::vector<Duel> lossy, contested, exact;
  for (const auto& duel : duelsOf(record)) {
    (isExact(*duel.ours) ? exact : lossy).push_back(duel);
    if (!isExact(*duel.ours) && duel.rival) contested.push_back(duel);
  }
  std::string text;
  if (contested.size() > 1)
    text = sentenceOf(contested);
  else if (!lossy.empty())
    text = sentenceOf(contested.empty() ? lossy.back() : contested.front());
  if (!contested.empty()) text += sentenceOfUncontested(lossy.size() - contested.size());
  if (exact.empty()) return text;
  return text + (text.empty() ? "" : " ") + exactSentence(exact.front());
}

// The order of a page.

PageOrder::PageOrder(const TableRecord& record) : record_(record), duels_(duelsOf(record)) {
  for (const auto& duel : duels_) addSize(*duel.ours);
  for (const auto& row : record.rows)
    addUnplaced(row, {row.group, {}, row.matchedBytes.has_value()});
}

report::Emphasis PageOrder::emphasisOf(const TableRow& row) const {
  if (row.group == kOurGroup) return report::Emphasis::kOurs;
  const auto isRival = [&](const Duel& duel) { return duel.rival == &row; };
  return std::any_of(duels_.begin(), duels_.end(), isRival) ? report::Emphasis::kRival
                                                            : report::Emphasis::kNone;
}

/// Adds a row of ESVR, the rows of its size and those of its PSNR.
void PageOrder::addSize(const TableRow& ours) {
  const std::string size = "at most " + std::to_string(*ours.bytes) + " bytes (" +
                           report::bytesText(double(*ours.bytes)) + ")";
  addUnplaced(ours, {size, {}, true});
  for (const auto& row : record_.rows)
    if (row.matchedBytes == ours.bytes) addUnplaced(row, {size, {}, true});
  for (const auto& row : record_.rows)
    if (row.matchedPsnr == ours.metrics->psnrBox) addUnplaced(row, {row.group, {}, false});
}

/// Adds a row to the group of this heading if no group has the row yet.
void PageOrder::addUnplaced(const TableRow& row, RowGroup group) {
  const auto hasRow = [&](const RowGroup& other) {
    return std::count(other.rows.begin(), other.rows.end(), &row) != 0;
  };
  if (std::any_of(groups_.begin(), groups_.end(), hasRow)) return;
  const auto isIt = [&](const RowGroup& other) { return other.heading == group.heading; };
  auto place = std::find_if(groups_.begin(), groups_.end(), isIt);
  if (place == groups_.end()) place = groups_.insert(place, std::move(group));
  place->rows.push_back(&row);
}

}  // namespace esvr::compare
