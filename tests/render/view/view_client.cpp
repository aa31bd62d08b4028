#include "render/view/view_client.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <span>

#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/sequence_file.h"
#include "esvr/vdb_io.h"
#include "field/random_field.h"

namespace esvr::test {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;
using boost::system::error_code;

tcp::endpoint endpointOf(const ViewAddress& address) {
  return {asio::ip::address_v4::loopback(), address.port};
}

/// Runs the operations of a context until they end.
void finish(asio::io_context& io) {
  constexpr std::chrono::seconds kPatience{10};
  io.restart();
  io.run_for(kPatience);
  if (!io.stopped()) throw std::runtime_error("the server does nothing");
}

ViewAnswer answerOf(const std::string& bytes, bool isBinary) {
  if (!isBinary) return {nlohmann::json::parse(bytes), {}};
  std::size_t length = 0;
  for (std::size_t i = 0; i < sizeof(std::uint32_t); ++i)
    length |= std::size_t(static_cast<unsigned char>(bytes.at(i))) << (8 * i);
  const std::string head = bytes.substr(sizeof(std::uint32_t), length);
  return {nlohmann::json::parse(head), bytes.substr(sizeof(std::uint32_t) + length)};
}

}  // namespace

struct RawClient::Parts {
  asio::io_context io;
  tcp::socket socket{io};
};

RawClient::RawClient(const ViewAddress& address) : parts_(std::make_unique<Parts>()) {
  parts_->socket.connect(endpointOf(address));
}

RawClient::~RawClient() = default;

bool RawClient::send(const std::string& bytes) {
  error_code error;
  asio::write(parts_->socket, asio::buffer(bytes), error);
  return !error;
}

bool RawClient::sendOften(const std::string& bytes, int count) {
  // A server that reads does so before this time is over.
  constexpr std::chrono::milliseconds kPatience{300};
  for (int i = 0; i < count; ++i) {
    asio::async_write(parts_->socket, asio::buffer(bytes), [](error_code, std::size_t) {});
    parts_->io.restart();
    parts_->io.run_for(kPatience);
    if (parts_->io.stopped()) continue;
    parts_->socket.cancel();
    parts_->io.run();
    return false;
  }
  return true;
}

std::string RawClient::receive(const std::string& end) {
  std::string received;
  error_code result;
  const auto keep = [&](error_code error, std::size_t) { result = error; };
  if (end.empty())
    asio::async_read(parts_->socket, asio::dynamic_buffer(received), keep);
  else
    asio::async_read_until(parts_->socket, asio::dynamic_buffer(received), end, keep);
  finish(parts_->io);
  return received;
}

std::string getRequest(const ViewAddress& address, const std::string& target,
                       const std::string& lines) {
  return "GET " + target + " HTTP/1.1\r\nHost: " + address.host() + "\r\n" + lines + "\r\n";
}

std::string answerTo(const ViewAddress& address, const std::string& request) {
  RawClient client(address);
  (void)client.send(request);
  return client.receive();
}

int statusOf(const std::string& answer) {
  constexpr std::string_view kStart = "HTTP/1.1 ";
  return answer.starts_with(kStart) ? std::stoi(answer.substr(kStart.size(), 3)) : 0;
}

struct ViewClient::Parts {
  asio::io_context io;
  beast::websocket::stream<tcp::socket> socket{io};
  beast::flat_buffer buffer;
};

ViewClient::ViewClient(const ViewAddress& address) : parts_(std::make_unique<Parts>()) {
  parts_->socket.next_layer().connect(endpointOf(address));
  parts_->socket.next_layer().set_option(tcp::no_delay(true));
  parts_->socket.read_message_max(std::size_t{256} << 20);
  error_code error;
  parts_->socket.handshake(address.host(), "/" + address.token + "/socket", error);
  if (error) throw SocketClosed(error.message());
}

ViewClient::~ViewClient() = default;

void ViewClient::sendText(const std::string& text) {
  parts_->socket.text(true);
  error_code error;
  parts_->socket.write(asio::buffer(text), error);
  if (error) throw SocketClosed(error.message());
}

void ViewClient::sendBinary(const std::string& bytes) {
  parts_->socket.binary(true);
  error_code error;
  parts_->socket.write(asio::buffer(bytes), error);
  if (error) throw SocketClosed(error.message());
}

ViewAnswer ViewClient::receive() {
  error_code result;
  parts_->socket.async_read(parts_->buffer, [&](error_code error, std::size_t) { result = error; });
  finish(parts_->io);
  if (result) throw SocketClosed(result.message());
  const std::string bytes = beast::buffers_to_string(parts_->buffer.data());
  parts_->buffer.clear();
  return answerOf(bytes, parts_->socket.got_binary());
}

std::vector<ViewAnswer> ViewClient::draw(const nlohmann::json& message) {
  send(message);
  std::vector<ViewAnswer> answers;
  do answers.push_back(receive());
  while (answers.back().head["type"] == "picture" && !answers.back().head["last"].get<bool>());
  return answers;
}

nlohmann::json drawMessage(int id, const nlohmann::json& more) {
  nlohmann::json scene = {{"file", 0}, {"grid", 0}};
  if (more.is_object()) scene.update(more);
  return {{"type", "draw"}, {"id", id}, {"width", 48}, {"height", 40}, {"scene", scene}};
}

// Files.

namespace {

GridDescriptor density() {
  GridDescriptor d;
  d.name = "density";
  d.gridClass = GridClass::kFogVolume;
  d.transform = uniformTransform(0.5);
  return d;
}

Field blob(std::uint64_t seed) {
  Field field =
      randomField({.count = 8, .extent = 16.0, .smallest = 3.0, .aspect = 2.0, .seed = seed});
  for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
  return field;
}

EsvrFile fileOf(const Field& field) {
  return {{}, {makeStoredGrid(density(), revoxelise(field, {}), field)}};
}

void writeFrames(const std::filesystem::path& path) {
  SequenceWriter writer(path);
  for (const std::int64_t number : {7, 9}) {
    writer.append(number, encodeFrame(fileOf(blob(std::uint64_t(number))), nullptr));
    writer.endGroup();
  }
  writer.finish();
}

}  // namespace

ViewFiles::ViewFiles() {
  const Field field = blob(7);
  writeEsvr(folder_ / "blob.esvr", fileOf(field));
  const VolumeGrid grid{density(), revoxelise(field, {}), 0};
  writeGrids(folder_ / "blob.vdb", {}, std::span(&grid, 1));
  writeFrames(folder_ / "frames.esvr");
}

}  // namespace esvr::test
