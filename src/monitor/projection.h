#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/scxml/chart.h"

namespace sentree::monitor {

/// The members of an observation that charts look at, so that the others need not be copied for them.
class Projection {
 public:
  /// What the expressions of `chart` name of `_event.data`. Everything, if one of them uses `_event` in another way.
  [[nodiscard]] static Projection of(const scxml::Chart& chart);

  [[nodiscard]] bool is_whole() const { return whole_; }
  void make_whole() { whole_ = true; }
  void add(const Projection& other);
  /// A member of the event's data, with all that is in it.
  void add_member(std::string_view name) { add_path(members_, name); }
  /// As `event_data`, without what nobody looks at.
  [[nodiscard]] Value data(const Message& message) const;
  /// Appends octets that are equal for two messages of one source and target if, and only if, their `data` is. Cheaper
  /// than to make it. Only if it is not the whole.
  void encode(const Message& message, std::string& out) const;
  /// Whether nobody looks at anything but the event's name.
  [[nodiscard]] bool is_empty() const { return !whole_ && members_.empty(); }

 private:
  struct Member {
    std::string name;
    bool whole = false;
    std::vector<Member> members;
  };
  static void add_path(std::vector<Member>& members, std::string_view path);
  static void merge(std::vector<Member>& into, const std::vector<Member>& from);
  // What is there of it beside each other, and else, with nothing in it: it is given as it is.
  static const Map* cuttable(const Value& value, const Member& member);
  static Value cut(const Value& value, const Member& member);
  static void encode(const Value& value, const Member& member, std::string& out);
  void scan(std::string_view expression);

  bool whole_ = false;
  std::vector<Member> members_;
};

}  // namespace sentree::monitor
