#pragma once
/// Neuron skeletons in SWC: a line "id type x y z radius parent" for each node; '#' begins a
/// comment (Cannon et al. 1998;
/// http://www.neuronland.org/NLMorphologyConverter/MorphologyFormats/SWC)

#include <cstdint>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>
#include <vector>

#include "generators/tubes.h"
#include "generators/vec3.h"

namespace esvr::samples {

struct SkeletonNode {
  Vec3 position;                      ///< the file's units
  double radius = 0.0;                ///< the file's units; may be 0
  std::optional<std::size_t> parent;  ///< index into the nodes; nothing for a root
};

using Skeleton = std::vector<SkeletonNode>;

/// Reads a skeleton.
/// \param name  name of the source for messages
/// \throws BadInput  there is no node; a line is not a node (the text gives its number); an id is
///                   defined twice; a parent does not exist or is the node itself
[[nodiscard]] Skeleton parseSwc(std::istream& text, const std::string& name);

/// Makes a round cone from every node to its parent, and a ball for each node without links, in the
/// file's units.
[[nodiscard]] std::vector<Tube> tubesOf(const Skeleton& skeleton);

/// Keeps the `count` connected pieces of a skeleton that have the longest cable.
[[nodiscard]] Skeleton longestPieces(const Skeleton& skeleton, std::size_t count);

}  // namespace esvr::samples
