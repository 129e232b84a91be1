#include "sentree/groot/groot2.h"

#include <fmt/format.h>

#include <charconv>

#include "sentree/base/json.h"
#include "sentree/groot/detail/bytes.h"
#include "sentree/text/json.h"

namespace sentree::groot {

namespace {

constexpr std::uint8_t kProtocol = 2;
constexpr std::size_t kHeaderBytes = 6;
constexpr std::string_view kErrorPart = "error";
constexpr std::string_view kAsks = "TSBIRUDAXrt";

std::string header(char type, std::uint32_t id) {
  std::string out;
  put(out, kProtocol, 1);
  out += type;
  put(out, id, 4);
  return out;
}

bool takes_body(Ask type) {
  return type == Ask::kBlackboard || type == Ask::kInsertHook || type == Ask::kRemoveHook || type == Ask::kUnlock ||
         type == Ask::kRecording;
}

tl::unexpected<Diagnostic> refuse(std::string message) { return fail("groot.request", std::move(message)); }
tl::unexpected<Diagnostic> no_reply(std::string message) { return fail("groot.reply", std::move(message)); }

// The members of a hook, each with a message that names what is wrong.
class Members {
 public:
  explicit Members(const Value& value) : value_(value) {}

  Result<std::uint64_t> number(const char* name, std::uint64_t max) const {
    const Value* found = value_.find(name);
    if (found != nullptr && found->as_int() != nullptr && *found->as_int() >= 0 &&
        static_cast<std::uint64_t>(*found->as_int()) <= max)
      return static_cast<std::uint64_t>(*found->as_int());
    return wrong(name, fmt::format("a whole number from 0 to {}", max));
  }
  Result<bool> flag(const char* name) const {
    const Value* found = value_.find(name);
    if (found != nullptr && found->as_bool() != nullptr) return *found->as_bool();
    return wrong(name, "true or false");
  }
  Result<bt::Status> desired() const {
    const Value* found = value_.find("desired_status");
    const auto status = found != nullptr ? bt::parse_status(found->text()) : std::nullopt;
    if (status && (bt::is_completed(*status) || *status == bt::Status::kSkipped)) return *status;
    return wrong("desired_status", "SUCCESS, FAILURE or SKIPPED");
  }

 private:
  static tl::unexpected<Diagnostic> wrong(const char* name, const std::string& what) {
    return fail("groot.hook", fmt::format("a hook's \"{}\" must be {}", name, what));
  }
  const Value& value_;
};

Result<Hook> hook_of(const Value& value) {
  const Members members(value);
  const auto uid = members.number("uid", 0xFFFF);
  if (!uid) return tl::unexpected(uid.error());
  const auto position = members.number("position", 1);
  if (!position) return tl::unexpected(position.error());
  const auto mode = members.number("mode", 1);
  if (!mode) return tl::unexpected(mode.error());
  const auto desired = members.desired();
  if (!desired) return tl::unexpected(desired.error());
  const auto once = members.flag("once");
  if (!once) return tl::unexpected(once.error());
  const auto enabled = members.flag("enabled");
  if (!enabled) return tl::unexpected(enabled.error());
  return Hook{.uid = static_cast<std::uint16_t>(*uid),
              .position = static_cast<Hook::Position>(*position),
              .mode = static_cast<Hook::Mode>(*mode),
              .desired = *desired,
              .once = *once,
              .enabled = *enabled};
}

}  // namespace

Result<Request> parse_request(const Parts& parts) {
  if (parts.empty() || parts[0].size() != kHeaderBytes) return refuse("wrong request header");
  Request request;
  if (kAsks.find(parts[0][1]) == std::string_view::npos) return refuse("Request not recognized");
  request.type = static_cast<Ask>(parts[0][1]);
  request.id = static_cast<std::uint32_t>(take(parts[0], 2, 4));
  request.has_body = parts.size() > 1;
  if (request.has_body) request.body = parts[1];
  if (takes_body(request.type) && !request.has_body) return refuse("must be 2 parts message");
  return request;
}

Parts write_request(const Request& request) {
  Parts parts{header(static_cast<char>(request.type), request.id)};
  if (request.has_body) parts.push_back(request.body);
  return parts;
}

Parts write_reply(const Request& request, const TreeId& tree, std::optional<std::string> body) {
  Parts parts{header(static_cast<char>(request.type), request.id)};
  parts[0].append(reinterpret_cast<const char*>(tree.data()), tree.size());
  if (body) parts.push_back(std::move(*body));
  return parts;
}

Parts write_error(std::string_view text) { return {std::string(kErrorPart), std::string(text)}; }

Result<Reply> parse_reply(const Request& request, const Parts& parts) {
  Reply reply;
  if (!parts.empty() && parts[0] == kErrorPart)
    return fail("groot.refused", "the publisher refuses: " + (parts.size() > 1 ? parts[1] : std::string("no reason")));
  if (parts.empty() || parts[0].size() != kHeaderBytes + reply.tree.size())
    return no_reply("what answers is no publisher of Groot 2");
  // Whatever version of the protocol it says: the answers are the same.
  if (parts[0].substr(1, kHeaderBytes - 1) != header(static_cast<char>(request.type), request.id).substr(1))
    return no_reply("the publisher answers another request");
  for (std::size_t i = 0; i < reply.tree.size(); ++i)
    reply.tree[i] = static_cast<std::uint8_t>(parts[0][kHeaderBytes + i]);
  if (parts.size() > 1) reply.body = parts[1];
  return reply;
}

StatusCode next_code(StatusCode code, bt::Status to) {
  if (to != bt::Status::kIdle) return static_cast<StatusCode>(to);
  if (code == 0 || code >= kIdleAfter) return code;
  return static_cast<StatusCode>(kIdleAfter + code);
}

std::string write_statuses(std::span<const NodeStatus> statuses) {
  std::string out;
  out.reserve(3 * statuses.size());
  for (const NodeStatus& status : statuses) {
    put(out, status.uid, 2);
    put(out, status.code, 1);
  }
  return out;
}

Result<std::vector<NodeStatus>> parse_statuses(std::string_view body) {
  if (body.size() % 3 != 0) return no_reply("the statuses are cut off");
  std::vector<NodeStatus> statuses;
  for (std::size_t at = 0; at < body.size(); at += 3)
    statuses.push_back({static_cast<std::uint16_t>(take(body, at, 2)), static_cast<StatusCode>(take(body, at + 2, 1))});
  return statuses;
}

void append_record(std::string& out, const Record& record) {
  put(out, static_cast<std::uint64_t>(record.at_us), 6);
  put(out, record.uid, 2);
  put(out, record.status, 1);
}

Result<std::vector<Record>> parse_records(std::string_view body) {
  constexpr std::size_t kBytes = 9;
  if (body.size() % kBytes != 0) return no_reply("the recorded changes are cut off");
  std::vector<Record> records;
  for (std::size_t at = 0; at < body.size(); at += kBytes)
    records.push_back({static_cast<std::int64_t>(take(body, at, 6)), static_cast<std::uint16_t>(take(body, at + 6, 2)),
                       static_cast<std::uint8_t>(take(body, at + 8, 1))});
  return records;
}

Result<std::vector<Hook>> parse_hooks(std::string_view json) {
  const auto value = text::parse_json(json);
  if (!value) return tl::unexpected(value.error());
  std::vector<Hook> hooks;
  const List alone{*value};
  for (const Value& one : value->as_list() != nullptr ? *value->as_list() : alone) {
    const auto hook = hook_of(one);
    if (!hook) return tl::unexpected(hook.error());
    hooks.push_back(*hook);
  }
  return hooks;
}

std::string write_hooks(std::span<const Hook> hooks) {
  List list;
  for (const Hook& hook : hooks) {
    list.push_back(Map{{"desired_status", bt::to_string(hook.desired)},
                       {"enabled", hook.enabled},
                       {"mode", static_cast<int>(hook.mode)},
                       {"once", hook.once},
                       {"position", static_cast<int>(hook.position)},
                       {"uid", static_cast<int>(hook.uid)}});
  }
  return to_json(Value(std::move(list)));
}

Result<HookPlace> parse_hook_place(std::string_view json) {
  const auto value = text::parse_json(json);
  if (!value) return tl::unexpected(value.error());
  const Members members(*value);
  const auto uid = members.number("uid", 0xFFFF);
  if (!uid) return tl::unexpected(uid.error());
  const auto position = members.number("position", 1);
  if (!position) return tl::unexpected(position.error());
  HookPlace place{.uid = static_cast<std::uint16_t>(*uid), .position = static_cast<Hook::Position>(*position)};
  if (value->find("desired_status") != nullptr) {
    const auto desired = members.desired();
    if (!desired) return tl::unexpected(desired.error());
    place.desired = *desired;
  }
  if (value->find("remove_when_done") != nullptr) {
    const auto remove = members.flag("remove_when_done");
    if (!remove) return tl::unexpected(remove.error());
    place.remove = *remove;
  }
  return place;
}

std::string write_hook_place(const HookPlace& place) {
  return to_json(Value(Map{{"desired_status", bt::to_string(place.desired)},
                           {"position", static_cast<int>(place.position)},
                           {"remove_when_done", place.remove},
                           {"uid", static_cast<int>(place.uid)}}));
}

Parts write_reached(std::uint32_t id, std::uint16_t uid) {
  return {header(static_cast<char>(Ask::kReached), id), std::to_string(uid)};
}

std::optional<std::uint16_t> parse_reached(const Parts& parts) {
  if (parts.size() != 2 || parts[0].size() != kHeaderBytes || parts[0][1] != static_cast<char>(Ask::kReached))
    return std::nullopt;
  std::uint16_t uid = 0;
  const auto [end, error] = std::from_chars(parts[1].data(), parts[1].data() + parts[1].size(), uid);
  if (error != std::errc() || end != parts[1].data() + parts[1].size()) return std::nullopt;
  return uid;
}

}  // namespace sentree::groot
