#pragma once
/// Draws the pictures of all clients on one thread, and sends messages to clients.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "esvr/device.h"
#include "render/view/collection.h"
#include "render/view/painting.h"
#include "render/view/requests.h"

namespace esvr::view {

// Messages are JSON text, or the length of a head as uint32 in little endian, the head as JSON text, and bytes.

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

/// One thread draws, because a picture uses the whole device, and because renderers then need to
/// keep decoded voxels only once. Clients take turns, pass by pass. The passes of clients that drag
/// come first, then the first passes of other pictures, then tasks, and then refinements. A pass is
/// given up and repeated later if a more urgent one of another client waits, because it may take
/// long on a CPU. Tasks are not given up.
class Studio {
 public:
  /// A task that needs the grids. It gets the way to its client, and a token that is set when the
  /// client leaves.
  using Task = std::function<void(Drawables&, Outlet&, const CancelToken&)>;

  Studio(const Collection& collection, const render::DrawSettings& settings);
  ~Studio() { stop(); }
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;

  /// Replaces the client's picture: a request that waits is forgotten, and a picture that is being
  /// refined is cancelled. The picture of a client that drags is shown nevertheless, because a
  /// client that sends requests faster than they are drawn would otherwise never see one.
  void draw(const std::shared_ptr<Outlet>& client, DrawRequest request);
  /// \throws BadInput  the client has too many tasks that wait
  void add(const std::shared_ptr<Outlet>& client, Task task);
  /// Forgets a client.
  void leave(const Outlet& client);
  /// To be called when a client is no longer busy.
  void wake();
  /// Cancels everything and forgets all clients.
  void stop();
  /// Cancels everything. \return false if the thread goes on for longer than a time
  [[nodiscard]] bool endsWithin(std::chrono::milliseconds time);
  /// Checks the memory of a picture that is about to be drawn, and gives up pictures of other
  /// clients that wait for their next pass, so that all of them together keep to the limit. Those
  /// are drawn anew, in one pass. To be called by tasks.
  /// \throws MemoryExceeded  the picture alone is too large
  void makeRoomFor(const PictureRequest& picture) { makeRoom(picture, nullptr); }

 private:
  struct Job;
  struct Easel;
  struct Work;
  enum class Urgency;
  [[nodiscard]] static Urgency urgencyOf(const DrawRequest& request);
  [[nodiscard]] Easel& easelOf(const std::shared_ptr<Outlet>& client);
  void loop();
  void cancelAll();
  void makeRoom(const PictureRequest& picture, const Job* own);
  [[nodiscard]] std::optional<Work> next();
  void perform(const Work& work);
  void drawPass(Job& job, Outlet& outlet);
  void interrupt();
  void end(const Work& work);

  const Collection& collection_;
  const std::uint64_t maxBytes_;  ///< of pictures
  Drawables drawables_;           ///< used by the thread only
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<Easel>> easels_;  ///< the one that waits longest comes first
  std::shared_ptr<Job> drawn_;                  ///< the job of which a pass is drawn at this moment
  bool stopped_ = false;
  bool ended_ = false;  ///< the thread has left its loop
  CancelToken stopping_;
  std::thread thread_;
};

}  // namespace esvr::view
