#include "render/view/studio.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "esvr/error.h"
#include "programs/run_main.h"

namespace esvr::view {

// Messages.

std::string textOf(const nlohmann::json& content) {
  return content.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string binaryMessage(const nlohmann::json& head, std::string_view bytes) {
  const std::string text = textOf(head);
  std::string message;
  message.reserve(sizeof(std::uint32_t) + text.size() + bytes.size());
  for (unsigned shift = 0; shift < 32; shift += 8) message += char((text.size() >> shift) & 0xffu);
  return message.append(text).append(bytes);
}

std::string failedMessage(const std::string& text, std::optional<std::int64_t> id) {
  nlohmann::json content{{"type", "failed"}, {"text", text}};
  if (id) content["id"] = *id;
  return textOf(content);
}

// The studio.

namespace {

/// Time for the first picture of a request, in seconds. Further passes are drawn before it is shown
/// if they are expected to end within this time.
constexpr double kFirstBudget = 0.03;
constexpr std::size_t kMostTasks = 8;  // that wait for one client
constexpr double kMs = 1e3;            // milliseconds of a second

/// Memory of a picture while it is drawn and encoded: the last pass, the picture that it is
/// enlarged to, its copy and the encoded bytes. A comparison has a second picture of each.
double bytesOf(const PictureRequest& picture) {
  constexpr double kBytesPerPixel = 64.0;
  const double pictures = picture.scene.compare ? 2.0 : 1.0;
  return pictures * kBytesPerPixel * picture.size.width * picture.size.height;
}

}  // namespace

/// Kinds of work; more urgent ones have larger values.
enum class Studio::Urgency { kNone, kRefinement, kTask, kFirstPass, kDrag };

Studio::Urgency Studio::urgencyOf(const DrawRequest& request) {
  return request.moving ? Urgency::kDrag : Urgency::kFirstPass;
}

/// A picture that is drawn. Only the studio's thread uses what may change, except for the tokens.
struct Studio::Job {
  Job(DrawRequest of, const CancelToken* stopping) : request(std::move(of)), cancel(stopping) {}

  const DrawRequest request;
  CancelToken cancel;
  /// Cancels one pass. It is made anew for each pass, at the place that the painting knows.
  std::optional<CancelToken> pass;
  Urgency urgency = urgencyOf(request);  ///< of the next pass; the mutex protects it
  std::optional<Painting> painting;
  int passes = 0;
  bool inOnePass = false;  ///< it was given up to make room, and would be given up again
};

/// What a client waits for.
struct Studio::Easel {
  Easel(std::shared_ptr<Outlet> to, const CancelToken* stopping)
      : outlet(std::move(to)), gone(stopping) {}

  [[nodiscard]] Urgency urgency() const {
    if (outlet->busy()) return Urgency::kNone;
    if (waiting) return urgencyOf(*waiting);
    return std::max(tasks.empty() ? Urgency::kNone : Urgency::kTask,
                    job ? job->urgency : Urgency::kNone);
  }

  const std::shared_ptr<Outlet> outlet;
  CancelToken gone;  ///< the client has left
  std::optional<DrawRequest> waiting;
  std::deque<Task> tasks;
  std::shared_ptr<Job> job;  ///< the picture that is drawn or refined
};

/// A task, or a pass of a job.
struct Studio::Work {
  std::shared_ptr<Easel> easel;
  Task task;
  std::shared_ptr<Job> job;
};

Studio::Studio(const Collection& collection, const render::DrawSettings& settings)
    : collection_(collection),
      maxBytes_(settings.memory.maxBytes),
      drawables_(collection, settings),
      thread_([this] { loop(); }) {}

void Studio::cancelAll() {
  stopping_.cancel();
  {
    const std::scoped_lock lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
}

bool Studio::endsWithin(std::chrono::milliseconds time) {
  cancelAll();
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, time, [&] { return ended_; });
}

void Studio::stop() {
  cancelAll();
  if (thread_.joinable()) thread_.join();
  easels_.clear();
}

Studio::Easel& Studio::easelOf(const std::shared_ptr<Outlet>& client) {
  for (const auto& easel : easels_)
    if (easel->outlet == client) return *easel;
  easels_.push_back(std::make_shared<Easel>(client, &stopping_));
  return *easels_.back();
}

void Studio::draw(const std::shared_ptr<Outlet>& client, DrawRequest request) {
  {
    const std::scoped_lock lock(mutex_);
    if (stopped_) return;
    Easel& easel = easelOf(client);
    if (easel.job && !easel.job->request.moving) easel.job->cancel.cancel(), easel.job.reset();
    easel.waiting = std::move(request);
    interrupt();
  }
  changed_.notify_one();
}

/// Gives up the pass that is drawn if more urgent work waits.
void Studio::interrupt() {
  const auto precedes = [&](const auto& easel) { return easel->urgency() > drawn_->urgency; };
  if (drawn_ && std::any_of(easels_.begin(), easels_.end(), precedes)) drawn_->pass->cancel();
}

void Studio::add(const std::shared_ptr<Outlet>& client, Task task) {
  {
    const std::scoped_lock lock(mutex_);
    if (stopped_) return;
    Easel& easel = easelOf(client);
    if (easel.tasks.size() == kMostTasks) throw BadInput("too many requests wait; ask again later");
    easel.tasks.push_back(std::move(task));
    interrupt();
  }
  changed_.notify_one();
}

void Studio::leave(const Outlet& client) {
  const std::scoped_lock lock(mutex_);
  const auto easel = std::find_if(easels_.begin(), easels_.end(),
                                  [&](const auto& e) { return e->outlet.get() == &client; });
  if (easel == easels_.end()) return;
  (*easel)->gone.cancel();
  easels_.erase(easel);
}

void Studio::wake() {
  {
    const std::scoped_lock lock(mutex_);
    interrupt();
  }
  changed_.notify_one();
}

void Studio::loop() {
  for (;;) {
    std::optional<Work> work;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stopped_ || (work = next()); });
      if (stopped_) {
        ended_ = true;
        changed_.notify_all();
        return;
      }
    }
    perform(*work);
    end(*work);
  }
}

/// The most urgent work. Its client then waits behind the others.
std::optional<Studio::Work> Studio::next() {
  const auto found =
      std::max_element(easels_.begin(), easels_.end(),
                       [](const auto& a, const auto& b) { return a->urgency() < b->urgency(); });
  const Urgency urgency = found == easels_.end() ? Urgency::kNone : (*found)->urgency();
  if (urgency == Urgency::kNone) return std::nullopt;
  std::rotate(found, found + 1, easels_.end());
  const auto& easel = easels_.back();
  if (urgency == Urgency::kTask) {
    Work work{easel, std::move(easel->tasks.front()), nullptr};
    easel->tasks.pop_front();
    return work;
  }
  if (easel->waiting) {
    easel->job = std::make_shared<Job>(std::move(*easel->waiting), &easel->gone);
    easel->waiting.reset();
  }
  easel->job->pass.emplace(&easel->job->cancel);
  drawn_ = easel->job;
  return Work{easel, {}, easel->job};
}

void Studio::perform(const Work& work) {
  Outlet& outlet = *work.easel->outlet;
  try {
    if (work.task)
      work.task(drawables_, outlet, work.easel->gone);
    else
      drawPass(*work.job, outlet);
  } catch (const Cancelled&) {
    // The client has asked for another picture or has left, or another client comes first.
  } catch (...) {
    if (work.job) work.job->cancel.cancel();
    const auto id = work.job ? std::optional(work.job->request.picture.id) : std::nullopt;
    outlet.answer(failedMessage(cli::currentFailure().what(), id));
  }
}

void Studio::drawPass(Job& job, Outlet& outlet) {
  const auto& [picture, quality, moving] = job.request;
  cli::Stopwatch watch;
  makeRoom(picture, &job);
  if (!job.painting)
    job.painting.emplace(
        Painting::Input{collection_, drawables_, picture.scene, picture.size, &*job.pass});
  if (job.inOnePass)
    job.painting->complete();
  else
    job.painting->refine(job.passes == 0 ? kFirstBudget : 0.0);
  ++job.passes;
  const double drawMs = kMs * watch.lap();
  const Image image = job.painting->picture();
  const Rgb background = picture.scene.options.background.value_or(Rgb{});
  const std::string jpeg = encodeJpeg(image, {background, quality});
  const bool last = moving || job.painting->isComplete();
  nlohmann::json head{{"type", "picture"},
                      {"id", picture.id},
                      {"last", last},
                      {"width", image.width},
                      {"height", image.height},
                      {"format", "jpeg"},
                      {"drawMs", drawMs},
                      {"encodeMs", kMs * watch.lap()},
                      {"pass", job.passes},
                      {"stats",
                       {{"vramBytes", job.painting->deviceBytes()},
                        {"ellipsoids", collection_.gridAt(picture.scene.place).ellipsoids}}}};
  if (job.painting->isComplete())
    if (const auto errors = job.painting->errors()) {
      head["psnr"] = errors->psnr;  // null if the pictures are equal
      head["maxDifference"] = errors->maxError;
    }
  outlet.deliver(binaryMessage(head, jpeg));
  if (last) job.cancel.cancel();
}

/// Memory is needed for one picture that is being drawn, and for those that wait for their next
/// pass. The picture of a pass is held together with its copy that is encoded.
void Studio::makeRoom(const PictureRequest& picture, const Job* own) {
  const double needed = bytesOf(picture);
  requireWithinMemory(needed, maxBytes_,
                      "a picture of " + std::to_string(picture.size.width) + " x " +
                          std::to_string(picture.size.height) + " pixels");
  const std::scoped_lock lock(mutex_);
  double kept = 0.0;
  // The pictures of the clients that wait longest are given up last, because it is their turn.
  for (const auto& easel : easels_) {
    Job* const job = easel->job.get();
    if (job == nullptr || job == own || !job->painting) continue;
    kept += bytesOf(job->request.picture);
    if (kept + needed <= double(maxBytes_)) continue;
    kept -= bytesOf(job->request.picture);
    job->painting.reset();
    job->inOnePass = true;
  }
}

/// After a pass, forgets a job that has ended.
void Studio::end(const Work& work) {
  const std::scoped_lock lock(mutex_);
  drawn_.reset();
  if (!work.job) return;
  if (work.job->passes > 0) work.job->urgency = Urgency::kRefinement;
  if (work.job->cancel.cancelled() && work.easel->job == work.job) work.easel->job.reset();
}

}  // namespace esvr::view
