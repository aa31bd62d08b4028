#pragma once
/// Decides what a request gets.

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/status.hpp>
#include <string>
#include <vector>

namespace esvr::view {

namespace http = boost::beast::http;
using Request = http::request<http::empty_body>;

/// What the server accepts.
struct Site {
  std::string token;
  /// Names that a Host header may have besides localhost and addresses. An address cannot be the
  /// name of another site that resolves to this machine (DNS rebinding).
  std::vector<std::string> hostNames;
};

enum class Target { kPage, kSocket, kNothing };

struct Verdict {
  Target target = Target::kNothing;
  http::status status = http::status::not_found;  ///< of the answer if there is no target
};

[[nodiscard]] Verdict judge(const Request& request, const Site& site);

}  // namespace esvr::view
