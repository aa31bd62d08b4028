#pragma once
/// The option --bench: measures the speed, memory and quality of drawing; and the reference
/// pictures of --ref.

#include <nlohmann/json_fwd.hpp>

#include "esvr/render.h"
#include "programs/run_main.h"

namespace esvr::render {

struct Benched {
  Renderer& renderer;
  Renderer* reference;   ///< null if there is no --ref
  int referenceSamples;  ///< rays along the side of a pixel in the pictures that are compared with
};

/// Draws the pictures of a full turn, after a few that warm up and do not count. If there is a
/// reference, it is measured in the same way, and up to 36 pictures are compared with it.
/// \param views  number of pictures; 0 stands for 720
/// \throws       as for Renderer::draw
[[nodiscard]] nlohmann::ordered_json bench(const Benched& benched, const RenderOptions& options,
                                           int views, const cli::Log& log);

/// Draws a reference picture, without levels of detail if a pixel has several rays.
/// \param samples  rays along the side of a pixel
[[nodiscard]] Image drawSupersampled(Renderer& renderer, RenderOptions options, int samples);

/// A number for a JSON file. Infinity becomes null, because JSON cannot express it.
[[nodiscard]] nlohmann::ordered_json jsonNumber(double value);

}  // namespace esvr::render
