#pragma once
/// What clients ask for, in the JSON of messages (docs/pictures.md): scenes with the options of
/// esvr-render, transfer functions, cameras and sizes.

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "esvr/camera.h"
#include "esvr/error.h"
#include "esvr/transfer_function.h"
#include "programs/option_values.h"
#include "programs/sequence.h"
#include "render/options.h"

namespace esvr::view {

using nlohmann::json;

/// Reads the members of a JSON object that a client sends, some of which may be missing. A member
/// that is null counts as missing. Every function throws a BadInput that names the member if its
/// value has the wrong form.
class Members {
 public:
  /// \param name  of the object in messages
  /// \throws BadInput  the value is no object
  Members(const json& object, std::string name);

  /// \throws BadInput  the object has a member of another name
  void requireKnown(std::initializer_list<std::string_view> names) const;

  /// The value of a member; null if it is missing.
  [[nodiscard]] const json* find(const char* name) const;
  /// \throws BadInput  it is missing
  [[nodiscard]] const json& at(const char* name) const;

  [[nodiscard]] std::optional<double> number(const char* name) const;
  /// A number within [low, high].
  [[nodiscard]] std::optional<double> number(const char* name, double low, double high) const;
  /// A whole number within [low, high].
  [[nodiscard]] std::optional<std::int64_t> whole(const char* name, std::int64_t low,
                                                  std::int64_t high) const;
  [[nodiscard]] std::optional<bool> flag(const char* name) const;
  [[nodiscard]] std::optional<std::string> text(const char* name) const;
  [[nodiscard]] std::optional<Vec3> vector(const char* name) const;

  /// The value that a word stands for.
  template <class T>
  [[nodiscard]] std::optional<T> choice(const char* name,
                                        std::initializer_list<cli::Choice<T>> choices) const {
    const auto word = text(name);
    if (!word) return std::nullopt;
    std::string words;
    for (const auto& c : choices) {
      if (*word == c.word) return c.value;
      words += (words.empty() ? "" : ", ") + std::string(c.word);
    }
    refuse(name, "must be one of " + words);
  }

  /// \throws BadInput  always: the member, followed by `what`
  [[noreturn]] void refuse(const std::string& name, const std::string& what) const;
  /// The name of a member in messages.
  [[nodiscard]] std::string nameOf(const std::string& member) const { return name_ + "." + member; }

 private:
  const json& object_;
  std::string name_;
};

/// The numbers of an array of a given length. \param name  of the array in messages
[[nodiscard]] std::vector<double> numbersOf(const json& array, std::size_t count,
                                            const std::string& name);

/// Transfer functions: {"space": "RGB", "colors": [[x, r, g, b], ...],
/// "opacity": [[x, opacity, midpoint, sharpness], ...]}.
[[nodiscard]] json jsonOf(const TransferFunction& function);
[[nodiscard]] json jsonOf(const ColorMap& map);
[[nodiscard]] json jsonOf(const OpacityCurve& curve);

/// \throws BadInput    a member is missing or has the wrong form, or there are too many points
/// \throws UsageError  as for checkTransferFunction
[[nodiscard]] TransferFunction transferOf(const json& content);

/// A grid of a frame of a file that the server shows.
struct GridPlace {
  std::size_t file = 0, grid = 0;
  std::optional<cli::FrameNumber> frame;  ///< nothing: the first frame, or the file has none
  friend auto operator<=>(const GridPlace&, const GridPlace&) = default;
};

/// What a picture shows of a reference.
enum class CompareShow { kSplit, kReference, kDifference };

struct Comparison {
  GridPlace with;
  CompareShow show = CompareShow::kSplit;
  double split = 0.5;  ///< share of the width, from the left, that shows the grid itself
  double gain = 10.0;  ///< factor of differences
};

struct SceneWish {
  GridPlace place;
  /// The look, the camera and the rays. The resolution and the input are not set.
  render::Options options;
  std::optional<double> slicePlace{};  ///< of options.clip, if it is a slice
  std::optional<std::size_t> sliceAxis{};
  std::optional<Comparison> compare{};
};

/// Reads the members "file", "grid" and "frame". Whether they exist is not checked.
/// \throws BadInput  they have the wrong form
[[nodiscard]] GridPlace placeOf(const json& content, const std::string& name);

/// \throws BadInput    a member is unknown or has the wrong form
/// \throws UsageError  members exclude each other; the transfer function is none
[[nodiscard]] SceneWish sceneOf(const json& content);

/// A camera as a member of messages.
[[nodiscard]] json jsonOf(const Camera& camera);

/// The largest side of a picture, in pixels.
inline constexpr int kMaxPictureSide = 4096;

/// A picture that a client asks for.
struct PictureRequest {
  std::int64_t id = 0;  ///< number that the client gave it
  Resolution size;
  SceneWish scene;
};

struct DrawRequest {
  PictureRequest picture;
  double quality = 0.85;  ///< of the JPEG, 0 to 1
  /// The user drags: one picture within the time budget is enough. Otherwise the picture is refined
  /// until it is complete.
  bool moving = false;
};

/// Reads the members "id", "width", "height" and "scene", and for a draw request also "quality" and
/// "moving".
/// \throws BadInput, UsageError  a member is missing, unknown or wrong
[[nodiscard]] DrawRequest drawRequestOf(const json& content);
[[nodiscard]] PictureRequest pngRequestOf(const json& content);

/// Reads the members "width" and "height" of an object.
[[nodiscard]] Resolution sizeOf(const json& content, const std::string& name);

}  // namespace esvr::view
