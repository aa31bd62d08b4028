#pragma once
/// A client that keeps what it is sent.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "render/view/outlet.h"

namespace esvr::test {

class KeptOutlet : public view::Outlet {
 public:
  void answer(std::string text) override { keep(nlohmann::json::parse(text)); }
  void deliver(std::string bytes) override {
    std::uint32_t length = 0;  // on the machines of the tests, in the order of the message
    std::memcpy(&length, bytes.data(), sizeof length);
    keep(nlohmann::json::parse(bytes.substr(sizeof length, length)));
  }
  [[nodiscard]] bool busy() const override {
    const std::scoped_lock lock(mutex_);
    return busy_;
  }
  void setBusy(bool busy) {
    const std::scoped_lock lock(mutex_);
    busy_ = busy;
  }

  /// The heads of all messages so far.
  [[nodiscard]] std::vector<nlohmann::json> heads() const {
    const std::scoped_lock lock(mutex_);
    return heads_;
  }
  /// Waits until a message is as wanted. \return false if there is none in ten seconds
  bool waitFor(const std::function<bool(const nlohmann::json&)>& wanted) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(10),
                             [&] { return std::any_of(heads_.begin(), heads_.end(), wanted); });
  }
  bool waitForPicture(int id) {
    return waitFor([id](const auto& h) { return h["type"] == "picture" && h["id"] == id; });
  }
  bool waitForLast(int id) {
    return waitFor([id](const auto& h) {
      return h["type"] == "picture" && h["id"] == id && h["last"] == true;
    });
  }

 private:
  void keep(nlohmann::json head) {
    {
      const std::scoped_lock lock(mutex_);
      heads_.push_back(std::move(head));
    }
    changed_.notify_all();
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<nlohmann::json> heads_;
  bool busy_ = false;
};

}  // namespace esvr::test
