#pragma once
/// A server of the viewer that runs on a thread of the test.

#include <filesystem>
#include <thread>
#include <vector>

#include "render/view/service.h"
#include "render/view/token.h"
#include "render/view/view_client.h"

namespace esvr::test {

class RunningServer {
 public:
  explicit RunningServer(const std::vector<std::filesystem::path>& files,
                         const view::ServerLimits& limits = {}, const cli::HostMemory& memory = {})
      : collection_(files, memory),
        token_(view::randomToken()),
        service_(collection_, {{boost::asio::ip::address_v4::loopback(), 0},
                               {token_, {}},
                               limits,
                               {selectDevice("cpu"), {}, {}, false, memory}}),
        thread_([this] { service_.run(); }) {}
  ~RunningServer() {
    service_.stop();
    thread_.join();
  }
  RunningServer(const RunningServer&) = delete;
  RunningServer& operator=(const RunningServer&) = delete;

  [[nodiscard]] ViewAddress address() const { return {service_.endpoint().port(), token_}; }

 private:
  const view::Collection collection_;
  const std::string token_;
  view::Service service_;
  std::thread thread_;
};

}  // namespace esvr::test
