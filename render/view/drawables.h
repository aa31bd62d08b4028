#pragma once
/// Grids that are ready to be drawn. All functions are called from one thread.

#include <list>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "esvr/sequence_file.h"
#include "render/scene.h"
#include "render/view/collection.h"

namespace esvr::view {

/// A grid of a frame with its renderers, which keep what they decoded for earlier pictures.
class Drawable {
 public:
  Drawable(std::vector<render::Scene> scenes, render::DrawSettings settings)
      : scenes_(std::move(scenes)), settings_(std::move(settings)) {}

  /// The renderer of shaded or of other pictures, which is made when it is first needed.
  /// \throws DeviceError  as for SceneRenderer
  [[nodiscard]] Renderer& renderer(bool shaded);

  /// Calls visit(volume) with the voxels, which are decoded for this if they are not stored.
  /// \throws MemoryExceeded  they need too much memory
  template <class Visit>
  auto withVoxels(Visit&& visit) const {
    if (const auto* grid = std::get_if<VolumeGrid>(&scenes_.front().content))
      return visit(grid->volume);
    const auto& memory = settings_.memory;
    return visit(decodeGrid(*scenes_.front().encoded,
                            {.maxBytes = memory.maxBytes, .memory = memory.voxels}));
  }

 private:
  const std::vector<render::Scene> scenes_;
  const render::DrawSettings settings_;
  std::optional<render::SceneRenderer> plain_, shaded_;
};

/// Reads grids when they are first drawn, and keeps those that were drawn last.
class Drawables {
 public:
  Drawables(const Collection& collection, render::DrawSettings settings)
      : collection_(collection), settings_(std::move(settings)) {}

  /// \return null if nothing is active in the grid's frame
  /// \throws BadInput  there is no such grid; as for readScenes
  /// \throws MemoryExceeded  as for readScenes
  [[nodiscard]] std::shared_ptr<Drawable> get(GridPlace place);

 private:
  [[nodiscard]] std::optional<std::vector<render::Scene>> scenesAt(const GridPlace& place);
  [[nodiscard]] SequenceReader& readerOf(std::size_t file);

  struct Kept {
    GridPlace place;
    std::shared_ptr<Drawable> drawable;
  };
  const Collection& collection_;
  const render::DrawSettings settings_;
  std::list<Kept> kept_;  ///< the one that was drawn last comes first
  std::map<std::size_t, SequenceReader> readers_;
};

}  // namespace esvr::view
