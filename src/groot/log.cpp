#include "sentree/groot/log.h"

#include <algorithm>

#include "sentree/groot/detail/bytes.h"
#include "sentree/groot/groot1.h"
#include "sentree/groot/groot2.h"
#include "sentree/groot/image.h"

namespace sentree::groot {

namespace {

// Of the first stop of Groot 1's slider.
constexpr std::int64_t kFirstStopUs = 1'000;

std::int64_t micros(TimePoint time) { return time.time_since_epoch().count() / 1000; }

}  // namespace

Result<std::string> write_btlog(const bt::Tree& tree, std::span<const Transition> transitions, std::int64_t began_us) {
  const auto image = describe(tree);
  if (!image) return tl::unexpected(image.error());
  std::string out = "BTCPP4-FileLogger2";
  out += '\x01';
  put(out, image->xml.size(), 4);
  out += image->xml;
  put(out, static_cast<std::uint64_t>(began_us), 8);
  for (const Transition& transition : transitions)
    append_record(out, {micros(transition.time), uid_of(transition.node), static_cast<std::uint8_t>(transition.to)});
  return out;
}

Result<std::string> write_fbl(const bt::Tree& tree, std::span<const Transition> transitions, std::int64_t began_us) {
  const auto image = describe(tree);
  if (!image) return tl::unexpected(image.error());
  const std::int64_t origin_us = std::max(began_us, kFirstStopUs);
  std::string out;
  put(out, image->flat.size(), 4);
  out += image->flat;
  for (const Transition& transition : transitions)
    append_change(out, *image, {origin_us + micros(transition.time), transition.node, transition.from, transition.to});
  return out;
}

}  // namespace sentree::groot
