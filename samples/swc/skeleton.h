#pragma once
/// Neuron skeletons in SWC: one node a line, "id type x y z radius parent", '#' begins a comment.
/// (Cannon et al. 1998; http://www.neuronland.org/NLMorphologyConverter/MorphologyFormats/SWC)

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

/// \throws BadInput  missing or not readable; no node; a line that is not a node, with its number;
///                   an id twice, a parent that is not there, a node that is its own parent
[[nodiscard]] Skeleton readSwc(const std::filesystem::path& path);

/// \param name  of the source, for messages
[[nodiscard]] Skeleton parseSwc(std::istream& text, const std::string& name);

/// A round cone from every node to its parent, a ball for a node without links, in the file's
/// units.
[[nodiscard]] std::vector<Tube> tubesOf(const Skeleton& skeleton);

/// The `count` connected pieces of a skeleton with the longest cable: fragments are left out.
[[nodiscard]] Skeleton longestPieces(const Skeleton& skeleton, std::size_t count);

}  // namespace esvr::samples
