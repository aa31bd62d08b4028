#pragma once
/// The answer to a message that cannot be served.

#include <cstdint>
#include <optional>
#include <string>

namespace esvr::view {

/// {"type": "failed", "text": TEXT}, with the number of the request if it had one.
[[nodiscard]] std::string failedMessage(const std::string& text,
                                        std::optional<std::int64_t> id = std::nullopt);

}  // namespace esvr::view
