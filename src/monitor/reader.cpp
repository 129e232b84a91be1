#include "sentree/monitor/reader.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

namespace sentree::monitor {

Reader::Reader(const scxml::PlainPaths& paths) {
  // In the order of `Place::What`.
  constexpr std::array<std::string_view, 5> kFacts{"source", "target", "call", "tick", "time"};
  for (std::vector<std::string>& members : paths.members()) {
    Place place;
    place.members = std::move(members);
    // The facts of the message come before its data, as in `event_data`.
    const auto* fact = std::find(kFacts.begin(), kFacts.end(), place.members.front());
    place.what = static_cast<Place::What>(std::distance(kFacts.begin(), fact));
    place.hint.resize(place.members.size());
    places_.push_back(std::move(place));
  }
  values_.resize(places_.size());
}

scxml::PlainValue Reader::value(const Message& message, const Place& place, std::uint32_t* hint) {
  using What = Place::What;
  using scxml::PlainValue;
  if (place.what == What::kData) {
    if (message.data.as_map() != nullptr) return scxml::plain_member(&message.data, place.members, hint);
    return PlainValue::of(place.members.size() == 1 ? PlainValue::Kind::kUndefined : PlainValue::Kind::kUnknown);
  }
  if (place.members.size() > 1) return PlainValue::of(PlainValue::Kind::kUnknown);
  switch (place.what) {
    case What::kSource: return PlainValue::of(std::string_view(message.source));
    case What::kTarget: return PlainValue::of(std::string_view(message.target));
    case What::kCall: return PlainValue::of(static_cast<double>(static_cast<std::int64_t>(message.call)));
    case What::kTick: return PlainValue::of(static_cast<double>(static_cast<std::int64_t>(message.tick)));
    default: return PlainValue::of(seconds(message.time));
  }
}

void Reader::read(const Message& message, scxml::PlainValue* values) const {
  for (const Place& place : places_) *values++ = value(message, place, nullptr);
}

const scxml::PlainValue* Reader::read(const Message& message) {
  for (std::size_t i = 0; i < places_.size(); ++i) values_[i] = value(message, places_[i], places_[i].hint.data());
  return values_.data();
}

}  // namespace sentree::monitor
