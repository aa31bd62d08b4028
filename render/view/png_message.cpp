#include "render/view/png_message.h"

#include <nlohmann/json.hpp>
#include <string_view>

#include "cli/version_text.h"
#include "render/options.h"
#include "render/png_file.h"
#include "render/view/binary_message.h"
#include "render/view/command_text.h"

namespace esvr::view {

std::string pngMessage(const Collection& collection, Drawables& drawables,
                       const PictureRequest& request, const CancelToken& cancel) {
  const SceneWish& scene = request.scene;
  Painting painting({collection, drawables, scene, request.size, &cancel});
  painting.complete();
  const render::PngText text{std::string(render::kProgram) + " " + cli::programVersion(),
                             commandOf(collection, scene, request.size).text};
  const auto bytes =
      render::encodePng(painting.picture(), {scene.options.background, scene.options.bits}, text);
  return binaryMessage({{"type", "png"}, {"id", request.id}},
                       {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace esvr::view
