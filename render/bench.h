#pragma once
/// --bench: how fast a scene is drawn, and how well.

#include <nlohmann/json_fwd.hpp>

#include "cli/log.h"
#include "esvr/renderer.h"

namespace esvr::render {

struct Benched {
  Renderer& renderer;
  Renderer* reference;  ///< null: none
};

/// Draws `views` pictures of a full turn, 720 for 0, some beforehand that do not count; then, where
/// there is a reference, the same of it, and compares some of the pictures.
/// \throws  as Renderer::draw
[[nodiscard]] nlohmann::ordered_json bench(const Benched& benched, const RenderOptions& options,
                                           int views, const cli::Log& log);

/// JSON has no infinity: null.
[[nodiscard]] nlohmann::ordered_json jsonNumber(double value);

}  // namespace esvr::render
