#include "sentree/groot/groot1.h"

#include "sentree/groot/detail/bytes.h"

namespace sentree::groot {

namespace {

std::uint64_t number_of(bt::Status status) {
  return static_cast<std::uint64_t>(status == bt::Status::kSkipped ? bt::Status::kIdle : status);
}

std::uint64_t wire_uid(const TreeImage& image, bt::NodeId node) { return std::uint64_t{image.base} + node + 1; }

}  // namespace

void append_change(std::string& out, const TreeImage& image, const Change& change) {
  const auto at = static_cast<std::uint64_t>(change.at_us);
  put(out, at / 1'000'000, 4);
  put(out, at % 1'000'000, 4);
  put(out, wire_uid(image, change.node), 2);
  put(out, number_of(change.from), 1);
  put(out, number_of(change.to), 1);
}

std::string groot1_tree(const TreeImage& image, std::span<const bt::Status> statuses) {
  std::string out = image.flat;
  for (std::size_t node = 0; node < image.nodes; ++node)
    out[image.status_at[node]] = static_cast<char>(number_of(statuses[node]));
  return out;
}

std::string groot1_update(const TreeImage& image, std::span<const bt::Status> before, std::span<const Change> changes) {
  std::string out;
  out.reserve(8 + 3 * before.size() + 12 * changes.size());
  put(out, 3 * before.size(), 4);
  for (std::size_t node = 0; node < before.size(); ++node) {
    put(out, wire_uid(image, static_cast<bt::NodeId>(node)), 2);
    put(out, number_of(before[node]), 1);
  }
  put(out, changes.size(), 4);
  for (const Change& change : changes) append_change(out, image, change);
  return out;
}

}  // namespace sentree::groot
