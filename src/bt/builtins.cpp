#include <algorithm>
#include <span>

#include "sentree/bt/model.h"
#include "sentree/bt/nodes/all.h"
#include "sentree/bt/nodes/of_kind.h"

namespace sentree::bt {

const std::string_view kConditionNames[Conditions::kCount] = {"_failureIf", "_successIf", "_skipIf",    "_while",
                                                              "_onHalted",  "_onFailure", "_onSuccess", "_post"};

namespace {

constexpr std::uint32_t kAnyNumber = 0xFFFFFFFFU;

std::vector<Manifest> of_format(bool three) {
  std::vector<Manifest> all;
  nodes::each([&]<class T>(Kind kind) {
    for (BuiltIn& one : T::manifests()) {
      if (!(three ? one.in_format3 : one.in_format4)) continue;
      one.manifest.kind = kind;
      all.push_back(std::move(one.manifest));
    }
  });
  std::sort(all.begin(), all.end(), [](const Manifest& a, const Manifest& b) { return a.id < b.id; });
  for (Manifest& manifest : all) {
    // A port without a type takes part in no type check.
    for (PortInfo& port : manifest.ports) {
      if (port.type == &type_of<AnyType>()) port.type = nullptr;
    }
  }
  return all;
}

}  // namespace

Manifest control(std::string id, Ports ports) {
  Manifest m;
  m.id = std::move(id);
  m.category = Category::kControl;
  m.ports = std::move(ports);
  m.children_min = 1;
  m.children_max = kAnyNumber;
  return m;
}
Manifest decorator(std::string id, Ports ports) {
  Manifest m = control(std::move(id), std::move(ports));
  m.category = Category::kDecorator;
  m.children_max = 1;
  return m;
}
Manifest leaf(std::string id, Category category, Ports ports) {
  Manifest m = control(std::move(id), std::move(ports));
  m.category = category;
  m.children_min = m.children_max = 0;
  return m;
}

const std::vector<Manifest>& builtins(int format) {
  static const std::vector<Manifest> kFormat3 = of_format(true);
  static const std::vector<Manifest> kFormat4 = of_format(false);
  return format == 3 ? kFormat3 : kFormat4;
}

const Manifest* find_builtin(std::string_view id, int format) {
  const auto& all = builtins(format);
  const auto found = std::lower_bound(all.begin(), all.end(), id,
                                      [](const Manifest& m, std::string_view wanted) { return m.id < wanted; });
  return found != all.end() && found->id == id ? &*found : nullptr;
}

std::span<const Word> words(Kind kind) {
  return nodes::of_kind(kind, []<class T>() -> std::span<const Word> { return T::kWords; });
}

bool waits_for_writes(Kind kind) {
  return nodes::of_kind(kind, []<class T>() { return T::kWaitsForWrites; });
}

bool starts_timers(Kind kind) {
  return nodes::of_kind(kind, []<class T>() { return T::kStartsTimers; });
}

std::uint32_t memory_words(Kind kind, std::uint32_t child_count) {
  const std::uint32_t more = nodes::of_kind(kind, [&]<class T>() { return T::more_words(child_count); });
  return static_cast<std::uint32_t>(words(kind).size()) + more;
}

}  // namespace sentree::bt
