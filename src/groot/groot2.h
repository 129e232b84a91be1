#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/status.h"

// What Groot 2 (BehaviorTree.CPP 4's Groot2Publisher, protocol 2) asks and is answered. Pure functions, both ways.

namespace sentree::groot {

/// Port of Groot 2, unless told otherwise; breakpoints are told on the next one.
inline constexpr std::uint16_t kGroot2Port = 1667;
/// Changes that the recording of a publisher keeps; a drain of so many means that some may be lost.
inline constexpr std::size_t kRecordedMax = 1'000;

/// Parts of a message of ZeroMQ.
using Parts = std::vector<std::string>;

/// Kinds of requests, by the letter on the wire.
enum class Ask : char {
  kTree = 'T',
  kStatus = 'S',
  kBlackboard = 'B',
  kInsertHook = 'I',
  kRemoveHook = 'R',
  kUnlock = 'U',
  kDumpHooks = 'D',
  kRemoveHooks = 'A',
  kDisableHooks = 'X',
  kRecording = 'r',
  kTransitions = 't',
  kReached = 'N',  ///< Never asked: how a publisher tells that a hook was reached.
};

struct Request {
  Ask type = Ask::kTree;
  std::uint32_t id = 0;  ///< Chosen by who asks, repeated in the answer.
  std::string body;      ///< The second part; empty where there is none.
  bool has_body = false;
};

/// An RFC 4122 UUID; new for each tree.
using TreeId = std::array<std::uint8_t, 16>;

/// Reads a request. Errors: groot.request; the message is what goes back to who asked.
[[nodiscard]] Result<Request> parse_request(const Parts& parts);
[[nodiscard]] Parts write_request(const Request& request);

/// The answer to a request; `body` is left out where there is none.
[[nodiscard]] Parts write_reply(const Request& request, const TreeId& tree, std::optional<std::string> body);
[[nodiscard]] Parts write_error(std::string_view text);
/// What BehaviorTree.CPP says of a hook on which there is none.
inline constexpr std::string_view kNoSuchHook = "Node ID not found";

struct Reply {
  TreeId tree{};
  std::string body;
};
/// Reads the answer to `request`. Errors: groot.refused (the publisher says why), groot.reply (it is no answer to it).
[[nodiscard]] Result<Reply> parse_reply(const Request& request, const Parts& parts);

/// The status of a node as it goes over the wire: 0 idle and never run, 1 running, 2 success, 3 failure, 4 skipped,
/// 10 + s idle and s before.
using StatusCode = std::uint8_t;
inline constexpr StatusCode kIdleAfter = 10;
/// After a node with `code` came to a status.
[[nodiscard]] StatusCode next_code(StatusCode code, bt::Status to);
struct NodeStatus {
  std::uint16_t uid = 0;
  StatusCode code = 0;
  friend bool operator==(const NodeStatus&, const NodeStatus&) = default;
};
[[nodiscard]] std::string write_statuses(std::span<const NodeStatus> statuses);
/// Errors: groot.reply.
[[nodiscard]] Result<std::vector<NodeStatus>> parse_statuses(std::string_view body);

/// A change of a publisher's recording, or of a .btlog file; its 9 bytes.
struct Record {
  std::int64_t at_us = 0;  ///< Since the recording began.
  std::uint16_t uid = 0;
  std::uint8_t status = 0;  ///< As `bt::Status`.
  friend bool operator==(const Record&, const Record&) = default;
};
void append_record(std::string& out, const Record& record);
/// Errors: groot.reply.
[[nodiscard]] Result<std::vector<Record>> parse_records(std::string_view body);

/// What is to happen around the ticks of a node.
struct Hook {
  enum class Mode : std::uint8_t { kBreakpoint = 0, kReplace = 1 };
  enum class Position : std::uint8_t { kBefore = 0, kAfter = 1 };
  std::uint16_t uid = 0;
  Position position = Position::kBefore;
  Mode mode = Mode::kBreakpoint;
  bt::Status desired = bt::Status::kSkipped;  ///< SUCCESS or FAILURE; SKIPPED: the node does what it does.
  bool once = false;
  bool enabled = true;
  friend bool operator==(const Hook&, const Hook&) = default;
};

/// One hook as JSON, or several. Errors: groot.hook, json.*.
[[nodiscard]] Result<std::vector<Hook>> parse_hooks(std::string_view json);
[[nodiscard]] std::string write_hooks(std::span<const Hook> hooks);

/// What a request about one hook names.
struct HookPlace {
  std::uint16_t uid = 0;
  Hook::Position position = Hook::Position::kBefore;
  bt::Status desired = bt::Status::kSkipped;  ///< kUnlock: what the node answers instead; SKIPPED: the truth.
  bool remove = false;                        ///< kUnlock: the breakpoint is gone then.
};
/// Errors: groot.hook, json.*.
[[nodiscard]] Result<HookPlace> parse_hook_place(std::string_view json);
[[nodiscard]] std::string write_hook_place(const HookPlace& place);

/// What is told when a hook is reached.
[[nodiscard]] Parts write_reached(std::uint32_t id, std::uint16_t uid);
/// The node; nothing: it is no such message.
[[nodiscard]] std::optional<std::uint16_t> parse_reached(const Parts& parts);

}  // namespace sentree::groot
