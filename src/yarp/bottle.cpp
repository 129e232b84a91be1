#include "sentree/yarp/detail/bottle.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>

#include "sentree/base/value.h"
#include "sentree/yarp/detail/inbox.h"
#include "sentree/yarp/detail/tags.h"

namespace sentree::yarp {
namespace {

constexpr std::string_view kPlainLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";

bool is_plain(std::string_view text) {
  if (text.empty() || text.find_first_not_of(kPlainLetters) != std::string_view::npos) return false;
  return text[0] < '0' || text[0] > '9';
}

void append(std::string& out, const std::vector<Item>& items);

void append(std::string& out, const Item& item) {
  switch (item.form) {
    case Item::Form::kInteger: out += std::to_string(item.integer); return;
    case Item::Form::kReal: out += shortest_decimal(item.real); return;
    case Item::Form::kVocab: out += fmt::format("[{}]", item.text); return;
    case Item::Form::kText:
      if (is_plain(item.text)) {
        out += item.text;
        return;
      }
      out += '"';
      for (const char c : item.text) {
        if (c == '"' || c == '\\') out += '\\';
        if (c == '\n')
          out += "\\n";
        else if (c == '\r')
          out += "\\r";
        else if (c == '\0')
          out += "\\0";
        else
          out += c;
      }
      out += '"';
      return;
    case Item::Form::kOctets: {
      out += '{';
      bool first = true;
      for (const char c : item.text) {
        out += (first ? "" : " ") + std::to_string(static_cast<unsigned char>(c));
        first = false;
      }
      out += '}';
      return;
    }
    case Item::Form::kList:
      out += '(';
      append(out, item.items);
      out += ')';
      return;
  }
}

void append(std::string& out, const std::vector<Item>& items) {
  bool first = true;
  for (const Item& item : items) {
    if (!first) out += ' ';
    first = false;
    append(out, item);
  }
}

class TextReader {
 public:
  explicit TextReader(std::string_view text) : rest_(text) {}

  Result<std::vector<Item>> read() {
    std::vector<Item> out;
    if (!items(out, '\0', 0)) return fail("yarp.bottle", "a bottle " + why_);
    return out;
  }

 private:
  bool wrong(std::string why) {
    why_ = std::move(why);
    return false;
  }

  bool items(std::vector<Item>& out, char end, int depth) {
    if (depth > kBottleNestingMax) return wrong("has lists nested too deep");
    while (true) {
      while (!rest_.empty() && (rest_[0] == ' ' || rest_[0] == '\t')) rest_.remove_prefix(1);
      if (rest_.empty()) return end == '\0' || wrong("lacks a closing bracket");
      const char c = rest_[0];
      if (c == end) {
        rest_.remove_prefix(1);
        return true;
      }
      if (++count_ > kBottleItemsMax) return wrong("has too many items");
      if (c == ')' || c == ']' || c == '}') return wrong("has a closing bracket too many");
      if (c == '(' || c == '[' || c == '{') {
        rest_.remove_prefix(1);
        Item& item = out.emplace_back();
        item.form = Item::Form::kList;
        if (!items(item.items, c == '(' ? ')' : c == '[' ? ']' : '}', depth + 1)) return false;
        if (c == '[') {
          if (item.items.size() != 1) return wrong("has a vocab of several words");
          item = Item::word(item.items[0].form == Item::Form::kText ? item.items[0].text
                                                                    : std::to_string(item.items[0].integer));
        } else if (c == '{') {
          std::string octets;
          for (const Item& each : item.items) octets += static_cast<char>(each.integer);
          item = Item{.form = Item::Form::kOctets, .text = std::move(octets)};
        }
        continue;
      }
      if (c == '"') {
        if (!quoted(out.emplace_back())) return false;
        continue;
      }
      const std::string_view word = rest_.substr(0, std::min(rest_.find_first_of(" \t()[]{}\""), rest_.size()));
      rest_.remove_prefix(word.size());
      out.push_back(of_word(word));
    }
  }

  bool quoted(Item& item) {
    rest_.remove_prefix(1);
    item.form = Item::Form::kText;
    while (!rest_.empty() && rest_[0] != '"') {
      char c = rest_[0];
      rest_.remove_prefix(1);
      if (c == '\\' && !rest_.empty()) {
        c = rest_[0] == 'n' ? '\n' : rest_[0] == 'r' ? '\r' : rest_[0];
        rest_.remove_prefix(1);
      }
      item.text += c;
    }
    if (rest_.empty()) return wrong("lacks a closing quote");
    rest_.remove_prefix(1);
    return true;
  }

  static Item of_word(std::string_view word) {
    Item item;
    const char* end = word.data() + word.size();
    if (auto read = std::from_chars(word.data(), end, item.integer); read.ec == std::errc() && read.ptr == end)
      return item;
    if ((word[0] >= '0' && word[0] <= '9') || word[0] == '-' || word[0] == '.') {
      if (auto read = std::from_chars(word.data(), end, item.real); read.ec == std::errc() && read.ptr == end) {
        item.form = Item::Form::kReal;
        return item;
      }
    }
    return Item::of(std::string(word));
  }

  std::string_view rest_;
  std::string why_;
  std::size_t count_ = 0;
};

std::uint32_t tag_of_item(const Item& item, Version version);

// What all items have in common; 0: nothing.
std::uint32_t common_tag(const std::vector<Item>& items, Version version) {
  if (items.empty()) return 0;
  const std::uint32_t tag = tag_of_item(items[0], version);
  const bool all = (tag & kList) == 0 && std::all_of(items.begin(), items.end(), [&](const Item& item) {
                     return tag_of_item(item, version) == tag;
                   });
  return all ? tag : 0;
}

std::uint32_t tag_of_item(const Item& item, Version version) {
  switch (item.form) {
    case Item::Form::kInteger: return item.integer == static_cast<std::int32_t>(item.integer) ? kInt32 : kInt64;
    case Item::Form::kReal: return version == Version::kYarp3 ? kReal10 : kReal20;
    case Item::Form::kVocab: return kVocab32;
    case Item::Form::kText: return kString;
    case Item::Form::kOctets: return kBlob;
    case Item::Form::kList: return kList | common_tag(item.items, version);
  }
  return 0;
}

void put_text(std::vector<std::uint8_t>& out, std::string_view text) {
  put_int(out, static_cast<std::int32_t>(text.size()));
  put(out, text);
}

template <class T>
void put_raw(std::vector<std::uint8_t>& out, T value) {
  const auto at = out.size();
  out.resize(at + sizeof value);
  std::memcpy(out.data() + at, &value, sizeof value);
}

void write_bare(std::vector<std::uint8_t>& out, const Item& item, std::uint32_t tag, Version version) {
  switch (item.form) {
    case Item::Form::kInteger:
      tag == kInt32 ? put_raw(out, static_cast<std::int32_t>(item.integer)) : put_raw(out, item.integer);
      return;
    case Item::Form::kReal: put_raw(out, item.real); return;
    case Item::Form::kVocab: put_int(out, vocab(item.text.c_str())); return;
    case Item::Form::kText:
    case Item::Form::kOctets: put_text(out, item.text); return;
    case Item::Form::kList: {
      const std::uint32_t common = tag & ~kList;
      put_int(out, static_cast<std::int32_t>(item.items.size()));
      for (const Item& each : item.items) {
        const std::uint32_t own = common != 0 ? common : tag_of_item(each, version);
        if (common == 0) put_int(out, static_cast<std::int32_t>(own));
        write_bare(out, each, own, version);
      }
      return;
    }
  }
}

template <class T>
T raw(Inbox& in) {
  T out{};
  std::memcpy(&out, in.take(sizeof out), sizeof out);
  return out;
}

class BinaryReader {
 public:
  BinaryReader(Inbox& in, Version version) : in_(in), version_(version) {}

  // A list with its own tag.
  std::vector<Item> whole(int depth) {
    const std::uint32_t tag = in_.take_tag();
    if ((tag & kList) == 0) throw Broken{rpc::StreamStatus::kFailed, "no bottle where one was due"};
    return list(tag & ~kList, depth);
  }

 private:
  std::vector<Item> list(std::uint32_t tag, int depth) {
    const std::int32_t count = in_.take_int();
    if (count < 0 || depth > kBottleNestingMax || (items_ += static_cast<std::size_t>(count)) > kBottleItemsMax)
      throw Broken{rpc::StreamStatus::kFailed, "a bottle is too large"};
    std::vector<Item> out;
    for (std::int32_t i = 0; i < count; ++i) out.push_back(item(tag != 0 ? tag : in_.take_tag(), depth));
    return out;
  }

  std::string text() {
    const std::int32_t size = in_.take_int();
    if (size < 0) throw Broken{rpc::StreamStatus::kFailed, "a text has a negative length"};
    const auto length = static_cast<std::size_t>(size);
    return {reinterpret_cast<const char*>(in_.take(length)), length};
  }

  Item real(double value) { return Item{.form = Item::Form::kReal, .real = value}; }

  Item item(std::uint32_t tag, int depth) {
    if ((tag & kList) != 0) return Item::list(list(tag & ~kList, depth + 1));
    switch (tag) {
      case kInt8: return Item::of(std::int64_t{raw<std::int8_t>(in_)});
      case kInt16: return Item::of(std::int64_t{raw<std::int16_t>(in_)});
      case kInt32: return Item::of(std::int64_t{raw<std::int32_t>(in_)});
      case kInt64: return Item::of(raw<std::int64_t>(in_));
      case kVocab32:
      case kVocab64: {
        const std::size_t size = tag == kVocab32 ? 4 : 8;
        const auto* bytes = reinterpret_cast<const char*>(in_.take(size));
        return Item::word(std::string(bytes, std::find(bytes, bytes + size, '\0')));
      }
      case kReal10: return real(version_ == Version::kYarp3 ? raw<double>(in_) : raw<float>(in_));
      case kReal20: return real(raw<double>(in_));
      case kReal128: return real(raw<float>(in_));
      case kString: return Item::of(text());
      case kBlob: return Item{.form = Item::Form::kOctets, .text = text()};
      case kDictionary: return Item::list(whole(depth + 1));
      default: throw Broken{rpc::StreamStatus::kFailed, fmt::format("an item has the unknown tag {}", tag)};
    }
  }

  Inbox& in_;
  const Version version_;
  std::size_t items_ = 0;
};

}  // namespace

Item Item::of(std::int64_t number) { return {.form = Form::kInteger, .integer = number}; }
Item Item::of(std::string text) { return {.form = Form::kText, .text = std::move(text)}; }
Item Item::word(std::string letters) { return {.form = Form::kVocab, .text = std::move(letters)}; }
Item Item::list(std::vector<Item> items) { return {.form = Form::kList, .items = std::move(items)}; }

std::string to_text(const std::vector<Item>& items) {
  std::string out;
  append(out, items);
  return out;
}

Result<std::vector<Item>> parse_text(std::string_view text) { return TextReader(text).read(); }

void write_bottle(std::vector<std::uint8_t>& out, const std::vector<Item>& items, Version version) {
  const Item whole = Item::list(items);
  const std::uint32_t tag = tag_of_item(whole, version);
  put_int(out, static_cast<std::int32_t>(tag));
  write_bare(out, whole, tag, version);
}

std::vector<Item> read_bottle(Inbox& in, Version version) { return BinaryReader(in, version).whole(0); }

}  // namespace sentree::yarp
