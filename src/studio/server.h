#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/studio/history.h"
#include "sentree/studio/subject.h"

namespace sentree::studio {

/// Pages at once.
inline constexpr std::size_t kClientsMax = 16;
/// Requests of one page that wait for their answers, those to steer among them; one more ends its socket.
inline constexpr std::size_t kRequestsMax = 64;
/// Bytes that a page may be behind before it gets less: the newest state later, and a gap in the messages.
inline constexpr std::size_t kBehindMax = std::size_t{1} << 20U;
/// Observations in one delta, and in one answer.
inline constexpr std::size_t kDeltaMessagesMax = 200;
inline constexpr std::size_t kAnswerMessagesMax = 500;
/// Deltas are sent at most so often.
inline constexpr std::chrono::milliseconds kDeltaPeriod{20};

/// What is known of a run beside what was recorded of it.
struct RunFacts {
  std::string state = "running";  ///< "running", "paused" or "ended".
  double factor = 1.0;
  std::string reason;
  Map vacuous;  ///< By monitor: why it says nothing that it is undecided, see `monitor::vacuity`. Of a run that ended.
  Value stopped_at;  ///< Of a breakpoint.
  std::uint64_t missed_ticks = 0;
  List processes;  ///< {name, pid}; those that run now.
};

/// How the server reaches a run that goes on. All but `steer` are called in the thread that composes and do not block.
struct RunAccess {
  /// Brings the history up to now.
  std::function<void()> update;
  std::function<RunFacts()> facts;
  /// One of the steering requests of docs/studio-protocol.md; not set: the run cannot be steered. Called in two threads
  /// of its own, one of them for what does not wait for the run; may block as long as it takes.
  std::function<Result<Value>(const std::string& op, const Value& request)> steer;
  /// What has been reached, as `coverage_value` has it; not set: nobody knows. Called as `steer` is, for all pages.
  std::function<Result<Value>()> coverage = {};
  /// What a verification has reached, as `read_verified` has it. Likewise.
  std::function<Result<Value>()> verified = {};
};

struct ServerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;  ///< 0: any free one.
  bool insecure = false;   ///< Others may reach it, without TLS.
  std::string version;
  bool live = true;  ///< Else a recording.
  /// A project is edited; `RunAccess::steer` takes the requests, and what a page sends may be as large as a file.
  bool design = false;
  /// Two states of files are compared, and nothing else; `RunAccess::steer` takes the requests.
  bool compare = false;
  /// Begins the run again, with {seed, scenario} where they are given; not set: it cannot. Called in a thread that may
  /// wait; the server is gone soon afterwards.
  std::function<Result<void>(const Value& request)> again = {};
};

/// Shows one run to pages in browsers: docs/studio-protocol.md.
///
/// Has two threads, one for the network and one that composes what pages get, and two in which pages steer. The run
/// only ever waits for the history's lock; a page that does not keep up gets less.
class Server {
 public:
  /// `subject` and `history` are borrowed. Errors: http.bad-address, http.not-loopback, http.port-taken.
  [[nodiscard]] static Result<std::unique_ptr<Server>> start(const Subject& subject, const History& history,
                                                             RunAccess run, ServerOptions options);
  ~Server();
  /// Ends the connections and the threads; nothing that it was given is called afterwards. What is called until then
  /// may ask it: an owner whom `RunAccess::steer` reaches stops it before letting it go. Once or more often.
  void stop();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// What to open in a browser; with the token where others can reach the server.
  [[nodiscard]] std::string url() const;
  [[nodiscard]] std::uint16_t port() const;
  /// Pages that are connected.
  [[nodiscard]] std::size_t clients() const;
  /// What those that may steer call themselves. When it changes, `RunAccess::steer` of a project that is edited is
  /// asked for "design_pages".
  [[nodiscard]] std::set<std::string> pages() const;

  /// A message, as JSON, to all pages that may steer. From any thread; in order with the answers to requests that are
  /// carried out after it.
  void tell(std::string message);
  /// What pages are shown from now on instead, each at the moment that it looks at.
  struct Shown {
    std::shared_ptr<const Subject> subject;
    std::shared_ptr<const History> history;
    std::function<RunFacts()> facts;    ///< As in `RunAccess`; may keep alive what they ask.
    std::function<void()> update = {};  ///< Likewise.
    bool steered = false;               ///< `RunAccess::steer` reaches this run.
    bool recording = false;             ///< What is over since long.
    /// Pages that look at the end of the run before stay at that moment, wherever this one ends.
    bool stays = false;
  };
  void show(Shown shown);

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Whether a request for a page of a server at `address`:`port` may be answered: its Host must be a name of this
/// machine, so that no other site's name leads here, and its Origin, if it has one, must be the page itself.
[[nodiscard]] bool is_own_page(std::string_view host, std::string_view origin, std::string_view address,
                               std::uint16_t port);

}  // namespace sentree::studio
