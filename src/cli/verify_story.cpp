#include "sentree/cli/verify_story.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <utility>

#include "sentree/base/shown.h"
#include "sentree/project/intervention.h"
#include "sentree/verify/counterexample.h"

namespace sentree::cli {

bool is_choice(const project::Plan& plan, const Message& message) {
  return message.name == message.source + ".choice" && message.data.find("value") != nullptr &&
         std::any_of(plan.models.begin(), plan.models.end(),
                     [&](const project::ModelPlan& model) { return model.name == message.source; });
}

namespace {

// What is not as in `before`, which it becomes: of a structure the members, cut to what one reads at a glance.
std::string changed_in(Value& before, const Value& result) {
  constexpr std::size_t kShownMax = 72;
  if (before == result) return {};
  const Map* old = before.as_map();
  const Map* present = result.as_map();
  std::string text;
  if (old != nullptr && present != nullptr) {
    for (const auto& [name, value] : *present) {
      const Value* was = old->find(name);
      if (was == nullptr || !(*was == value))
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, to_json(value));
    }
  } else {
    text = to_json(result);
  }
  before = result;
  if (text.size() <= kShownMax) return text;
  std::size_t end = kShownMax;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return text.substr(0, end) + "…";
}

// " (robot#3, not true; models/robot.scxml:33)": what else it could have been, as `sentree run --choose` wants it.
std::string others(const verify::Told& tick, std::size_t index, const std::string& model, const std::string& value,
                   const Value* place) {
  if (index >= tick.choices.size() || tick.choices[index].count < 2) return {};
  const verify::Told::Choice& choice = tick.choices[index];
  std::string text;
  for (const std::string& other : choice.alternatives) {
    if (other != value) text += (text.empty() ? "" : ", ") + other;
  }
  if (choice.count > choice.alternatives.size()) text += ", …";
  return fmt::format(" ({}#{}, not {}{})", model, choice.number, text,
                     place != nullptr ? fmt::format("; {}", place->text()) : "");
}

// What a story says at one instant.
class Line {
 public:
  void add(std::string what) { items_.push_back({std::move(what), {}, {}}); }
  void add_call(const std::string& call, const std::string& caller, const std::string& answer) {
    items_.push_back({fmt::format("{} → {}", call, answer), call, {caller}});
  }
  // Somebody else who got the same answer in this line, since when nothing has been done to the service.
  void add_caller(const std::string& call, const std::string& caller) {
    const std::string service = call.substr(0, call.find('.') + 1);
    for (auto item = items_.rbegin(); item != items_.rend(); ++item) {
      if (item->call == call && std::find(item->callers.begin(), item->callers.end(), caller) == item->callers.end())
        item->callers.push_back(caller);
      if (item->call.starts_with(service)) return;
    }
  }
  bool empty() const { return items_.empty(); }
  std::string text() const {
    std::string out;
    for (const Item& item : items_) {
      out += (out.empty() ? "" : ", ") + item.text;
      if (item.callers.size() > 1 || is_told_of_others(item))
        out += fmt::format(" ({})", fmt::join(item.callers, ", "));
    }
    return out;
  }

 private:
  struct Item {
    std::string text;
    std::string call;  // with arguments; empty: it is none
    std::vector<std::string> callers;
  };
  bool is_told_of_others(const Item& item) const {
    return !item.call.empty() && std::any_of(items_.begin(), items_.end(), [&](const Item& other) {
      return other.call == item.call && other.callers != item.callers;
    });
  }
  std::vector<Item> items_;
};

// What is told of one thing after the other, and not as it was.
class Story {
 public:
  explicit Story(const project::Plan& plan) : plan_(plan) {}

  void begin_tick(const verify::Told& tick) {
    tick_ = &tick;
    choices_ = 0;
  }

  void tell(const Message& message, Line& line) {
    const auto is = [&](std::string_view ending) { return message.name.ends_with(ending); };
    if (is_choice(plan_, message)) {
      const Value* name = message.data.find("name");
      const std::string value = to_json(*message.data.find("value"));
      line.add(fmt::format("{} chooses {}{}{}", message.source,
                           name != nullptr ? fmt::format("{} = ", name->text()) : "", value,
                           others(*tick_, choices_++, message.source, value, message.data.find("place"))));
    } else if (message.name == "scenario.injection") {
      const auto what = project::intervention_of(message);
      line.add(fmt::format("{}: {}", message.source == "scenario" ? "fault" : message.source,
                           what ? project::describe(*what) : to_json(message.data)));
    } else if (is(".tick.reply")) {
      const std::string status(message.data.find("status")->text());
      if (std::exchange(last_[message.name], status) != status) line.add(fmt::format("{} {}", message.source, status));
    } else if (is(".halt.request")) {
      line.add(fmt::format("{} halted", message.target));
    } else if (message.kind == MessageKind::kReply && !is(".halt.reply")) {
      tell_reply(message, line);
    } else if (message.kind == MessageKind::kError) {
      line.add(message.name);
    } else if (is(".log") && message.data.find("text") != nullptr) {
      const Value* label = message.data.find("label");
      const std::string text =
          fmt::format("{}{}", label != nullptr && !label->text().empty() ? fmt::format("{}: ", label->text()) : "",
                      message.data.find("text")->text());
      if (std::exchange(last_[message.name], text) != text)
        line.add(fmt::format("{} logs \"{}\"", message.source, text));
    }
  }

  // What was told of an observation last: " by battery.level.reply → 0.19".
  std::string by(const std::string& observation) const {
    if (observation.empty()) return {};
    const auto last = last_.find(observation);
    return fmt::format(" by {}{}", observation, last != last_.end() ? " → " + last->second : "");
  }

 private:
  void tell_reply(const Message& message, Line& line) {
    const std::string method = message.name.substr(0, message.name.size() - std::string_view(".reply").size());
    const Value* args = message.data.find("args");
    const std::string call = method + (args != nullptr && !args->as_map()->empty() ? to_json(*args) : "");
    const Value* result = message.data.find("result");
    if (result != nullptr && !result->is_null()) {
      const std::string changed = changed_in(results_[call], *result);
      if (changed.empty()) {
        line.add_caller(call, message.source);
      } else {
        line.add_call(call, message.source, changed);
        last_[message.name] = changed;
      }
      return;
    }
    // What is asked for tick after tick is told once.
    const auto [known, is_new] = done_.try_emplace(message.source + ' ' + call, tick_->tick);
    const bool goes_on = !is_new && known->second + 1 >= tick_->tick;
    known->second = tick_->tick;
    if (!goes_on) line.add_call(call, message.source, "done");
  }

  const project::Plan& plan_;
  const verify::Told* tick_ = nullptr;
  std::size_t choices_ = 0;
  std::map<std::string, std::string> last_;
  std::map<std::string, Value> results_;
  std::map<std::string, std::uint64_t> done_;
};

}  // namespace

std::string story_of(const project::Plan& plan, const verify::Judgement& judgement) {
  const auto told = verify::retell(plan);
  if (!told) return fmt::format("{}\n", to_string(told.error()));
  std::string out;
  Story story(plan);
  const auto& loop = judgement.path->loop;
  for (const verify::Told& tick : *told) {
    if (loop && tick.tick > judgement.path->edges.size()) break;
    if (loop && tick.tick == *loop + 1)
      out += fmt::format("    from here on the same for ever, and {} is owed:\n", judgement.requirement);
    story.begin_tick(tick);
    Line line;
    // What timers do comes before the tick of its period, and has a line of its own.
    const TimePoint at_tick = TimePoint{} + plan.scenario.project.period * static_cast<std::int64_t>(tick.tick - 1);
    TimePoint at = at_tick;
    const auto end_line = [&] {
      if (!line.empty()) {
        const std::string label = at == at_tick ? fmt::format("tick {:<4}", tick.tick) : std::string();
        out += fmt::format("    {:<9} {:>8} s  {}\n", label, shortest_decimal(seconds(at)), line.text());
      }
      line = {};
    };
    auto first = tick.firsts.begin();
    for (std::size_t i = 0; i < tick.messages.size(); ++i) {
      const Message& message = tick.messages[i];
      if (!loop && message.time > judgement.at) break;
      if (message.time != at) end_line();
      at = message.time;
      for (; first != tick.firsts.end() && first->message <= i; ++first)
        line.add(fmt::format("{} comes first", first->part));
      story.tell(message, line);
    }
    end_line();
  }
  if (loop) return out;
  const bool is_refuted = judgement.finding == verify::Finding::kRefuted;
  out += fmt::format(
      "    {:>20} s  {}\n", shortest_decimal(seconds(judgement.at)),
      judgement.state == "the mission ends"
          ? fmt::format("the mission ends, and {} is {}", judgement.requirement, is_refuted ? "owed" : "open")
          : fmt::format("{} is VIOLATED{}", judgement.requirement, story.by(judgement.observation)));
  return out;
}

}  // namespace sentree::cli
