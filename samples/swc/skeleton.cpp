#include "swc/skeleton.h"

#include <algorithm>
#include <numeric>

namespace esvr::samples {
namespace {

/// Disjoint sets of nodes.
class Pieces {
 public:
  explicit Pieces(std::size_t nodes) : above_(nodes) {
    std::iota(above_.begin(), above_.end(), std::size_t{0});
  }
  std::size_t of(std::size_t node) {
    while (above_[node] != node) node = above_[node] = above_[above_[node]];
    return node;
  }
  void join(std::size_t a, std::size_t b) { above_[of(a)] = of(b); }

 private:
  std::vector<std::size_t> above_;
};

double cableTo(const Skeleton& skeleton, const SkeletonNode& node) {
  return node.parent ? length(node.position - skeleton[*node.parent].position) : 0.0;
}

/// Length of cable of every piece, at the index of the piece's representative node.
std::vector<double> cableOf(const Skeleton& skeleton, Pieces& pieces) {
  std::vector<double> cable(skeleton.size(), 0.0);
  for (std::size_t i = 0; i < skeleton.size(); ++i)
    cable[pieces.of(i)] += cableTo(skeleton, skeleton[i]);
  return cable;
}

/// The kept nodes with the new indices of their parents.
Skeleton selected(const Skeleton& skeleton, const std::vector<bool>& keep) {
  std::vector<std::size_t> place(skeleton.size(), 0);
  for (std::size_t i = 1; i < skeleton.size(); ++i) place[i] = place[i - 1] + (keep[i - 1] ? 1 : 0);
  Skeleton kept;
  for (std::size_t i = 0; i < skeleton.size(); ++i) {
    if (!keep[i]) continue;
    kept.push_back(skeleton[i]);
    if (kept.back().parent) kept.back().parent = place[*kept.back().parent];
  }
  return kept;
}

std::vector<bool> hasLinks(const Skeleton& skeleton) {
  std::vector<bool> linked(skeleton.size(), false);
  for (std::size_t i = 0; i < skeleton.size(); ++i)
    if (skeleton[i].parent) linked[i] = linked[*skeleton[i].parent] = true;
  return linked;
}

}  // namespace

std::vector<Tube> tubesOf(const Skeleton& skeleton) {
  const auto linked = hasLinks(skeleton);
  std::vector<Tube> tubes;
  tubes.reserve(skeleton.size());
  for (std::size_t i = 0; i < skeleton.size(); ++i) {
    const SkeletonNode& node = skeleton[i];
    const SkeletonNode& end = node.parent ? skeleton[*node.parent] : node;
    if (node.parent || !linked[i])
      tubes.push_back({node.position, end.position, node.radius, end.radius});
  }
  return tubes;
}

Skeleton longestPieces(const Skeleton& skeleton, std::size_t count) {
  Pieces pieces(skeleton.size());
  for (std::size_t i = 0; i < skeleton.size(); ++i)
    if (skeleton[i].parent) pieces.join(i, *skeleton[i].parent);
  const auto cable = cableOf(skeleton, pieces);

  std::vector<std::size_t> heads;
  for (std::size_t i = 0; i < skeleton.size(); ++i)
    if (pieces.of(i) == i) heads.push_back(i);
  std::stable_sort(heads.begin(), heads.end(),
                   [&](std::size_t a, std::size_t b) { return cable[a] > cable[b]; });
  heads.resize(std::min(count, heads.size()));

  std::vector<bool> keptHead(skeleton.size(), false), keep(skeleton.size());
  for (const std::size_t head : heads) keptHead[head] = true;
  for (std::size_t i = 0; i < skeleton.size(); ++i) keep[i] = keptHead[pieces.of(i)];
  return selected(skeleton, keep);
}

}  // namespace esvr::samples
