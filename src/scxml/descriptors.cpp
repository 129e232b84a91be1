#include "sentree/scxml/descriptors.h"

#include <algorithm>
#include <bit>

namespace sentree::scxml {
namespace {

constexpr std::uint32_t kHashStart = 2166136261U;

// FNV-1a: it can be stopped at each dot of a name, which gives the hash of every prefix in one pass.
std::uint32_t add_to_hash(std::uint32_t hash, char c) { return (hash ^ static_cast<unsigned char>(c)) * 16777619U; }

std::uint32_t hash_of(std::string_view name) {
  std::uint32_t hash = kHashStart;
  for (const char c : name) hash = add_to_hash(hash, c);
  return hash;
}

}  // namespace

DescriptorId DescriptorTable::add(std::string_view descriptor) {
  if (descriptor.ends_with(".*"))
    descriptor.remove_suffix(2);
  else if (descriptor.ends_with('.'))
    descriptor.remove_suffix(1);
  if ((names_.size() + 1) * 4 > table_.size()) grow();
  const std::uint32_t hash = hash_of(descriptor);
  const std::size_t place = find_slot(descriptor, hash);
  if (table_[place] != 0) return table_[place] - 1;
  const auto id = static_cast<DescriptorId>(names_.size());
  names_.emplace_back(descriptor);
  hashes_.push_back(hash);
  table_[place] = id + 1;
  if (descriptor == "*") star_ = id;
  return id;
}

void DescriptorTable::grow() {
  table_.assign(std::bit_ceil(names_.size() * 8 + 8), 0);
  for (DescriptorId id = 0; id < names_.size(); ++id) table_[find_slot(names_[id], hashes_[id])] = id + 1;
}

std::size_t DescriptorTable::find_slot(std::string_view name, std::uint32_t hash) const {
  const std::size_t mask = table_.size() - 1;
  for (std::size_t i = hash & mask;; i = (i + 1) & mask) {
    const std::uint32_t entry = table_[i];
    if (entry == 0 || (hashes_[entry - 1] == hash && names_[entry - 1] == name)) return i;
  }
}

void DescriptorTable::match(std::string_view event_name, Matches& matches) const {
  matches.count = 0;
  if (table_.empty()) return;
  if (star_ != 0xFFFFFFFFU) matches.ids[matches.count++] = star_;
  std::uint32_t hash = kHashStart;
  std::size_t begin = 0;
  while (matches.count < kMatchesMax) {
    const std::size_t end = std::min(event_name.find('.', begin), event_name.size());
    for (std::size_t i = begin; i < end; ++i) hash = add_to_hash(hash, event_name[i]);
    const std::uint32_t entry = table_[find_slot(event_name.substr(0, end), hash)];
    if (entry != 0 && entry - 1 != star_) matches.ids[matches.count++] = entry - 1;
    if (end == event_name.size()) return;
    hash = add_to_hash(hash, '.');
    begin = end + 1;
  }
}

}  // namespace sentree::scxml
