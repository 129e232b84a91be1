// Whatever is done to a file, the edit is least and its undoing restores identical bytes. Trees: tree_edit_test.cpp.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <utility>
#include <variant>

#include "sentree/design/chart_edit.h"
#include "sentree/design/requirement_edit.h"
#include "sentree/design/yaml_gesture.h"
#include "sentree/scxml/chart.h"
#include "sentree/text/file.h"
#include "sentree/text/yaml.h"

namespace sentree::design {
namespace {

namespace fs = std::filesystem;

constexpr int kGestures = 200;
constexpr int kTriesMax = 4'000;
/// A text that has grown by so much is taken a step back, so that the test ends.
constexpr std::size_t kGrowthMax = 8'000;

std::vector<fs::path> example_files(const std::function<bool(const fs::path&)>& wanted) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(SENTREE_SOURCE_DIR) / "examples")) {
    const std::string path = entry.path().generic_string();
    if (entry.is_regular_file() && path.find("/runs/") == std::string::npos && wanted(entry.path()))
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// What a gesture may touch: an edit lies in one of these stretches of the text, ends included.
struct Stretch {
  std::size_t from = 0;
  std::size_t to = 0;
};
struct Tried {
  Result<GestureResult> result;
  std::vector<Stretch> may_touch;  // empty: anything
};
using Try = std::function<Tried(const std::string& now, std::mt19937& random)>;
using Reads = std::function<bool(const std::string& text)>;

// Gestures in a row, then all of them undone.
void edits_and_undoes(const fs::path& file, const Try& any_gesture, const Reads& is_read, std::uint32_t seed,
                      int gestures) {
  SCOPED_TRACE(file.string() + ", seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::string original = text::read_file(file).value();
  if (!is_read(original)) return;  // some examples are broken on purpose
  std::string now = original;
  std::vector<TextEdits> back;
  int done = 0;
  for (int tried = 0; done < gestures && tried < kTriesMax; ++tried) {
    const Tried gesture = any_gesture(now, random);
    if (!gesture.result) {
      ASSERT_FALSE(gesture.result.error().message.empty());
      continue;
    }
    SCOPED_TRACE(gesture.result->name);
    const TextEdits& edits = gesture.result->edits;
    ASSERT_FALSE(edits.empty());
    ASSERT_FALSE(gesture.result->name.empty());
    for (const TextEdit& edit : edits) {
      // Nothing is written that is there already: the edit begins and ends with what differs.
      const std::string_view old = std::string_view(now).substr(edit.from, edit.to - edit.from);
      if (!old.empty() && !edit.text.empty()) {
        ASSERT_FALSE(old == edit.text);
        ASSERT_TRUE(old.front() != edit.text.front() || old.back() != edit.text.back()) << old << " -> " << edit.text;
      }
      if (gesture.may_touch.empty()) continue;
      const bool inside = std::any_of(gesture.may_touch.begin(), gesture.may_touch.end(), [&](const Stretch& part) {
        return edit.from >= part.from && edit.to <= part.to;
      });
      ASSERT_TRUE(inside) << edit.from << " to " << edit.to << ": " << old << " -> " << edit.text;
    }
    const std::string after = with_edits(now, edits).value();
    ASSERT_TRUE(is_read(after)) << after;
    back.push_back(inverse(now, edits));
    ASSERT_EQ(with_edits(after, back.back()).value(), now);
    now = after;
    ++done;
    if (now.size() > original.size() + kGrowthMax || now.size() + kGrowthMax < original.size() ||
        (random() % 8 == 0 && now.size() < original.size() / 2)) {
      now = with_edits(now, back.back()).value();
      back.pop_back();
    }
  }
  EXPECT_GT(done, 0);
  for (; !back.empty(); back.pop_back()) now = with_edits(now, back.back()).value();
  ASSERT_EQ(now, original);
}

// Two hundred gestures in the files of each example together.
void edits_and_undoes_all(const std::vector<fs::path>& files, const Try& any_gesture, const Reads& is_read,
                          std::uint32_t seed) {
  const auto example_of = [](const fs::path& file) {
    return *file.lexically_relative(fs::path(SENTREE_SOURCE_DIR) / "examples").begin();
  };
  std::map<fs::path, int> in_example;
  for (const auto& file : files) ++in_example[example_of(file)];
  for (const auto& file : files) {
    const int count = in_example[example_of(file)];
    edits_and_undoes(file, any_gesture, is_read, seed, (kGestures + count - 1) / count);
    if (testing::Test::HasFatalFailure()) return;
  }
}

template <class T>
const T& any_of(const std::vector<T>& list, std::mt19937& random) {
  return list[random() % list.size()];
}

Loaded<scxml::Chart> chart_of(const std::string& text) {
  scxml::LoadOptions options;
  options.read = [](std::string_view) -> Result<std::string> { return std::string(); };
  return scxml::load(text, {}, options);
}

// Any place where something is done, and how much is done there.
std::pair<ActionPlace, std::size_t> any_place(const scxml::Chart& chart, const ChartParts& parts,
                                              std::mt19937& random) {
  const auto state = static_cast<scxml::StateIndex>(random() % chart.states().size());
  const auto transition =
      static_cast<scxml::TransitionIndex>(random() % std::max<std::size_t>(chart.transitions().size(), 1));
  switch (random() % 4) {
    case 0: return {{std::nullopt, chart.states()[state].id, "onentry"}, parts.states[state].onentry.size()};
    case 1: return {{std::nullopt, chart.states()[state].id, "onexit"}, parts.states[state].onexit.size()};
    case 2: return {{std::nullopt, "", "datamodel"}, parts.data.size()};
    default:
      return {{transition, "", ""},
              transition < parts.transitions.size() ? parts.transitions[transition].actions.size() : 0};
  }
}

TEST(Gestures, OfChartsEditLeastAndUndoToIdenticalBytes) {
  const auto seed = std::random_device()();
  const auto files = example_files([](const fs::path& path) { return path.extension() == ".scxml"; });
  ASSERT_GE(files.size(), 30U);
  const std::vector<std::string> kinds{"state", "parallel", "final", "history", "deep-history"};
  int fresh = 0;
  std::map<std::size_t, int> done;  // by kind of gesture
  const Try any_gesture = [&](const std::string& now, std::mt19937& random) -> Tried {
    const auto chart = chart_of(now);
    const ChartParts parts = parts_of(*chart.value);
    std::vector<std::string> ids{""};
    for (const scxml::State& state : chart.value->states()) {
      if (!state.id.empty()) ids.push_back(state.id);
    }
    const std::string state = ids.size() > 1 ? ids[1 + random() % (ids.size() - 1)] : "";
    const std::string inside = any_of(ids, random);
    const std::string id = "s" + std::to_string(++fresh);
    std::vector<std::string> some;
    std::string copied;
    for (const scxml::State& one : chart.value->states()) {
      if (one.id.empty() || random() % 4 != 0) continue;
      some.push_back(one.id);
      const auto& part = parts.states[*chart.value->find(one.id)];
      if (copied.empty()) copied = now.substr(part.from, part.to - part.from);
    }
    const auto transition =
        static_cast<scxml::TransitionIndex>(random() % std::max<std::size_t>(chart.value->transitions().size(), 1));
    const auto [place, count] = any_place(*chart.value, parts, random);
    const std::size_t index = random() % (count + 1);
    const std::string action = place.block == "datamodel" ? "<data id=\"" + id + "\" expr=\"1\"/>"
                               : random() % 2 == 0        ? "<raise event=\"" + id + "\"/>"
                                                          : "<if cond=\"true\">\n  <log expr=\"'a'\"/>\n</if>";
    const auto maybe = [&](const std::string& text) {
      return random() % 2 == 0 ? std::optional<std::string>() : std::optional(random() % 3 == 0 ? "" : text);
    };
    const std::vector<ChartGesture> gestures{
        RenameState{state, id},
        RemoveState{state},
        AddState{inside, id, any_of(kinds, random)},
        MoveState{state, inside},
        WrapState{state, id, random() % 2 == 0 ? "state" : "parallel"},
        EditStates{some, RemoveState{}},
        EditStates{some, MoveState{"", inside}},
        EditStates{some, WrapState{"", id}},
        PasteStates{inside, copied},
        SetKind{state, any_of(kinds, random)},
        SetInitial{state},
        AddTransition{state, inside, random() % 2 == 0 ? "tick" : "", random() % 2 == 0 ? "a < b && c" : "true"},
        AddTransition{state, id, "tick", "", true},
        SetTransition{transition, maybe("event." + id), maybe("x > 1 || \"'\""), maybe(state)},
        RemoveTransition{transition},
        MoveTransition{transition, state, random() % 4},
        InsertAction{place, index, action},
        SetAction{place, index, action},
        RemoveAction{place, index},
        MoveAction{place, index, random() % (count + 1)}};
    const ChartGesture& gesture = any_of(gestures, random);
    Tried tried{edit_chart(now, gesture), {}};
    if (tried.result) ++done[gesture.index()];
    return tried;
  };
  const Reads is_read = [](const std::string& text) { return chart_of(text).value.has_value(); };
  edits_and_undoes_all(files, any_gesture, is_read, seed);
  EXPECT_EQ(done.size(), std::variant_size_v<ChartGesture>) << "each kind has been done";
}

TEST(Gestures, OfRequirementsEditOnlyTheirSentenceAndUndoToIdenticalBytes) {
  const auto seed = std::random_device()();
  const auto files = example_files([](const fs::path& path) { return path.extension() == ".req"; });
  ASSERT_GE(files.size(), 5U);
  const std::vector<std::string> scopes{"globally", "before", "after", "between", "after-until", "while"};
  const std::vector<std::string> bounds{"3 s", "10 ticks", "1500 ms"};
  const Try any_gesture = [&](const std::string& now, std::mt19937& random) -> Tried {
    const auto sentences = sentences_of(now);
    const Sentence& sentence = any_of(*sentences, random);
    const std::vector<Stretch> inside{{sentence.from, now.find('.', sentence.to) + 1}};
    switch (random() % 4) {
      case 0: return {edit_requirement(now, SetScope{sentence.name, any_of(scopes, random)}), inside};
      case 1: return {edit_requirement(now, SetPattern{sentence.name, any_of(patterns(), random)}), inside};
      default: {
        if (sentence.parts.empty()) return {edit_requirement(now, SetScope{sentence.name, "globally"}), inside};
        const SentencePart& part = any_of(sentence.parts, random);
        const std::string text = part.part == "bound"   ? any_of(bounds, random)
                                 : part.part == "times" ? std::to_string(1 + random() % 5)
                                 : random() % 2 == 0    ? "true"
                                                        : "not (" + part.text + ")";
        return {edit_requirement(now, SetPart{sentence.name, part.part, text}), inside};
      }
    }
  };
  const Reads is_read = [](const std::string& text) {
    const auto sentences = sentences_of(text);
    return sentences && !sentences->empty();
  };
  edits_and_undoes_all(files, any_gesture, is_read, seed);
}

// Ways to the values of a document, and to its sequences.
void collect_places(const text::YamlNode& node, text::YamlPath& path, std::vector<text::YamlPath>& values,
                    std::vector<text::YamlPath>& lists) {
  if (!path.empty()) values.push_back(path);
  if (!node.items.empty() && !path.empty()) lists.push_back(path);
  for (const auto& [key, value] : node.entries) {
    path.emplace_back(key.scalar);
    collect_places(value, path, values, lists);
    path.pop_back();
  }
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    path.emplace_back(i);
    collect_places(node.items[i], path, values, lists);
    path.pop_back();
  }
}

TEST(Gestures, OfScenariosWorldsAndProjectsEditLeastAndUndoToIdenticalBytes) {
  const auto seed = std::random_device()();
  const auto files = example_files([](const fs::path& path) { return path.extension() == ".yaml"; });
  const auto some = [&](const std::string& folder) {
    return std::count_if(files.begin(), files.end(),
                         [&](const fs::path& path) { return path.parent_path().filename() == folder; });
  };
  ASSERT_GE(some("scenarios"), 10);
  ASSERT_GE(some("world"), 3);
  const std::vector<Value> values{Value("12.5 s"),   Value(std::int64_t{7}),
                                  Value(0.25),       Value(true),
                                  Value("a: b # c"), Value(Map{{"at", "3 s"}, {"kill", "robot"}}),
                                  Value(List{1, 2})};
  const Try any_gesture = [&](const std::string& now, std::mt19937& random) -> Tried {
    std::vector<text::YamlPath> places;
    std::vector<text::YamlPath> lists;
    text::YamlPath path;
    collect_places(*text::parse_yaml(now), path, places, lists);
    if (places.empty()) return {edit_yaml(now, SetYaml{{"fresh"}, any_of(values, random)}), {}};
    switch (random() % 6) {
      case 0: return {edit_yaml(now, RemoveYaml{any_of(places, random)}), {}};
      case 1:
      case 2:
        if (!lists.empty())
          return {edit_yaml(now, InsertYaml{any_of(lists, random), random() % 3, any_of(values, random)}), {}};
        [[fallthrough]];
      case 3: {
        text::YamlPath fresh = any_of(places, random);
        fresh.back() = "fresh" + std::to_string(random() % 20);
        return {edit_yaml(now, SetYaml{fresh, any_of(values, random)}), {}};
      }
      default: return {edit_yaml(now, SetYaml{any_of(places, random), any_of(values, random)}), {}};
    }
  };
  const Reads is_read = [](const std::string& text) { return text::parse_yaml(text).has_value(); };
  edits_and_undoes_all(files, any_gesture, is_read, seed);
}

}  // namespace
}  // namespace sentree::design
