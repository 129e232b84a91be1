#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/value.h"

namespace sentree::lsp {

/// Messages that wait to be answered; `has_room` says when there is room again.
inline constexpr std::size_t kWaitingMax = 1'000;
/// Texts that an editor has open at a time.
inline constexpr std::size_t kOpenTextsMax = 2'000;
/// Projects that are kept.
inline constexpr std::size_t kProjectsMax = 16;

/// A server of the Language Server Protocol 3.17 for the files of projects: trees, charts, requirements, sentree.yaml,
/// scenarios, interfaces. It has no threads and reads and writes no streams: messages in, messages out.
///
///     server.receive(content);                  // each message that has come
///     while (server.has_work()) server.work();  // when nothing more has come
///     for (const std::string& message : server.take_answers()) …
///
/// What an editor sends is untrusted: what is wrong is answered as the protocol says. A request that fails, whatever it
/// fails of, ends nothing but itself.
class Server {
 public:
  explicit Server(std::string version);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Takes a message. Notes of cancelled requests count at once, before what waits.
  void receive(std::string_view content);
  /// Tells the editor of something that was no message.
  void refuse(const std::string& problem);
  [[nodiscard]] bool has_room() const { return waiting_.size() < kWaitingMax; }

  /// Something waits: a request, or a project whose texts have changed.
  [[nodiscard]] bool has_work() const;
  /// Does one such thing; checks projects when nothing else waits.
  void work();

  /// Answers and notifications since the last call, in their order.
  [[nodiscard]] std::vector<std::string> take_answers();

  [[nodiscard]] bool is_over() const { return is_over_; }
  /// 0 if the editor has said that it shuts down before it ended.
  [[nodiscard]] int exit_code() const { return is_shut_down_ ? 0 : 1; }

 private:
  struct Impl;
  struct Waiting {
    Value id;  // null: a notification
    bool is_request = false;
    bool is_cancelled = false;
    std::string method;
    Value params;
  };
  void handle(Waiting& message);
  void answer(const Value& id, Value result);
  void answer_error(const Value& id, int code, std::string message);

  std::unique_ptr<Impl> impl_;
  std::deque<Waiting> waiting_;
  std::vector<std::string> answers_;
  bool is_initialized_ = false;
  bool is_shut_down_ = false;
  bool is_over_ = false;
};

}  // namespace sentree::lsp
