#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include "sentree/base/value.h"
#include "sentree/design/text_edit.h"

namespace sentree::studio {

/// What a page asks, read leniently: what is not there is empty, 0 or false.
class AskedEdit {
 public:
  explicit AskedEdit(const Value& request) : request_(request) {}
  [[nodiscard]] std::string text(std::string_view name) const {
    const Value* value = request_.find(name);
    return value != nullptr && value->as_string() != nullptr ? *value->as_string() : std::string();
  }
  [[nodiscard]] bool has(std::string_view name) const {
    const Value* value = request_.find(name);
    return value != nullptr && !value->is_null();
  }
  [[nodiscard]] std::uint64_t count(std::string_view name) const { return count_of(request_.find(name)); }
  [[nodiscard]] double number(std::string_view name, double otherwise) const {
    const Value* value = request_.find(name);
    return value != nullptr && value->is_number() ? value->number() : otherwise;
  }
  [[nodiscard]] bool flag(std::string_view name) const {
    const Value* value = request_.find(name);
    return value != nullptr && value->as_bool() != nullptr && *value->as_bool();
  }
  [[nodiscard]] std::set<std::string> texts(std::string_view name) const {
    std::set<std::string> texts;
    const Value* list = request_.find(name);
    if (list == nullptr || list->as_list() == nullptr) return texts;
    for (const Value& text : *list->as_list()) texts.emplace(text.text());
    return texts;
  }
  [[nodiscard]] design::TextEdits edits() const {
    design::TextEdits edits;
    const Value* list = request_.find("edits");
    if (list == nullptr || list->as_list() == nullptr) return edits;
    for (const Value& edit : *list->as_list()) {
      const Value* text = edit.find("text");
      edits.push_back({count_of(edit.find("from")), count_of(edit.find("to")),
                       text != nullptr ? std::string(text->text()) : std::string()});
    }
    return edits;
  }
  [[nodiscard]] const Value* find(std::string_view name) const { return request_.find(name); }

 private:
  static std::uint64_t count_of(const Value* value) {
    constexpr double kExact = 9007199254740992.0;
    return value != nullptr && value->is_number() && value->number() >= 0 && value->number() <= kExact
               ? static_cast<std::uint64_t>(value->number())
               : 0;
  }
  const Value& request_;
};

}  // namespace sentree::studio
