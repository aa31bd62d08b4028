#pragma once
/// The command of esvr-render that makes the picture of a scene.

#include <optional>
#include <string>

#include "render/view/collection.h"
#include "render/view/requests.h"

namespace esvr::view {

/// The built-in color map and opacity curve over a range of values.
struct LookNames {
  std::string colors, opacity;
  ValueRange range;
};

/// Finds the options of esvr-render that give a transfer function.
/// \return nothing if it is not made of a built-in map and a built-in curve over one range
[[nodiscard]] std::optional<LookNames> namesOf(const TransferFunction& function);

/// The file that the command reads the transfer function from.
inline constexpr const char* kTransferFile = "transfer.json";

struct RenderCommand {
  std::string text;
  /// The text of kTransferFile, a ParaView preset; nothing if options say the transfer function.
  std::optional<std::string> transfer;
};

/// \throws BadInput, UsageError  the scene names no grid
[[nodiscard]] RenderCommand commandOf(const Collection& collection, const SceneWish& scene,
                                      Resolution size);

}  // namespace esvr::view
