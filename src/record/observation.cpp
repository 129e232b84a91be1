#include "sentree/record/observation.h"

#include <charconv>
#include <cstring>
#include <system_error>

#include <fmt/format.h>

#include "sentree/base/json.h"
#include "sentree/record/detail/print.h"
#include "sentree/text/json.h"

namespace sentree::record {

namespace {

using detail::append_integer;
using detail::append_seconds;

std::optional<MessageKind> kind_of(std::string_view text) {
  for (const MessageKind kind :
       {MessageKind::kRequest, MessageKind::kReply, MessageKind::kError, MessageKind::kEvent}) {
    if (to_string(kind) == text) return kind;
  }
  return std::nullopt;
}

std::uint64_t unsigned_member(const Value& value, std::string_view key) {
  const Value* member = value.find(key);
  const std::int64_t* number = member != nullptr ? member->as_int() : nullptr;
  return number != nullptr && *number > 0 ? static_cast<std::uint64_t>(*number) : 0;
}

std::string text_member(const Value& value, std::string_view key) {
  const Value* member = value.find(key);
  return member != nullptr ? std::string(member->text()) : std::string();
}

// What every observation has, before its texts and the data that are particular to it. `Number` and `Size` are as wide
// as they must be.
template <class Number, class Size>
struct Facts {
  TimePoint time{};
  Number sequence = 0;
  Number stamp = 0;
  Number call = 0;
  Number tick = 0;
  MessageKind kind = MessageKind::kEvent;
  bool has_data = false;
  // Sizes of texts.
  Size source = 0;
  Size target = 0;
  Size name = 0;
};
using WideFacts = Facts<std::uint64_t, std::uint32_t>;
using SlimFacts = Facts<std::uint32_t, std::uint8_t>;

template <class Which>
Which facts_of(const Message& message) {
  using Number = decltype(Which::sequence);
  using Size = decltype(Which::source);
  return {.time = message.time,
          .sequence = static_cast<Number>(message.sequence),
          .stamp = static_cast<Number>(message.stamp),
          .call = static_cast<Number>(message.call),
          .tick = static_cast<Number>(message.tick),
          .kind = message.kind,
          .has_data = !message.data.is_null(),
          .source = static_cast<Size>(message.source.size()),
          .target = static_cast<Size>(message.target.size()),
          .name = static_cast<Size>(message.name.size())};
}

bool is_slim(const Message& message) {
  return ((message.sequence | message.stamp | message.call | message.tick) >> 32U) == 0 &&
         (message.source.size() | message.target.size() | message.name.size()) < 256;
}

// The object stays open for its data, if it has some.
template <class Which>
void append_facts(std::string& out, const Which& facts, std::string_view source, std::string_view target,
                  std::string_view name) {
  out += R"({"sequence":)";
  append_integer(out, facts.sequence);
  out += R"(,"time":)";
  append_seconds(out, facts.time);
  out += R"(,"stamp":)";
  append_integer(out, facts.stamp);
  out += R"(,"kind":")";
  out += to_string(facts.kind);
  out += R"(","source":)";
  append_json_string(out, source);
  if (!target.empty()) {
    out += R"(,"target":)";
    append_json_string(out, target);
  }
  out += R"(,"name":)";
  append_json_string(out, name);
  if (facts.call != 0) {
    out += R"(,"call":)";
    append_integer(out, facts.call);
  }
  out += R"(,"tick":)";
  append_integer(out, facts.tick);
  out += facts.has_data ? R"(,"data":)" : "}";
}

template <class Which>
void pack_facts(PackedJson& out, const Message& message) {
  const auto facts = facts_of<Which>(message);
  char* to = out.later(
      [](std::string& json, std::string_view bytes) {
        Which packed;
        std::memcpy(&packed, bytes.data(), sizeof packed);
        bytes.remove_prefix(sizeof packed);
        const std::string_view source = bytes.substr(0, packed.source);
        const std::string_view target = bytes.substr(packed.source, packed.target);
        append_facts(json, packed, source, target, bytes.substr(packed.source + packed.target));
      },
      sizeof facts + message.source.size() + message.target.size() + message.name.size());
  const auto put = [&to](const void* bytes, std::size_t size) {
    std::memcpy(to, bytes, size);
    to += size;
  };
  put(&facts, sizeof facts);
  put(message.source.data(), message.source.size());
  put(message.target.data(), message.target.size());
  put(message.name.data(), message.name.size());
}

// Takes what `append_facts` writes off a text, as long as it is there.
class HeadScanner {
 public:
  explicit HeadScanner(std::string_view json) : rest_(json) {}

  bool skip(std::string_view expected) {
    if (!rest_.starts_with(expected)) return false;
    rest_.remove_prefix(expected.size());
    return true;
  }
  bool number(std::uint64_t& to) {
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), to);
    if (error != std::errc()) return false;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return true;
  }
  // A text that stands for itself.
  bool text(std::string_view& to) {
    if (!skip("\"")) return false;
    const std::size_t end = rest_.find('"');
    if (end == std::string_view::npos) return false;
    to = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return to.find('\\') == std::string_view::npos;
  }
  // Anything up to a comma.
  bool skip_number() {
    const std::size_t end = rest_.find(',');
    if (end == std::string_view::npos) return false;
    rest_.remove_prefix(end);
    return true;
  }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

}  // namespace

std::optional<ObservationHead> observation_head(std::string_view json) {
  HeadScanner from(json);
  ObservationHead head;
  std::string_view kind;
  if (!from.skip(R"({"sequence":)") || !from.number(head.sequence) || !from.skip(R"(,"time":)") ||
      !from.skip_number() || !from.skip(R"(,"stamp":)") || !from.number(head.stamp) || !from.skip(R"(,"kind":)") ||
      !from.text(kind) || !from.skip(R"(,"source":)") || !from.text(head.source)) {
    return std::nullopt;
  }
  if (from.skip(R"(,"target":)") && !from.text(head.target)) return std::nullopt;
  if (!from.skip(R"(,"name":)") || !from.text(head.name)) return std::nullopt;
  if (from.skip(R"(,"call":)") && !from.number(head.call)) return std::nullopt;
  if (!from.skip(R"(,"tick":)") || !from.number(head.tick)) return std::nullopt;
  const auto known = kind_of(kind);
  if (!known) return std::nullopt;
  head.kind = *known;
  if (from.rest() == "}") return head;
  if (!from.skip(R"(,"data":)") || !from.rest().ends_with('}')) return std::nullopt;
  head.data = from.rest();
  head.data.remove_suffix(1);
  return head;
}

void append_observation(std::string& out, const Message& message) {
  append_facts(out, facts_of<WideFacts>(message), message.source, message.target, message.name);
  if (message.data.is_null()) return;
  append_json(out, message.data);
  out += '}';
}

void pack_observation(PackedJson& out, const Message& message) {
  if (is_slim(message))
    pack_facts<SlimFacts>(out, message);
  else
    pack_facts<WideFacts>(out, message);
  if (message.data.is_null()) return;
  out.value(message.data);
  out.mark('}');
}

Result<Message> read_observation(const RawMessage& recorded) {
  auto read = text::parse_json(recorded.data);
  if (!read) return tl::unexpected(read.error());
  const auto kind = kind_of(text_member(*read, "kind"));
  if (!kind || read->find("name") == nullptr)
    return fail("record.not-an-observation", fmt::format("a message of {} is no observation", kObservationsTopic));
  Message message;
  message.sequence = unsigned_member(*read, "sequence");
  message.time = TimePoint(Duration(static_cast<std::int64_t>(recorded.log_time)));
  message.stamp = unsigned_member(*read, "stamp");
  message.kind = *kind;
  message.source = text_member(*read, "source");
  message.target = text_member(*read, "target");
  message.name = text_member(*read, "name");
  message.call = unsigned_member(*read, "call");
  message.tick = unsigned_member(*read, "tick");
  if (Value* data = read->as_map()->find("data")) message.data = with_bytes(std::move(*data));
  return message;
}

}  // namespace sentree::record
