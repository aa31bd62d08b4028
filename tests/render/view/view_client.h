#pragma once
/// Clients of a server of the viewer on this machine, and files that it shows them.

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/files.h"

namespace esvr::test {

/// Where a server listens, and its secret.
struct ViewAddress {
  unsigned short port = 0;
  std::string token;
  [[nodiscard]] std::string host() const { return "127.0.0.1:" + std::to_string(port); }
};

/// A connection that sends any bytes.
class RawClient {
 public:
  explicit RawClient(const ViewAddress& address);
  ~RawClient();
  /// \return whether all were sent
  bool send(const std::string& bytes);
  /// Sends the same bytes again and again. \return false if the server stopped reading after
  /// `count` times at most
  bool sendOften(const std::string& bytes, int count);
  /// All that the server sends until it closes the connection, or until `end` was received.
  /// \throws std::runtime_error  it does not close the connection in ten seconds
  [[nodiscard]] std::string receive(const std::string& end = "");

 private:
  struct Parts;
  const std::unique_ptr<Parts> parts_;
};

/// The text of a GET request with further lines of its head, each with its end.
[[nodiscard]] std::string getRequest(const ViewAddress& address, const std::string& target,
                                     const std::string& lines = "");
/// The lines that ask for a socket.
inline constexpr const char* kUpgrade =
    "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

/// Sends a request. \return the whole answer
[[nodiscard]] std::string answerTo(const ViewAddress& address, const std::string& request);
/// The status of an answer; 0 if there is none.
[[nodiscard]] int statusOf(const std::string& answer);

struct ViewAnswer {
  nlohmann::json head;
  std::string bytes;  ///< of a binary message
};

/// The server has closed the socket.
struct SocketClosed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A client with a socket, as the page is one.
class ViewClient {
 public:
  /// \throws SocketClosed  the server does not accept the socket
  explicit ViewClient(const ViewAddress& address);
  ~ViewClient();

  void send(const nlohmann::json& message) { sendText(message.dump()); }
  void sendText(const std::string& text);
  void sendBinary(const std::string& bytes);
  /// The next answer.
  /// \throws SocketClosed        the server has closed it
  /// \throws std::runtime_error  there is no answer in ten seconds
  [[nodiscard]] ViewAnswer receive();
  [[nodiscard]] ViewAnswer ask(const nlohmann::json& message) {
    send(message);
    return receive();
  }
  /// All pictures of a draw request up to the last one.
  [[nodiscard]] std::vector<ViewAnswer> draw(const nlohmann::json& message);

 private:
  struct Parts;
  const std::unique_ptr<Parts> parts_;
};

/// A draw request of a small picture. \param more  further members of the scene
[[nodiscard]] nlohmann::json drawMessage(int id, const nlohmann::json& more = {});

/// A folder with a blob of ellipsoids, `blob.esvr`, whose grid is named "density"; with its voxels,
/// `blob.vdb`; and with a sequence of two frames, `frames.esvr`, whose numbers are 7 and 9.
class ViewFiles {
 public:
  ViewFiles();
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const {
    return folder_ / name;
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace esvr::test
