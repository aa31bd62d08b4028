#include "esvr/container.h"
#include "esvr/error.h"

namespace esvr {

std::vector<GridOfFile> gridsInOrder(const EsvrFile& file) {
  const std::size_t total = file.grids.size() + file.carried.size();
  std::vector<GridOfFile> order;
  std::size_t converted = 0;
  for (std::size_t c = 0; c < file.carried.size(); ++c) {
    const std::size_t place = file.carried[c].place;
    if (place < order.size() || place - c > file.grids.size())
      throw RuntimeFailure("grid '" + file.carried[c].name + "' cannot have place " +
                           std::to_string(place) + " among " + std::to_string(total) + " grids");
    while (order.size() < place) order.push_back({false, converted++});
    order.push_back({true, c});
  }
  while (order.size() < total) order.push_back({false, converted++});
  return order;
}

std::vector<std::string> namesInOrder(const EsvrFile& file) {
  std::vector<std::string> names;
  for (const auto& [isCarried, index] : gridsInOrder(file))
    names.push_back(isCarried ? file.carried[index].name : file.grids[index].descriptor.name);
  return names;
}

}  // namespace esvr
