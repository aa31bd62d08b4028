#include "core/counted.h"
#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid.h"

namespace esvr {
namespace {

/// The grids that are not carried, in order: those of numbers, and those of vectors in place of
/// their components.
class OthersInOrder {
 public:
  explicit OthersInOrder(const EsvrFile& file) : file_(file) {}

  /// Number of components and grids of numbers that were taken.
  [[nodiscard]] std::size_t taken() const { return taken_; }
  [[nodiscard]] bool done() const { return taken_ == file_.grids.size(); }

  GridOfFile take() {
    if (vector_ == file_.vectors.size() || file_.vectors[vector_].first > taken_)
      return {false, taken_++};
    requireComponents(file_.vectors[vector_]);
    taken_ += kComponents;
    return {false, vector_++, true};
  }

  /// \throws RuntimeFailure  a vector was not reached
  void finish() const {
    if (vector_ < file_.vectors.size()) requireComponents(file_.vectors[vector_]);
  }

 private:
  void requireComponents(const StoredVector& vector) const {
    const std::size_t grids = file_.grids.size();
    if (vector.first != taken_ || grids - taken_ < kComponents)
      throw RuntimeFailure("grid '" + shownName(vector.name) +
                           "' has no three components of its own from " +
                           std::to_string(vector.first) + " on among " + counted(grids, "grid"));
  }

  const EsvrFile& file_;
  std::size_t taken_ = 0, vector_ = 0;
};

}  // namespace

std::vector<GridOfFile> gridsInOrder(const EsvrFile& file) {
  OthersInOrder others(file);
  std::vector<GridOfFile> order;
  for (std::size_t c = 0; c < file.carried.size(); ++c) {
    const std::size_t place = file.carried[c].place;
    while (!others.done() && others.taken() + c < place) order.push_back(others.take());
    if (others.taken() + c != place)
      throw RuntimeFailure("grid '" + shownName(file.carried[c].name) + "' cannot have place " +
                           std::to_string(place) + " among " +
                           counted(file.grids.size() + file.carried.size(), "grid"));
    order.push_back({true, c});
  }
  while (!others.done()) order.push_back(others.take());
  others.finish();
  return order;
}

const std::string& nameOf(const EsvrFile& file, const GridOfFile& grid) {
  if (grid.isCarried) return file.carried[grid.index].name;
  if (grid.isVector) return file.vectors[grid.index].name;
  return file.grids[grid.index].descriptor.name;
}

std::vector<std::string> namesInOrder(const EsvrFile& file) {
  std::vector<std::string> names;
  for (const GridOfFile& grid : gridsInOrder(file)) names.push_back(nameOf(file, grid));
  return names;
}

std::vector<std::string> namesOfStored(const EsvrFile& file) {
  const GridNames names(namesInOrder(file));
  std::vector<std::string> stored(file.grids.size());
  std::size_t place = 0;
  for (const GridOfFile& grid : gridsInOrder(file)) {
    if (grid.isVector)
      for (std::size_t c = 0; c < kComponents; ++c)
        stored[file.vectors[grid.index].first + c] = names.ofComponent(place, c);
    else if (!grid.isCarried)
      stored[grid.index] = names.unique(place);
    ++place;
  }
  return stored;
}

std::size_t findStored(const EsvrFile& file, const std::string& wanted,
                       const std::filesystem::path& path) {
  const GridNames names(namesInOrder(file));
  const NamedGrid found = names.find(wanted, path);
  const GridOfFile grid = gridsInOrder(file)[found.place];
  const std::string where =
      (path.empty() ? "" : path.string() + ": ") + "grid \"" + names.unique(found.place) + "\" ";
  if (grid.isCarried)
    throw BadInput(where +
                   "is carried unchanged, as the bytes of its .vdb file; esvr2vdb restores it");
  if (grid.isVector && !found.component)
    throw BadInput(where + "has vectors; name a component, such as \"" +
                   names.ofComponent(found.place, 0) + '"');
  if (found.component && !grid.isVector) throw BadInput(where + "has no components");
  return grid.isVector ? file.vectors[grid.index].first + *found.component : grid.index;
}

StoredComponents componentsOf(const EsvrFile& file, const StoredVector& vector) {
  return std::span(file.grids).subspan(vector.first).first<kComponents>();
}

}  // namespace esvr
