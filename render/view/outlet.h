#pragma once
/// The way to a client, and the form of messages: JSON text, or the length of a head as uint32 in
/// little endian, the head as JSON text, and bytes.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace esvr::view {

/// Sends messages to one client. Its functions may be called from any thread.
class Outlet {
 public:
  Outlet() = default;
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;
  virtual ~Outlet() = default;

  /// Sends JSON text.
  virtual void answer(std::string text) = 0;
  /// Sends a picture, which is a binary message.
  virtual void deliver(std::string bytes) = 0;
  /// True until all pictures are sent. A client that is busy gets no picture.
  [[nodiscard]] virtual bool busy() const = 0;
};

/// A message with bytes.
[[nodiscard]] std::string binaryMessage(const nlohmann::json& head, std::string_view bytes);

/// JSON as text; bytes of names that are not UTF-8 are replaced.
[[nodiscard]] std::string textOf(const nlohmann::json& content);

/// The answer to a message that cannot be served: {"type": "failed", "text": TEXT}, with the number
/// of the request if it had one.
[[nodiscard]] std::string failedMessage(const std::string& text,
                                        std::optional<std::int64_t> id = std::nullopt);

}  // namespace esvr::view
