#pragma once
/// Takes the messages of clients: answers what needs no voxels, and passes the rest to the studio
/// as tasks. And the command of esvr-render that makes the picture of a scene.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "esvr/volume.h"
#include "render/view/collection.h"
#include "render/view/requests.h"
#include "render/view/studio.h"

namespace esvr::view {

inline constexpr const char* kProgram = "esvr-view";

inline constexpr std::size_t kHistogramBins = 256;

/// The number of active voxels in each of kHistogramBins parts of a range of the same width. Values
/// outside the range count in the first or last part. If the range has no extent, all count in the
/// first one.
[[nodiscard]] std::vector<std::uint64_t> histogramOf(const SparseVolume& volume, ValueRange range);

/// The answer to "histogram".
[[nodiscard]] std::string histogramMessage(const GridPlace& place, ValueRange range,
                                           const std::vector<std::uint64_t>& counts);

class Desk {
 public:
  /// \param device  the name of the device that draws
  Desk(const Collection& collection, Studio& studio, const std::string& device);

  /// Takes a message of a client. A wrong message is answered by a text that says what is wrong.
  /// \return false if it was wrong
  bool receive(const std::shared_ptr<Outlet>& client, std::string_view message);

 private:
  void serve(const std::shared_ptr<Outlet>& client, const nlohmann::json& message);
  void drawPng(const std::shared_ptr<Outlet>& client, PictureRequest request);
  void countValues(const std::shared_ptr<Outlet>& client, const GridPlace& place);

  const Collection& collection_;
  Studio& studio_;
  const std::string description_;
};

// ---- Command lines

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
