#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/scxml/plain.h"

namespace sentree::monitor {

/// Reads of observations, where they are, the members that plain steps need.
class Reader {
 public:
  Reader() = default;
  explicit Reader(const scxml::PlainPaths& paths);

  [[nodiscard]] std::size_t size() const { return places_.size(); }
  /// Fills `values`, as many as there are paths; texts are borrowed of the message.
  void read(const Message& message, scxml::PlainValue* values) const;
  /// The same; it remembers where members were, so that the next message of the kind is read more quickly.
  /// Valid until the next call.
  [[nodiscard]] const scxml::PlainValue* read(const Message& message);

 private:
  struct Place {
    enum class What : std::uint8_t { kSource, kTarget, kCall, kTick, kTime, kData };
    What what = What::kData;
    std::vector<std::string> members;
    std::vector<std::uint32_t> hint;
  };
  static scxml::PlainValue value(const Message& message, const Place& place, std::uint32_t* hint);

  std::vector<Place> places_;
  std::vector<scxml::PlainValue> values_;
};

}  // namespace sentree::monitor
