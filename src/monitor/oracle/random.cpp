#include "sentree/monitor/oracle/random.h"

#include <array>

namespace sentree::monitor::oracle {

namespace {

template <std::size_t N>
std::string pick(Rng& rng, const std::array<const char*, N>& from) {
  return from[rng.below(N)];
}

std::string number(Rng& rng) { return std::to_string(rng.below(4)); }

// Holds for a while.
std::string lasting(Rng& rng, int depth) {
  switch (rng.below(depth > 0 ? 9 : 6)) {
    case 0: return "x " + pick<4>(rng, {"<", ">=", "=", "!="}) + " " + number(rng);
    case 1: return "y * 2 " + pick<4>(rng, {"<=", ">", "=", "!="}) + " " + number(rng);
    case 2: return "b";
    case 3: return "w " + pick<2>(rng, {"=", "!="}) + " " + pick<3>(rng, {"apple", "pear", "\"plum\""});
    case 4: return "at(" + pick<2>(rng, {"apple", "pear"}) + ")";
    case 5: return pick<4>(rng, {"x < y", "x + y = 3", "flag != b", "w = v"});
    case 6: return "not (" + lasting(rng, depth - 1) + ")";
    case 7: return "(" + lasting(rng, depth - 1) + " and " + lasting(rng, depth - 1) + ")";
    default: return "(" + lasting(rng, depth - 1) + pick<2>(rng, {" or ", " implies "}) + lasting(rng, depth - 1) + ")";
  }
}

std::string momentary(Rng& rng) {
  switch (rng.below(6)) {
    case 0: return "event(e)";
    case 1: return "event(f)";
    case 2: return "event(apples)";
    case 3: return pick<3>(rng, {"x updated", "(x + y) updated", "at(pear) updated"});
    case 4: return "rises(" + lasting(rng, 0) + ")";
    default: return "falls(" + lasting(rng, 0) + ")";
  }
}

std::string any(Rng& rng) {
  switch (rng.below(5)) {
    case 0:
    case 1: return lasting(rng, 1);
    case 2:
    case 3: return momentary(rng);
    default: return "(" + momentary(rng) + pick<2>(rng, {" and ", " or "}) + lasting(rng, 0) + ")";
  }
}

std::string bound(Rng& rng) {
  switch (rng.below(4)) {
    case 0: return std::to_string(1 + rng.below(4)) + " ticks";
    case 1: return std::to_string(1 + rng.below(4)) + " events";
    default: return pick<4>(rng, {"1 ms", "2 ms", "5 ms", "3500 us"});
  }
}

std::string scope(Rng& rng) {
  switch (rng.below(9)) {
    case 0: return "before " + any(rng) + ", ";
    case 1: return "after " + any(rng) + ", ";
    case 2: return "between (" + any(rng) + ") and " + any(rng) + ", ";
    case 3: return "after " + any(rng) + " until " + any(rng) + ", ";
    case 4: return "while " + lasting(rng, 1) + ", ";
    default: return "";
  }
}

std::string body(Rng& rng) {
  switch (rng.below(15)) {
    case 0: return "always " + lasting(rng, 2);
    case 1: return "never " + any(rng);
    case 2: return "eventually " + any(rng) + " within " + bound(rng);
    case 3: return "eventually " + any(rng);
    case 4:
    case 5: return "whenever " + any(rng) + ", " + any(rng) + " within " + bound(rng);
    case 6: return "whenever " + any(rng) + ", " + any(rng) + " immediately";
    case 7: return "whenever " + any(rng) + ", keep " + lasting(rng, 1) + " for " + bound(rng);
    case 8: return "whenever " + any(rng) + ", keep " + lasting(rng, 1) + " until " + any(rng);
    case 9: return "whenever " + any(rng) + ", not (" + any(rng) + ") for " + bound(rng);
    case 10: return any(rng) + " precedes " + any(rng) + (rng.below(2) == 0 ? "" : " by at most " + bound(rng));
    case 11: return any(rng) + " at least every " + bound(rng);
    case 12: return any(rng) + " at most " + number(rng) + " times per " + bound(rng);
    case 13: return any(rng) + " at most " + number(rng) + " times";
    default: return lasting(rng, 1) + " holds for at least " + bound(rng);
  }
}

Message message(Rng& rng) {
  Message m;
  const auto fruit = [&] { return Value(pick<3>(rng, {"apple", "pear", "plum"})); };
  const auto digit = [&] { return Value(static_cast<std::int64_t>(rng.below(4))); };
  switch (rng.below(11)) {
    case 0:
    case 1:
      m.name = "s.x.reply";
      m.data = Map{{"args", Map()}, {"result", rng.below(2) == 0 ? digit() : Value(1.5)}};
      break;
    case 2:
      m.name = "s.y.reply";
      // Now and then the member, or all of the result, is missing.
      if (const auto kind = rng.below(8); kind == 0)
        m.data = Map{{"args", Map()}};
      else
        m.data = Map{{"args", Map()}, {"result", kind == 1 ? Map{{"other", 1}} : Map{{"value", digit()}}}};
      break;
    case 3:
      m.name = "s.b.reply";
      m.data = Map{{"args", Map()}, {"result", rng.below(2) == 0}};
      break;
    case 4:
      m.name = "s.w.request";
      m.data = Map{{"args", Map{{"name", fruit()}, {"other", fruit()}}}};
      break;
    case 5:
      m.name = "s.at.reply";
      m.data = Map{{"args", Map{{"name", fruit()}}}, {"result", rng.below(2) == 0}};
      break;
    case 6:
      m.name = "s.e.request";
      m.data = Map{{"args", Map()}};
      break;
    case 7:
      m.name = "s.f.reply";
      m.source = rng.below(2) == 0 ? "LeafA" : "LeafB";
      m.data = Map{{"args", Map()}, {"result", rng.below(2) == 0}};
      break;
    case 8:
      m.name = "s.unrelated.reply";
      m.data = Map{{"result", 7}};
      break;
    default: m.name = "mission.tick"; break;
  }
  return m;
}

}  // namespace

std::string random_definitions() {
  return "let x = reply(s.x)\n"
         "let y = reply(s.y).value\n"
         "let b = reply(s.b)\n"
         "let flag = reply(s.f)\n"
         "let w = request(s.w).name\n"
         "let v = request(s.w).other\n"
         "let at(place) = reply(s.at where args.name = place)\n"
         "event e = request(s.e)\n"
         "event f = reply(s.f from LeafA)\n"
         "event apples = request(s.w where args.name = apple)\n";
}

std::string random_requirement(Rng& rng) {
  return std::string("R") + (rng.below(3) == 0 ? " (re-arming)" : "") + ": " + scope(rng) + body(rng) +
         (rng.below(5) == 0 ? " assuming " + lasting(rng, 0) : "") + ".";
}

std::string random_owed_between(Rng& rng) {
  const auto trigger = [&] {
    return pick<7>(rng, {"event(apples)", "event(apples)", "b", "rises(b)", "x > 1", "x updated",
                         "event(observation(mission.tick))"});
  };
  const auto state = [&] { return pick<5>(rng, {"b", "not b", "x < 3", "x != 1", "w = apple"}); };
  const auto what = [&] { return rng.below(2) == 0 ? state() : trigger(); };
  std::string body;
  switch (rng.below(7)) {
    case 0: body = "whenever " + trigger() + ", " + what() + " within " + bound(rng); break;
    case 1: body = "whenever " + trigger() + ", keep " + state() + " until " + what(); break;
    case 2: body = state() + " holds for at least " + bound(rng); break;
    case 3:
    case 4: body = "whenever " + trigger() + ", keep " + state() + " for " + bound(rng); break;
    default: body = "whenever " + trigger() + ", not (" + what() + ") for " + bound(rng); break;
  }
  return std::string("R") + (rng.below(3) == 0 ? " (re-arming)" : "") + ": between event(e) and " +
         pick<4>(rng, {"event(f)", "event(f)", "(event(f) or x = 0)", "rises(w = plum)"}) + ", " + body +
         (rng.below(6) == 0 ? " assuming y < 3" : "") + ".";
}

namespace {

std::vector<Message> trace_of(Rng& rng, std::uint64_t length_max, Message (*make)(Rng&)) {
  std::vector<Message> trace;
  TimePoint now{};
  const std::uint64_t length = rng.below(length_max);
  for (std::uint64_t i = 0; i < length; ++i) {
    constexpr std::array<std::int64_t, 8> kStepsNs{0, 0, 1, 499'999, 500'000, 1'000'000, 1'000'001, 2'000'000};
    now += Duration(kStepsNs[rng.below(kStepsNs.size())]);
    Message m = make(rng);
    m.time = now;
    m.sequence = i + 1;
    trace.push_back(std::move(m));
  }
  return trace;
}

Message message_of_segments(Rng& rng) {
  if (rng.below(12) == 0) return message(rng);
  Message m;
  const auto args = [](Map members = {}) { return Map{{"args", std::move(members)}}; };
  switch (rng.below(7)) {
    case 0:
      m.name = "s.e.request";
      m.data = args();
      break;
    case 1:
      m.name = "s.f.reply";
      m.source = "LeafA";
      m.data = args();
      break;
    case 2:
    case 3:
      m.name = "s.w.request";
      m.data = args({{"name", pick<3>(rng, {"apple", "apple", "plum"})}, {"other", "pear"}});
      break;
    case 4:
      m.name = "s.b.reply";
      m.data = Map{{"args", Map()}, {"result", rng.below(3) > 0}};
      break;
    case 5:
      m.name = "s.x.reply";
      m.data = Map{{"args", Map()}, {"result", static_cast<std::int64_t>(rng.below(4))}};
      break;
    default: m.name = "mission.tick"; break;
  }
  return m;
}

}  // namespace

std::vector<Message> random_trace(Rng& rng) { return trace_of(rng, 28, message); }
std::vector<Message> random_segments(Rng& rng) { return trace_of(rng, 60, message_of_segments); }

std::string show(const std::vector<Message>& trace) {
  std::string text;
  for (const Message& m : trace) {
    text += std::to_string(m.sequence) + " @" + std::to_string(m.time.time_since_epoch().count()) + " ns " + m.name +
            (m.source.empty() ? "" : " from " + m.source) + " " + to_json(m.data) + "\n";
  }
  return text;
}

}  // namespace sentree::monitor::oracle
