// Small projects whose verdicts somebody has worked out by hand: why is said beside each. Every one is explored with a
// memory of steps and executed step by step, and what is refuted is run again.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/project/intervention.h"
#include "sentree/text/file.h"
#include "sentree/verify/statistics.h"
#include "sentree/verify/verify.h"

namespace sentree::verify {
namespace {

struct Expected {
  std::string requirement;
  std::string verdict;                         // holds, vacuous, refuted; "@0.3" behind it: at that time [s]
  std::optional<std::pair<double, double>> p;  // that it is violated: least and greatest
};

struct Known {
  std::string name;
  std::string why;
  std::string tree;
  std::string model;  // inside of the chart that serves d; MODEL(…) below
  std::string requirements;
  std::vector<Expected> expected;
  std::string yaml = "";
  bool all_fair = false;
  std::string other_model = "";  // that serves e
  std::string scenario = "";     // but for its project
};

void PrintTo(const Known& known, std::ostream* out) { *out << known.why; }

std::string chart(const std::string& inside) {
  return "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\">" + inside +
         "</scxml>\n";
}

// A skill that calls SERVICE.ask and succeeds with 6.
std::string asks(const std::string& service) {
  return chart("<state id=\"a\"><onentry><send type=\"thrift\" target=\"" + service + "\" event=\"ask\"/></onentry>" +
               "<transition event=\"" + service +
               ".ask.reply\" cond=\"_event.data.result === 6\" target=\"success\"/>" + "<transition event=\"" +
               service + ".ask.reply\" target=\"failure\"/>" + "<transition event=\"error " + service +
               ".ask.error\" target=\"failure\"/></state><final id=\"success\"/><final id=\"failure\"/>");
}

std::string reply(const std::string& result, const std::string& service = "d") {
  return "<send type=\"thrift\" target=\"" + service + "\" event=\"ask.reply\"><param name=\"result\" expr=\"" +
         result + "\"/></send>";
}

// A model with numbers that are 0 to begin with, which on each question does something and answers.
std::string answers(const std::string& does, const std::string& result, const std::string& service = "d") {
  std::string data;
  for (const char* const name : {"a", "b", "k"}) data += std::string("<data id=\"") + name + "\" expr=\"0\"/>";
  return chart("<datamodel>" + data + "</datamodel><state id=\"t\"><transition event=\"" + service + ".ask.request\">" +
               does + reply(result, service) + "</transition></state>");
}

std::string assign(const std::string& name, const std::string& value) {
  return "<assign location=\"" + name + "\" expr=\"" + value + "\"/>";
}

// Asks at 0, 100, 200 ms … until there is a 6; again and again from 100 ms on; twice at once.
const std::string kEachTick = "<ReactiveFallback><Condition ID=\"Ask\"/><Action ID=\"Hold\"/></ReactiveFallback>";
const std::string kAgain =
    "<RetryUntilSuccessful num_attempts=\"-1\"><Sequence><Sleep msec=\"100\"/><Condition ID=\"Ask\"/></Sequence>"
    "</RetryUntilSuccessful>";
const std::string kTwice = "<RetryUntilSuccessful num_attempts=\"2\"><Condition ID=\"Ask\"/></RetryUntilSuccessful>";
const std::string kBoth =
    "<ReactiveSequence><ForceSuccess><Condition ID=\"Ask\"/></ForceSuccess><ForceSuccess><Condition ID=\"AskE\"/>"
    "</ForceSuccess><Action ID=\"Hold\"/></ReactiveSequence>";
const std::string kOpens = "opens: eventually said = 6.\n";
const std::string kNested = "pick('mode', 'skip', 'try') === 'try' &amp;&amp; pick('open', false, true) ? 6 : 1";
const std::string kTwoFaults = "any_of: [{falsify: {call: d.ask, value: 1}}, {falsify: {call: e.ask, value: 1}}]}}\n";

std::vector<Known> known() {
  std::vector<Known> all;
  // ---- order
  Known orders{"ThreeAtOneInstant",
               "Three timers ring at 50 ms, so the model counts them in each of the six orders.",
               "<ParallelAll><Action ID=\"Later\" name=\"A\"/><Action ID=\"Later\" name=\"B\"/>"
               "<Action ID=\"Later\" name=\"C\"/></ParallelAll>",
               answers(assign("k", "k + 1"), "k"),
               "let x = reply(d.ask from A)\nlet y = reply(d.ask from B)\nlet z = reply(d.ask from C)\n"
               "same: never (x = y or y = z or x = z).\nfour: never x = 4.\n",
               {{"same", "holds", {}}, {"four", "holds", {}}}};
  for (const char* const one : {"123", "132", "213", "231", "312", "321"}) {
    orders.requirements +=
        std::string("p") + one + ": never (x = " + one[0] + " and y = " + one[1] + " and z = " + one[2] + ").\n";
    orders.expected.push_back({std::string("p") + one, "refuted@0.05", {}});
  }
  all.push_back(std::move(orders));
  all.push_back(
      {"AnswerAndTimerAtOneInstant",
       "At 50 ms one leaf is answered, and the other's timer lets it ask.",
       "<ParallelAll><Action ID=\"Later\"/><Condition ID=\"Ask\"/></ParallelAll>",
       chart("<state id=\"t\"><transition event=\"d.ask.request\"><send type=\"thrift\" target=\"d\" "
             "event=\"ask.reply\" delay=\"50ms\"><param name=\"result\" expr=\"6\"/></send></transition></state>"),
       "a: event(reply(d.ask from Ask)) precedes event(request(d.ask from Later)).\n"
       "b: event(request(d.ask from Later)) precedes event(reply(d.ask from Ask)).\n",
       {{"a", "refuted@0.05", {}}, {"b", "refuted@0.05", {}}},
       "deadlines: {call: 60 ms, condition: 80 ms}\n"});
  all.push_back(
      {"AnswerAndOwnTimerAtOneInstant",
       "At 50 ms a leaf is answered, and gives up waiting for that.",
       "<Action ID=\"Either\"/>",
       chart("<state id=\"t\"><transition event=\"d.ask.request\"><send type=\"thrift\" target=\"d\" "
             "event=\"ask.reply\" delay=\"50ms\"><param name=\"result\" expr=\"6\"/></send></transition></state>"),
       "a: never observation(mission.status).status = FAILURE.\n"
       "b: never observation(mission.status).status = SUCCESS.\n",
       {{"a", "refuted@0.1", {}}, {"b", "refuted@0.1", {}}},
       "deadlines: {call: 60 ms, condition: 80 ms}\n"});
  // What is due for nothing any more is counted by nobody: at 100 ms and 200 ms the model's timer and the end of Z's
  // time.
  Known late{
      "ThreeBehindOtherInstants",
      "Three timers ring at 250 ms, behind instants at which the model's own timer rings.",
      "<Sequence><Action ID=\"Later\" name=\"Z\"/><Sleep msec=\"100\"/><ParallelAll><Action ID=\"Later\" "
      "name=\"A\"/><Action ID=\"Later\" name=\"B\"/><Action ID=\"Later\" name=\"C\"/></ParallelAll></Sequence>",
      chart("<datamodel><data id=\"k\" expr=\"0\"/></datamodel><state id=\"t\"><onentry><send event=\"beat\" "
            "delay=\"100ms\"/></onentry><transition event=\"beat\" target=\"t\"/><transition event=\"d.ask.request\">" +
            assign("k", "k + 1") + reply("k") + "</transition></state>"),
      "let x = reply(d.ask from A)\nlet y = reply(d.ask from B)\nlet z = reply(d.ask from C)\n",
      {}};
  for (const char* const one : {"234", "342", "432"}) {
    late.requirements +=
        std::string("p") + one + ": never (x = " + one[0] + " and y = " + one[1] + " and z = " + one[2] + ").\n";
    late.expected.push_back({std::string("p") + one, "refuted@0.25", {}});
  }
  all.push_back(std::move(late));
  // ---- time
  all.push_back({"BoundsAreClosed",
                 "Asked at 0, 100, 200 ms …; windows and bounds are closed.",
                 kEachTick,
                 answers("", "1"),
                 "three: event(request(d.ask)) at most 3 times per 200 ms.\n"
                 "two: event(request(d.ask)) at most 2 times per 200 ms.\n"
                 "two199: event(request(d.ask)) at most 2 times per 199 ms.\n"
                 "every100: event(request(d.ask)) at least every 100 ms.\n"
                 "every99: event(request(d.ask)) at least every 99 ms.\n",
                 {{"three", "holds", {}},
                  {"two", "refuted@0.2", {}},
                  {"two199", "holds", {}},
                  {"every100", "holds", {}},
                  {"every99", "refuted@0.099", {}}}});
  all.push_back({"ScopesAndBounds",
                 "1 at 100 ms, 2 at 200, 3 at 300, 0 at 400, and round again.",
                 kAgain,
                 answers(assign("k", "(k + 1) % 4"), "k"),
                 "f: after said = 3, eventually said = 2 within 300 ms.\n"
                 "g: after said = 3, eventually said = 2 within 299 ms.\n"
                 "h: whenever said = 3, keep said != 2 for 299 ms.\ni: whenever said = 3, keep said != 2 for 300 ms.\n"
                 "m: said = 1 precedes said = 2 by at most 100 ms.\nn: said = 1 precedes said = 2 by at most 99 ms.\n"
                 "q: said = 1 holds for at least 99 ms.\nr: said = 1 holds for at least 100 ms.\n",
                 {{"f", "holds", {}},
                  {"g", "refuted@0.599", {}},
                  {"h", "holds", {}},
                  {"i", "refuted@0.6", {}},
                  {"m", "holds", {}},
                  {"n", "refuted@0.2", {}},
                  {"q", "holds", {}},
                  {"r", "refuted@0.6", {}}}});
  all.push_back({"OpenForEver",
                 "8 and 9 never come: what must be kept until then is kept, and between two events only what is closed "
                 "counts; but what must come while a scope is open never does.",
                 kAgain,
                 answers(assign("k", "(k + 1) % 4"), "k"),
                 "kept: whenever said = 1, keep said != 9 until said = 8.\n"
                 "between_: between said = 1 and said = 8, never said = 3.\n"
                 "until_: after said = 1 until said = 8, eventually said = 9.\n"
                 "closed: between said = 1 and said = 3, eventually said = 0.\n"
                 "open_: between said = 1 and said = 8, eventually said = 9.\n"
                 "never_met: between said = 1 and said = 3, whenever said = 2, said = 9 eventually.\n"
                 "met: between said = 1 and said = 3, whenever said = 2, said = 1 eventually.\n"
                 "never_closed: between said = 1 and said = 8, whenever said = 2, said = 9 eventually.\n"
                 "overdue: between said = 1 and said = 3, whenever said = 2, said = 0 within 199 ms.\n"
                 "in_time: between said = 1 and said = 3, whenever said = 2, said = 0 within 200 ms.\n"
                 "kept_after: between said = 1 and said = 3, whenever said = 2, keep said != 0 for 200 ms.\n",
                 {{"kept", "holds", {}},
                  {"between_", "vacuous", {}},
                  {"until_", "refuted", {}},
                  {"closed", "refuted@0.3", {}},
                  {"open_", "vacuous", {}},
                  {"never_met", "refuted", {}},
                  {"met", "holds", {}},
                  {"never_closed", "vacuous", {}},
                  {"overdue", "refuted@0.399", {}},
                  {"in_time", "holds", {}},
                  {"kept_after", "refuted@0.4", {}}}});
  all.push_back(
      {"EndsBetweenTwoTicks",
       "Answered 6 at 200 ms in a quarter of the cases, else at 300; the other leaf takes 40 ms to stop, and what "
       "is due behind that stays open.",
       "<ReactiveFallback><Condition ID=\"Ask\"/><Action ID=\"Slow\"/></ReactiveFallback>",
       answers(assign("k", "k + 1"), "k === 4 || (k === 3 &amp;&amp; chance(0.25)) ? 6 : 1"),
       "a: eventually said = 9 within 240 ms.\nb: eventually said = 9 within 241 ms.\n"
       "c: eventually said = 9 within 340 ms.\nd: eventually said = 9 within 341 ms.\n"
       "e: eventually said = 9.\nf: whenever said = 6, robot shall said = 9 within 40 ms.\n"
       "g: whenever said = 6, robot shall said = 9 within 41 ms.\n",
       {{"a", "refuted@0.24", {{1, 1}}},
        {"b", "refuted@0.241", {{0.75, 0.75}}},
        {"c", "refuted@0.34", {{0.75, 0.75}}},
        {"d", "holds", {{0, 0}}},
        {"e", "refuted@0.24", {{1, 1}}},
        {"f", "refuted@0.24", {{1, 1}}},
        {"g", "holds", {{0, 0}}}}});
  all.push_back(
      {"AssumingAndWhile",
       "1 at 100 ms, 2 at 200, 3 at 300, 0 at 400, and round again. What is owed is dropped at 200 ms where 2 is "
       "ruled out, which is before 100 ms have passed and behind 99; what closes a scope does not belong to it.",
       kAgain,
       answers(assign("k", "(k + 1) % 4"), "k"),
       "a: whenever said = 1, robot shall said = 3 within 99 ms assuming said != 2.\n"
       "b: whenever said = 1, robot shall said = 3 within 100 ms assuming said != 2.\n"
       "c: while said >= 2, eventually said = 3 within 100 ms.\n"
       "d: while said = 2, eventually said = 3 within 100 ms.\n"
       "e: while said >= 1, said = 1 precedes said = 3.\nf: while said >= 2, said = 1 precedes said = 3.\n"
       "g: between said = 1 and said = 3, always said < 3.\nh: between said = 1 and said = 3, always said < 2.\n"
       "i: after said = 1 until said = 3, always said < 2.\nj: before said = 2, never said >= 2.\n"
       "k: before said = 2, eventually said = 3.\n",
       {{"a", "refuted@0.199", {}},
        {"b", "holds", {}},
        {"c", "holds", {}},
        {"d", "refuted@0.3", {}},
        {"e", "holds", {}},
        {"f", "refuted@0.3", {}},
        {"g", "holds", {}},
        {"h", "refuted@0.3", {}},
        {"i", "refuted@0.2", {}},
        {"j", "holds", {}},
        {"k", "refuted@0.2", {}}}});
  all.push_back(
      {"TicksAndEvents",
       "Of two ticks behind 200 ms the second is at 400, before the answer then; of two answers the second is 0.",
       kAgain,
       answers(assign("k", "(k + 1) % 4"), "k"),
       "a: whenever said = 2, robot shall said = 0 within 1 ticks.\n"
       "b: whenever said = 2, robot shall said = 3 within 1 ticks.\n"
       "c: whenever said = 2, robot shall said = 0 within 1 events.\n"
       "d: whenever said = 2, robot shall said = 0 within 2 events.\n",
       {{"a", "refuted@0.4", {}}, {"b", "holds", {}}, {"c", "refuted@0.3", {}}, {"d", "holds", {}}}});
  const auto answers_later = [](const std::string& when) {
    return chart(
        "<datamodel><data id=\"w\" expr=\"0\"/></datamodel><state id=\"t\"><transition event=\"d.ask.request\">" +
        assign("w", when) +
        "<send type=\"thrift\" target=\"d\" event=\"ask.reply\" delayexpr=\"w + 'ms'\"><param name=\"result\" "
        "expr=\"6\"/></send></transition></state>");
  };
  all.push_back({"AnsweredWithin",
                 "Asked at 100 ms, answered 10 to 40 ms later; 40 is when a call is late, and is in time.",
                 "<Sequence><Sleep msec=\"100\"/><Condition ID=\"Ask\"/></Sequence>",
                 answers_later("between(10, 40, 10)"),
                 "a: eventually said = 6 within 140 ms.\nb: eventually said = 6 within 139 ms.\n"
                 "c: whenever event(request(d.ask)), robot shall event(reply(d.ask)) within 39 ms.\n"
                 "d: never event(error(d.ask)).\n"
                 "e: whenever event(request(d.ask)), robot shall not event(reply(d.ask)) for 9 ms.\n"
                 "f: whenever event(request(d.ask)), robot shall not event(reply(d.ask)) for 10 ms.\n",
                 {{"a", "holds", {}},
                  {"b", "refuted@0.139", {}},
                  {"c", "refuted@0.139", {}},
                  {"d", "holds", {}},
                  {"e", "holds", {}},
                  {"f", "refuted@0.11", {}}}});
  all.push_back(
      {"AnsweredLate",
       "41 ms are late, with 0.25, and are so at 40 ms; the second try begins at 100 ms, and the mission ends "
       "with the answer.",
       kTwice,
       answers_later("draw([[0.5, 20], [0.25, 40], [0.25, 41]])"),
       "a: eventually said = 6.\nb: eventually said = 6 within 20 ms.\nc: eventually said = 6 within 39 ms.\n"
       "d: never event(error(d.ask)).\ne: eventually said = 9 within 21 ms.\n",
       {{"a", "refuted@0.14", {{0.0625, 0.0625}}},
        {"b", "refuted@0.02", {{0.5, 0.5}}},
        {"c", "refuted@0.039", {{0.5, 0.5}}},
        {"d", "refuted@0.04", {{0.25, 0.25}}},
        {"e", "refuted@0.021", {{0.5, 0.5}}}}});
  all.push_back({"TheTreeCounts",
                 "Asked at the third of the counts, which is at 300 ms, and once.",
                 "<Sequence><Script code=\"n := 0\"/><RetryUntilSuccessful num_attempts=\"-1\"><Sequence>"
                 "<Sleep msec=\"100\"/><Script code=\"n += 1\"/><ScriptCondition code=\"n &gt;= 3\"/>"
                 "<Condition ID=\"Ask\"/></Sequence></RetryUntilSuccessful></Sequence>",
                 answers("", "6"),
                 "a: eventually said = 6 within 300 ms.\nb: eventually said = 6 within 299 ms.\n"
                 "c: event(request(d.ask)) at most 1 times.\n",
                 {{"a", "holds", {}}, {"b", "refuted@0.299", {}}, {"c", "holds", {}}}});
  // ---- vacuity
  all.push_back({"Vacuous",
                 "Nobody says 9, and nobody calls e.",
                 kAgain,
                 answers("", "pick('says', 1, 6)"),
                 "let told = reply(e.ask)\n"
                 "trigger: whenever said = 9, robot shall said = 6 within 1 s.\n"
                 "unseen: never told = 3.\n"
                 "precedes_: said = 1 precedes event(reply(e.ask)).\n"
                 "hidden: always (said <= 6 or told = 3).\nbefore_: before said = 9, always said <= 6.\n"
                 "silent: never event(reply(e.ask)).\nafter_: after said = 1, never event(reply(e.ask)).\n"
                 "begins: after said = 6, always said <= 6.\nbegins_not: after said = 9, always said <= 6.\n"
                 "again_not: between said = 9 and said = 6, never said = 1.\n"
                 "until_not: after said = 9 until said = 6, never said = 1.\n"
                 "while_: while said = 6, never said = 1.\nwhile_not: while said = 9, never said = 1.\n"
                 "half: always (said <= 6 and told = 3).\nboth: never (said = 1 and told = 3).\n"
                 "needs: whenever said = 1, keep told = 3 for 1 s.\nanswer: said = 1 precedes told = 3.\n"
                 "no_event: never (said = 1 and event(reply(e.ask))).\n"
                 "assumed_not: never said = 1 assuming said = 9.\n"
                 "assumed_early: event(request(d.ask)) at most 1 times assuming said = 9.\n"
                 "never_ends: between said = 1 and said = 9, never said = 6.\n"
                 "precedes_not: said = 1 precedes said = 9.\n"
                 "at_once: whenever said = 1, said <= 6 within 1 s.\n"
                 "immediate: whenever said = 1, said <= 6 immediately.\n"
                 "immediate_not: whenever said = 9, said = 1 immediately.\n"
                 "immediate_after: after said = 6, whenever said = 1, said = 9 immediately.\n"
                 "within_after: after said = 6, whenever said = 1, said = 9 within 1 s.\n"
                 "precedes_after: after said = 6, said = 9 precedes said = 1.\n"
                 "precedes_assuming: said = 9 precedes said = 6 assuming said != 6.\n",
                 {{"trigger", "vacuous", {}},
                  {"unseen", "vacuous", {}},
                  {"precedes_", "vacuous", {}},
                  {"hidden", "vacuous", {}},  // false or unknown is unknown
                  {"before_", "holds", {}},
                  {"silent", "holds", {}},
                  {"after_", "holds", {}},
                  {"begins", "holds", {}},
                  {"begins_not", "vacuous", {}},
                  {"again_not", "vacuous", {}},
                  {"until_not", "vacuous", {}},
                  {"while_", "holds", {}},
                  {"while_not", "vacuous", {}},
                  {"half", "holds", {}},
                  {"both", "vacuous", {}},
                  {"needs", "vacuous", {}},
                  {"answer", "vacuous", {}},
                  {"no_event", "holds", {}},
                  {"assumed_not", "vacuous", {}},
                  {"assumed_early", "holds", {}},  // the first one is before anybody says anything
                  {"never_ends", "vacuous", {}},
                  {"precedes_not", "vacuous", {}},
                  {"at_once", "holds", {}},
                  {"immediate", "holds", {}},
                  {"immediate_not", "vacuous", {}},
                  // With 6 the mission ends.
                  {"immediate_after", "vacuous", {}},
                  {"within_after", "vacuous", {}},
                  {"precedes_after", "vacuous", {}},
                  {"precedes_assuming", "vacuous", {}}},
                 "",
                 false,
                 answers("", "1", "e")});
  all.push_back({"VacuousWhere",
                 "Nobody says 9, and only Ask asks.",
                 kAgain,
                 answers("", "pick('says', 1, 6)"),
                 "where_: always reply(d.ask where result = 9) < 100.\n"
                 "by_some: always reply(d.ask where source = Ask) < 100.\n"
                 "no_nine: never event(reply(d.ask where result = 9)).\n"
                 "not_nine: always not event(reply(d.ask where result = 9)).\n"
                 "six: always reply(d.ask where result = 6) > 5.\n"
                 "either: always (said <= 6 or reply(d.ask where result = 9) = 3).\n"
                 "both: always (said <= 6 and reply(d.ask where result = 9) = 9).\n"
                 "updates: never reply(d.ask where result = 9) updated.\n",
                 {{"where_", "vacuous", {}},
                  {"by_some", "holds", {}},
                  {"no_nine", "holds", {}},
                  {"not_nine", "holds", {}},
                  {"six", "holds", {}},
                  {"either", "vacuous", {}},
                  {"both", "holds", {}},
                  {"updates", "vacuous", {}}}});
  // ---- fairness
  all.push_back({"OfferedOnlyIfTried",
                 "Who always skips is never offered to open, so no fairness of that helps.",
                 kAgain,
                 answers("", kNested),
                 kOpens,
                 {{"opens", "refuted", {}}},
                 "verify: {fair: [m.open]}\n"});
  all.push_back({"TriedAndNeverOpened",
                 "Trying again and again, and never opening.",
                 kAgain,
                 answers("", kNested),
                 kOpens,
                 {{"opens", "refuted", {}}},
                 "verify: {fair: [m.mode]}\n"});
  all.push_back({"TriedAndOpened",
                 "Tried again and again, so offered again and again, so opened.",
                 kAgain,
                 answers("", kNested),
                 kOpens,
                 {{"opens", "holds", {}}},
                 "verify: {fair: [m.mode, m.open]}\n"});
  all.push_back({"StrongFairness",
                 "Offered at every second question, so never all the time, yet again and again.",
                 kAgain,
                 answers(assign("k", "1 - k") + "<if cond=\"k === 1\">" + assign("a", "pick('open', 1, 6)") +
                             "<else/>" + assign("a", "2") + "</if>",
                         "a"),
                 kOpens,
                 {{"opens", "holds", {}}},
                 "verify: {fair: [m.open]}\n"});
  all.push_back({"FairByTurns",
                 "6 and 1, then 1 and 6: each is taken again and again, and never both at once.",
                 kBoth,
                 answers("", "pick('x', 1, 6)"),
                 "let other = reply(e.ask)\nboth: eventually (said = 6 and other = 6).\none: eventually said = 6.\n",
                 {{"both", "refuted", {}}, {"one", "holds", {}}},
                 "",
                 true,
                 answers("", "pick('x', 1, 6)", "e")});
  // The same without names: each choice is fair where it stands.
  const auto line = [](const std::string& does) { return does + "\n"; };
  all.push_back({"UnnamedIsFairIfSaid",
                 "Offered at each question, so taken some time.",
                 kAgain,
                 answers("", "choose(1, 6)"),
                 kOpens,
                 {{"opens", "holds", {}}},
                 "",
                 true});
  all.push_back({"UnnamedIsNotFairElse",
                 "Nobody says that anybody is fair.",
                 kAgain,
                 answers("", "choose(1, 6)"),
                 kOpens,
                 {{"opens", "refuted", {}}},
                 "",
                 false});
  all.push_back({"BetweenIsFairInEachStep",
                 "5, 5.5, 6: each step comes some time.",
                 kAgain,
                 answers("", "Math.floor(between(5, 6, 0.5))"),
                 kOpens,
                 {{"opens", "holds", {}}},
                 "",
                 true});
  all.push_back({"UnnamedByPlace",
                 "6 is offered in two places, and each of them takes it; only b is answered.",
                 kAgain,
                 answers(line(assign("a", "choose(1, 6)")) + line(assign("b", "choose(1, 6)")), "b"),
                 kOpens,
                 {{"opens", "holds", {}}},
                 "",
                 true});
  all.push_back({"UnnamedByPlaceAndNotTogether",
                 "a takes 6 again and again, and so does b, at other questions.",
                 kAgain,
                 answers(line(assign("a", "choose(1, 6)")) + line(assign("b", "choose(1, 6)")),
                         "a === 6 &amp;&amp; b === 6 ? 6 : 1"),
                 kOpens,
                 {{"opens", "refuted", {}}},
                 "",
                 true});
  all.push_back({"UnnamedOfferedOnlyIfTried",
                 "Trying is fair, so it is tried again and again, so it is offered to open again and again.",
                 kAgain,
                 answers(line(assign("a", "choose('skip', 'try')")) + "<if cond=\"a === 'try'\">" +
                             line(assign("b", "choose(1, 6)")) + "</if>",
                         "b"),
                 kOpens,
                 {{"opens", "holds", {}}},
                 "",
                 true});
  all.push_back({"UnnamedOnlyThere",
                 "From 7 on the choice that could open is never offered again, and to begin with only once.",
                 kAgain,
                 answers("<if cond=\"k === 0\">" + line(assign("k", "7") + assign("a", "choose(1, 6)")) + "<else/>" +
                             line(assign("a", "choose(2, 3)")) + "</if>",
                         "a"),
                 kOpens,
                 {{"opens", "refuted", {}}},
                 "",
                 true});
  all.push_back({"UnnamedByTurns",
                 "6 and 1, then 1 and 6: each is taken again and again, and never both at once.",
                 kBoth,
                 answers("", "choose(1, 6)"),
                 "let other = reply(e.ask)\nboth: eventually (said = 6 and other = 6).\none: eventually said = 6.\n",
                 {{"both", "refuted", {}}, {"one", "holds", {}}},
                 "",
                 true,
                 answers("", "choose(1, 6)", "e")});
  all.push_back({"ChancesMeet",
                 "What is drawn comes in every combination some day, with probability 1.",
                 kBoth,
                 answers("", "chance(0.5) ? 6 : 1"),
                 "let other = reply(e.ask)\nboth: eventually (said = 6 and other = 6).\n",
                 {{"both", "holds", {{0, 0}}}},
                 "",
                 false,
                 answers("", "chance(0.5) ? 6 : 1", "e")});
  all.push_back({"TwoChances",
                 "That another chance comes true, in the same place, says nothing of this one.",
                 kAgain,
                 answers(assign("b", "chance(0.5)") + assign("a", "chance(0.5)"), "a ? 6 : 1"),
                 kOpens,
                 {{"opens", "holds", {{0, 0}}}}});
  all.push_back({"ChanceNotTaken",
                 "Who always skips draws nothing; who always tries succeeds with probability 1.",
                 kAgain,
                 answers("", "pick('mode', 'skip', 'try') === 'try' &amp;&amp; chance(0.5) ? 6 : 1"),
                 kOpens,
                 {{"opens", "refuted", {{0, 1}}}}});
  // ---- probabilities
  all.push_back({"Ruin",
                 "From 2 of 4 with 0.4 up: ruin with 1 - 1 / (1 + 1.5²); an end comes with probability 1.",
                 kAgain,
                 answers("<if cond=\"k === 0\">" + assign("k", "1") + assign("a", "2") + "</if>" +
                             assign("a", "a + (chance(0.4) ? 1 : -1)"),
                         "a === 0 ? 0 : a === 4 ? 6 : 1"),
                 "ruin: never said = 0.\nends: eventually (said = 0 or said = 6).\n",
                 {{"ruin", "refuted", {{1 - 1 / 3.25, 1 - 1 / 3.25}}}, {"ends", "holds", {{0, 0}}}},
                 "skills: {Ask: {file: skills/Ends.scxml}}\n"});
  all.push_back({"OtherDiceInTurn",
                 "The second die is another one, though its sides have the same names: 1 - 0.9 · 0.5.",
                 kTwice,
                 answers(assign("k", "k + 1"), "draw(k === 1 ? [[0.1, 6], [0.9, 1]] : [[0.5, 6], [0.5, 1]])"),
                 "six: never said = 6.\n",
                 {{"six", "refuted", {{0.55, 0.55}}}}});
  all.push_back(
      {"StayingIsNoProgress",
       "Who waits for ever never loses; who goes once loses with 0.5, and not with more.",
       kAgain,
       answers("", "pick('go', 'stay', 'go') === 'go' ? draw([[0.5, 6], [0.5, 7]]) : draw([[0.5, 1], [0.5, 2]])"),
       "lose: never said = 7.\n",
       {{"lose", "refuted", {{0, 0.5}}}},
       "skills: {Ask: {file: skills/Ends.scxml}}\n"});
  all.push_back({"AtOnceOrForEver",
                 "a for ever loses with probability 1, b at once with 0.3.",
                 kAgain,
                 answers("", "pick('by', 'a', 'b') === 'a' ? draw([[0.1, 7], [0.9, 1]]) : draw([[0.3, 7], [0.7, 6]])"),
                 "lose: never said = 7.\n",
                 {{"lose", "refuted", {{0.3, 1}}}},
                 "skills: {Ask: {file: skills/Ends.scxml}}\n"});
  all.push_back(
      {"BoldAndTimidPlay",
       "From 1 to 4 with 0.4 up, and bets of one or two from 2 on. Bold: 0.4 · 0.4. Timid at 2 and bold at 3, "
       "where losing throws back to 1: v = 0.4 (0.4 + 0.24 v) + 0.24 v at 2, and 0.4 v at 1.",
       kAgain,
       answers("<if cond=\"k === 0\">" + assign("k", "1") + assign("a", "1") +
                   "</if><if cond=\"a &gt; 0 &amp;&amp; a &lt; 4\">" +
                   assign("b", "a &gt;= 2 ? pick('bet', 1, 2) : 1") +
                   assign("a", "Math.max(0, Math.min(4, a + (chance(0.4) ? b : -b)))") + "</if>",
               "a === 4 ? 6 : a === 0 ? 0 : 1"),
       "wins: never said = 6.\nloses: never said = 0.\nends: eventually (said = 0 or said = 6).\n",
       {{"wins", "refuted", {{0.4 * 0.16 / 0.664, 0.16}}},
        {"loses", "refuted@0.1", {{0.84, 1 - 0.4 * 0.16 / 0.664}}},
        {"ends", "holds", {{0, 0}}}},
       "skills: {Ask: {file: skills/Ends.scxml}}\n"});
  all.push_back({"OwedAtTheEnd",
                 "Two throws, and the mission ends without a six in 25 of 36 cases.",
                 kTwice,
                 answers("", "draw([[1/6, 6], [5/6, 1]])"),
                 kOpens + "soon: eventually said = 6 within 1 s.\n",
                 {{"opens", "refuted", {{25.0 / 36, 25.0 / 36}}}, {"soon", "holds", {{0, 0}}}}});
  all.push_back({"BrokenFromTheBeginning",
                 "In a quarter of the cases it never opens, else with probability 1.",
                 kAgain,
                 answers("<if cond=\"k === 0\">" + assign("k", "1") + assign("b", "chance(0.25)") + "</if>",
                         "b ? 1 : chance(0.5) ? 6 : 1"),
                 kOpens,
                 {{"opens", "refuted", {{0.25, 0.25}}}}});
  all.push_back({"TriesInTime",
                 "Four tries within 300 ms, three within 299 ms.",
                 kEachTick,
                 answers("", "chance(0.5) ? 6 : 1"),
                 "four: eventually said = 6 within 300 ms.\nthree: eventually said = 6 within 299 ms.\n",
                 {{"four", "refuted@0.3", {{1.0 / 16, 1.0 / 16}}}, {"three", "refuted@0.299", {{0.125, 0.125}}}}});
  // ---- faults
  all.push_back({"LateAtTheLastCall",
                 "Asked at 100, 200 and 300 ms; what is late is so 40 ms behind that, and the mission ends then.",
                 "<Repeat num_cycles=\"3\"><Sequence><Sleep msec=\"100\"/><ForceSuccess><Condition ID=\"Ask\"/>"
                 "</ForceSuccess></Sequence></Repeat>",
                 answers(assign("k", "k + 1"), "k"),
                 "a: after said = 2, eventually said = 3 within 140 ms.\n"
                 "b: after said = 2, eventually said = 3 within 141 ms.\nc: eventually said = 3.\nd: "
                 "event(error(d.ask)) at most 3 times.\n"
                 "e: event(error(d.ask)) at most 2 times.\n",
                 {{"a", "refuted@0.34", {}},
                  {"b", "holds", {}},
                  {"c", "refuted@0.34", {}},
                  {"d", "holds", {}},
                  {"e", "refuted", {}}},
                 "verify: {faults: {any_of: [{late: d.ask}]}}\n"});
  all.push_back(
      {"LateWhenTheDeadlineIsOver",
       "Asked at 100 ms and answered at 120, which the fault keeps back until the call is late, at 140.",
       kAgain,
       chart("<state id=\"t\"><transition event=\"d.ask.request\"><send type=\"thrift\" target=\"d\" "
             "event=\"ask.reply\" delay=\"20ms\"><param name=\"result\" expr=\"3\"/></send></transition></state>"),
       "a: whenever event(request(d.ask)), (event(error(d.ask)) or event(reply(d.ask))) within 40 ms.\n"
       "b: never event(error(d.ask)).\n",
       {{"a", "holds", {}}, {"b", "refuted@0.14", {}}},
       "verify: {faults: {any_of: [{late: d.ask}]}}\n"});
  all.push_back({"AnswerHeldBack",
                 "By 30 ms, which is in time for the call.",
                 kAgain,
                 answers("", "6"),
                 "a: eventually said = 6 within 130 ms.\nb: eventually said = 6 within 129 ms.\n"
                 "c: never event(error(d.ask)).\n",
                 {{"a", "holds", {}}, {"b", "refuted@0.129", {}}, {"c", "holds", {}}},
                 "verify: {faults: {any_of: [{delay: {message: d.ask.reply, by: 30 ms}}]}}\n"});
  all.push_back(
      {"GoneForEver",
       "Nobody need bring the component back, and no fairness of what it chooses does.",
       kAgain,
       answers("", "pick('says', 1, 6)"),
       "a: never event(error(d.ask)).\nb: whenever event(error(d.ask)), robot shall said = 6 eventually.\n" + kOpens,
       {{"a", "refuted@0.1", {}}, {"b", "refuted", {}}, {"opens", "refuted", {}}},
       "verify: {fair: [m.says], faults: {any_of: [{kill: d}]}}\n"});
  const std::string then =
      "<Sequence><ForceSuccess><Condition ID=\"Ask\"/></ForceSuccess><Sleep msec=\"100\"/>"
      "<ForceSuccess><Condition ID=\"AskE\"/></ForceSuccess></Sequence>";
  const std::string at_once =
      "<Sequence><ForceSuccess><Condition ID=\"Ask\"/></ForceSuccess><ForceSuccess>"
      "<Condition ID=\"AskE\"/></ForceSuccess></Sequence>";
  const std::string never_both = "let other = reply(e.ask)\nboth: never (said = 1 and other = 1).\n";
  all.push_back({"OneFaultAfterTheOther",
                 "The first is gone when the other comes, before one tick.",
                 then,
                 answers("", "6"),
                 never_both,
                 {{"both", "refuted@0.1", {}}},
                 "verify: {faults: {at_most: 1, " + kTwoFaults,
                 false,
                 answers("", "6", "e")});
  all.push_back({"TwoFaultsAtOnce",
                 "Two may stand, so they may both come before the first tick.",
                 at_once,
                 answers("", "6"),
                 never_both,
                 {{"both", "refuted@0.0", {}}},
                 "verify: {faults: {at_most: 2, " + kTwoFaults,
                 false,
                 answers("", "6", "e")});
  all.push_back({"OneFaultAtATime",
                 "Both are asked at one instant, and one fault stands.",
                 at_once,
                 answers("", "6"),
                 never_both,
                 {{"both", "holds", {}}},
                 "verify: {faults: {at_most: 1, " + kTwoFaults,
                 false,
                 answers("", "6", "e")});
  // ---- values
  all.push_back({"ZeroOfEitherSignIsChosen",
                 "0 and -0 are two alternatives: at the first question 1 divided by what is chosen tells them apart.",
                 kTwice,
                 answers(assign("a", "choose(0, -0)"), "1 / a &lt; 0 ? 6 : 1"),
                 "negative: never said = 6.\nother: never said = 1.\n",
                 {{"negative", "refuted@0", {}}, {"other", "refuted@0", {}}}});
  all.push_back({"NullIsChosen",
                 "null is an alternative like any other.",
                 kTwice,
                 answers(assign("a", "choose(1, null)"), "a === null ? 6 : 1"),
                 "nothing: never said = 6.\n",
                 {{"nothing", "refuted@0", {}}}});
  all.push_back({"WhatIsCountedPerTicksComesAgain",
                 "1 at 100 ms, 2 at 200, 0 at 300, and round again: no state holds how many ticks there were.",
                 kAgain,
                 answers(assign("k", "(k + 1) % 3"), "k"),
                 "two: said = 1 at most 1 times per 2 ticks.\n"
                 "three: said = 1 at most 1 times per 3 ticks.\n"
                 "twice: said = 1 at most 2 times per 5 ticks.\n"
                 "twice6: said = 1 at most 2 times per 6 ticks.\n"
                 "per_event: said = 1 at most 1 times per 2 events.\n",
                 {{"two", "holds", {}},
                  {"three", "refuted@0.4", {}},
                  {"twice", "holds", {}},
                  {"twice6", "refuted@0.7", {}},
                  {"per_event", "holds", {}}}});
  // ---- timers that are cancelled
  const auto asked_thrice = [](const std::string& begins, const std::string& cancels) {
    const auto on = [](const std::string& cond, const std::string& does) {
      return "<transition event=\"d.ask.request\" cond=\"" + cond + "\">" + does + "</transition>";
    };
    return chart(
        "<datamodel><data id=\"k\" expr=\"0\"/><data id=\"z\" expr=\"0\"/></datamodel><state id=\"t\"><transition "
        "event=\"x\">" +
        assign("z", "1") + "</transition>" + on("k === 0", assign("k", "1") + begins + reply("1")) +
        on("k === 1", cancels + assign("k", "2") + reply("1")) + on("k === 2", reply("z === 0 ? 6 : 2")) + "</state>");
  };
  const std::string thrice =
      "<Sequence><ForceSuccess><Condition ID=\"Ask\" name=\"A\"/></ForceSuccess><Sleep msec=\"100\"/><ForceSuccess>"
      "<Condition ID=\"Ask\" name=\"B\"/></ForceSuccess><Sleep msec=\"200\"/><Condition ID=\"Ask\" name=\"Z\"/>"
      "</Sequence>";
  const std::string sends_x = "<send id=\"s1\" event=\"x\" delay=\"250ms\"/>";
  const std::string sends_other = "<send id=\"s2\" event=\"x\" delay=\"250ms\"/>";
  all.push_back({"CancelThatFindsAnotherTimer",
                 "Only s1 is cancelled at 100 ms; of the two sends, either of which is on its way, s2 rings at 250 ms.",
                 thrice,
                 asked_thrice("<if cond=\"chance(0.5)\">" + sends_other + "<else/>" + sends_x + "</if>",
                              "<cancel sendid=\"s1\"/>"),
                 "a: never said = 6.\nb: never said = 2.\n",
                 {{"a", "refuted@0.3", {{0.5, 0.5}}}, {"b", "refuted@0.3", {{0.5, 0.5}}}}});
  all.push_back({"CancelThatFindsNone",
                 "Nothing is on its way, or s1, which is cancelled: nothing rings. Or s2, which rings.",
                 thrice,
                 asked_thrice("<if cond=\"pick('a', 0, 1, 2) === 0\"><log expr=\"'none'\"/><elseif cond=\"pick('b', "
                              "true, false)\"/>" +
                                  sends_x + "<else/>" + sends_other + "</if>",
                              "<cancel sendid=\"s1\"/>"),
                 "a: never said = 6.\nb: never said = 2.\n",
                 {{"a", "refuted@0.3", {}}, {"b", "refuted@0.3", {}}}});
  // ---- timelines
  const std::string once_false = "verify: {faults: {at_most: 1, any_of: [{falsify: {call: d.ask, value: 1}}]}}\n";
  all.push_back({"ClearsItsOwn",
                 "From 150 ms to 350 ms d is not reached: errors at 200 and 300 ms. What verify tries has no number of "
                 "the timeline's: the second change to 1 is at 400 ms, behind the errors, of which there are only two.",
                 kEachTick,
                 answers("", "5"),
                 "a: never event(error(d.ask)).\nb: event(error(d.ask)) at most 2 times.\nc: said = 1 at most 1 "
                 "times.\nd: event(error(d.ask)) at most 1 times.\n",
                 {{"a", "refuted@0.2", {}}, {"b", "holds", {}}, {"c", "refuted@0.4", {}}, {"d", "refuted@0.3", {}}},
                 once_false,
                 false,
                 "",
                 "duration: 8 s\ntimeline:\n  - {at: 350 ms, clear: 1}\n  - {at: 150 ms, unreachable: d.ask}\n"});
  all.push_back({"CalledFromOutside",
                 "The model adds 1 or 2 when it is asked at 0, 100 and 200 ms, and at 150 ms by the timeline, to which "
                 "nobody listens.",
                 kEachTick,
                 answers(assign("k", "Math.min(k + pick('by', 1, 2), 9)"), "k"),
                 "a: never said = 8.\nb: never said = 4.\nc: never said = 9.\n",
                 {{"a", "refuted@0.2", {}}, {"b", "refuted@0.1", {}}, {"c", "refuted@0.3", {}}},
                 "",
                 false,
                 "",
                 "duration: 8 s\ntimeline:\n  - {at: 150 ms, call: d.ask}\n"});
  all.push_back({"CutOffAtADeadline",
                 "The mission is stopped at 250 ms. What would have been due there may have been to come; what was due "
                 "before was not.",
                 kAgain,
                 answers("", "5"),
                 "w: eventually said = 9 within 250 ms.\nv: eventually said = 9 within 249 ms.\nz: whenever said "
                 "= 5, said = 9 within 50 ms.\ny: whenever said = 5, said = 9 within 150 ms.\n",
                 {{"w", "holds", {}}, {"v", "refuted@0.249", {}}, {"z", "refuted@0.15", {}}, {"y", "holds", {}}},
                 "",
                 false,
                 "",
                 "duration: 8 s\ntimeline:\n  - {at: 250 ms, stop: mission}\n"});
  all.push_back({"CutOffAtATick",
                 "As a stop between two ticks.",
                 kAgain,
                 answers("", "5"),
                 "w: eventually said = 9 within 300 ms.\nv: eventually said = 9 within 299 ms.\n",
                 {{"w", "holds", {}}, {"v", "refuted@0.299", {}}},
                 "",
                 false,
                 "",
                 "duration: 8 s\ntimeline:\n  - {at: 300 ms, stop: mission}\n"});
  all.push_back({"WhatTheTimelineCannotDo",
                 "Faults of verify may have killed Ask before: the timeline's kill is noted then, as in a run. The "
                 "second clear finds nothing.",
                 kEachTick,
                 answers("", "5"),
                 "a: never said = 9.\nb: event(request(d.ask)) at most 1 times.\n",
                 {{"a", "holds", {}}, {"b", "refuted@0.1", {}}},
                 "verify: {faults: {at_most: 1, any_of: [{kill: Ask}]}}\n",
                 false,
                 "",
                 "duration: 8 s\ntimeline:\n  - {at: 0 ms, falsify: {call: d.ask, value: 1, count: 1}}\n  - {at: 250 "
                 "ms, kill: Ask}\n  - "
                 "{at: 250 ms, restart: Ask}\n  - {at: 350 ms, restart: Ask}\n  - {at: 450 ms, clear: 1}\n"});
  all.push_back({"ViolatedBehindAnother",
                 "A run would stop at 100 ms, where b is violated. Each is judged by itself.",
                 kAgain,
                 answers("", "5"),
                 "b: never said = 5.\nc: eventually said = 9 within 250 ms.\n",
                 {{"b", "refuted@0.1", {}}, {"c", "refuted@0.25", {}}},
                 "",
                 false,
                 "",
                 "duration: 8 s\nstop_when_violated: true\n"});
  all.push_back({"LoopBehindALoop",
                 "The timeline of a loop comes at its times in all its rounds; what is owed is owed behind it too.",
                 kAgain,
                 answers("", "pick('o', 1, 6)"),
                 "a: eventually said = 7.\nc: event(error(d.ask)) at most 1 times.\n",
                 {{"a", "refuted", {}}, {"c", "refuted@0.6", {}}},
                 "",
                 false,
                 "",
                 "timeline:\n  - {at: 0.2 s, unreachable: d.ask}\n  - {at: 0.3 s, clear: 1}\nloop: {from: 2, to: "
                 "5}\nduration: 1.3 s\n"});
  return all;
}

class KnownVerdicts : public ::testing::TestWithParam<Known> {
 protected:
  project::Plan plan() const {
    const Known& of = GetParam();
    const auto write = [&](const std::string& name, const std::string& text) {
      std::filesystem::create_directories((folder_.path() / name).parent_path());
      ASSERT_TRUE(text::write_file(folder_.path() / name, text));
    };
    write("interfaces/d.thrift", "service D { i32 ask() }\n");
    write("mission.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">" + of.tree + "</BehaviorTree></root>");
    write("skills/Ask.scxml", asks("d"));
    write("skills/AskE.scxml", asks("e"));
    write("skills/Ends.scxml",
          chart("<state id=\"a\"><onentry><send type=\"thrift\" target=\"d\" event=\"ask\"/></onentry>"
                "<transition event=\"d.ask.reply\" cond=\"_event.data.result === 0 || _event.data.result &gt; 5\" "
                "target=\"success\"/><transition event=\"d.ask.reply error\" target=\"failure\"/></state>"
                "<final id=\"success\"/><final id=\"failure\"/>"));
    write("skills/Hold.scxml", chart("<state id=\"h\"><transition event=\"tick\"/><transition event=\"stop\" "
                                     "target=\"success\"/></state><final id=\"success\"/>"));
    write("skills/Slow.scxml",
          chart("<state id=\"h\"><transition event=\"tick\"/><transition event=\"halt\" target=\"w\"/></state>"
                "<state id=\"w\"><onentry><send event=\"done\" delay=\"40ms\"/></onentry><transition event=\"done\" "
                "target=\"success\"/></state><final id=\"success\"/>"));
    write("skills/Later.scxml",
          chart("<state id=\"w\"><onentry><send event=\"go\" delay=\"50ms\"/></onentry><transition event=\"go\" "
                "target=\"a\"/></state><state id=\"a\"><onentry><send type=\"thrift\" target=\"d\" event=\"ask\"/>"
                "</onentry><transition event=\"d.ask.reply\" target=\"success\"/><transition event=\"error\" "
                "target=\"failure\"/></state><final id=\"success\"/><final id=\"failure\"/>"));
    write(
        "skills/Either.scxml",
        chart("<state id=\"w\"><onentry><send type=\"thrift\" target=\"d\" event=\"ask\"/><send event=\"go\" "
              "delay=\"50ms\"/></onentry><transition event=\"go\" target=\"failure\"/><transition event=\"d.ask.reply "
              "error\" target=\"success\"/></state><final id=\"success\"/><final id=\"failure\"/>"));
    write("models/m.scxml", of.model);
    const bool two = !of.other_model.empty();
    if (two) write("models/n.scxml", of.other_model);
    write("r.req", "let said = reply(d.ask)\n" + of.requirements);
    write("sentree.yaml",
          std::string("mission: {file: mission.xml, rate: 10 Hz}\nservices: {d: {interface: d.thrift/D, at: model}") +
              (two ? ", e: {interface: d.thrift/D, at: model}" : "") +
              "}\nmodels: [{file: models/m.scxml, serves: [d]}" + (two ? ", {file: models/n.scxml, serves: [e]}" : "") +
              "]\nmonitors: [{file: r.req}]\n" + of.yaml);
    auto project = project::load_project(folder_.path());
    EXPECT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    project::Scenario scenario = project::plain_scenario(std::move(*project.value));
    if (!of.scenario.empty()) {
      write("s.yaml", "project: .\nclock: virtual\n" + of.scenario);
      auto loaded = project::load_scenario(folder_.path() / "s.yaml");
      EXPECT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
      scenario = std::move(*loaded.value);
    }
    auto prepared = project::prepare(with_models(std::move(scenario)));
    for (const Diagnostic& diagnostic : prepared.diagnostics) EXPECT_TRUE(prepared.ok()) << to_string(diagnostic);
    return std::move(prepared.value.value());
  }

  // What the monitor says when a counterexample is run again; of a loop, behind so many more rounds.
  static monitor::State again(const Verification& found, const Judgement& judgement, const project::Plan& of,
                              std::size_t rounds = 0) {
    project::Scenario example = counterexample(found.graph, judgement, of.scenario);
    if (example.loop) {
      const auto ticks = example.loop->ticks.last - example.loop->ticks.first + 1;
      example.duration += found.graph.period * static_cast<std::int64_t>(ticks * rounds);
    }
    // As it is written.
    std::stable_sort(example.timeline.begin(), example.timeline.end(),
                     [](const auto& a, const auto& b) { return a.at < b.at; });
    auto prepared = project::prepare(std::move(example));
    EXPECT_TRUE(prepared.ok());
    const auto told = retell(*prepared.value);
    EXPECT_TRUE(told);
    monitor::MonitorSet monitors(prepared.value->monitors, TimePoint{});
    std::vector<monitor::MonitorSet::Decided> decided;
    for (const Told& tick : *told) {
      for (const Message& message : tick.messages) monitors.observe(message, decided);
    }
    monitors.advance(told->back().at, decided);
    for (std::size_t i = 0; i < prepared.value->monitors.size(); ++i) {
      if (prepared.value->monitors[i].name() == judgement.requirement) return monitors.state(i);
    }
    ADD_FAILURE() << judgement.requirement;
    return monitors.state(0);
  }

  TemporaryFolder folder_{"known"};
};

TEST_P(KnownVerdicts, AreFound) {
  SCOPED_TRACE(GetParam().why);
  const project::Plan of = plan();
  for (const bool memory : {true, false}) {
    SCOPED_TRACE(memory ? "with a memory of steps" : "every step executed");
    Asked asked;
    asked.explore.memory_of_steps = memory;
    asked.explore.faults = of.scenario.project.verify.faults;
    asked.explore.faults_at_most = of.scenario.project.verify.faults_at_most;
    asked.judge.fair = of.scenario.project.verify.fair;
    asked.judge.all_fair = GetParam().all_fair;
    const Verification found = verify(of, asked);
    for (const Diagnostic& error : found.errors) FAIL() << to_string(error);
    ASSERT_TRUE(found.graph.complete);
    ASSERT_EQ(found.judgements.size(), GetParam().expected.size());
    for (const Expected& expected : GetParam().expected) {
      SCOPED_TRACE(expected.requirement);
      const auto judgement = std::find_if(found.judgements.begin(), found.judgements.end(),
                                          [&](const Judgement& j) { return j.requirement == expected.requirement; });
      ASSERT_NE(judgement, found.judgements.end());
      ASSERT_EQ(judgement->error, "");
      const std::size_t at = expected.verdict.find('@');
      EXPECT_EQ(judgement->vacuous.empty() ? to_string(judgement->finding) : "vacuous", expected.verdict.substr(0, at));
      if (at != std::string::npos) {
        EXPECT_DOUBLE_EQ(seconds(judgement->at), std::stod(expected.verdict.substr(at + 1)));
      }
      if (judgement->finding == Finding::kRefuted) {
        const bool is_owed = judgement->path->loop || judgement->state == "the mission ends";
        for (const std::size_t rounds : {0U, 1U, 40U}) {
          if (rounds > 0 && !judgement->path->loop) break;
          const monitor::State state = again(found, *judgement, of, rounds);
          EXPECT_EQ(state.verdict, is_owed ? monitor::Verdict::kUndecided : monitor::Verdict::kViolated);
          const std::size_t i = static_cast<std::size_t>(judgement - found.judgements.begin());
          if (is_owed) {
            EXPECT_TRUE(monitor::standing(of.monitors[i], state).pending);
          }
        }
      }
      EXPECT_EQ(judgement->least.has_value(), found.graph.probabilistic);
      if (!expected.p) continue;
      ASSERT_TRUE(judgement->least);
      EXPECT_NEAR(judgement->least->low, expected.p->first, 1e-9);
      EXPECT_NEAR(judgement->least->high, expected.p->first, 1e-9);
      EXPECT_NEAR(judgement->greatest->low, expected.p->second, 1e-9);
      EXPECT_NEAR(judgement->greatest->high, expected.p->second, 1e-9);
    }
  }
}

// The same by chance: between the runs that violate it and those beside that still owe something where they end.
TEST_P(KnownVerdicts, AreWhatRunsByChanceCountTowards) {
  if (GetParam().yaml.find("faults") != std::string::npos) GTEST_SKIP() << "no faults come in statistics";
  const project::Plan of = plan();
  const auto runs = [&](std::uint64_t count, bool memory) {
    std::vector<std::vector<Came>> all;
    Sampling sampling;
    sampling.runs = count;
    sampling.length = std::chrono::seconds(8);
    sampling.memory_of_periods = memory;
    sampling.told = [&](const std::vector<Came>& of_run) {
      all.push_back(of_run);
      return true;
    };
    EXPECT_EQ(sample(of, sampling), count);
    return all;
  };
  constexpr std::uint64_t kExecuted = 20;
  const auto all = runs(2'000, true);
  EXPECT_EQ(runs(kExecuted, false), std::vector(all.begin(), all.begin() + kExecuted));
  const auto share = [&](std::size_t monitor, Came came) {
    const auto came_so = [&](const std::vector<Came>& run) { return run[monitor] == came; };
    return static_cast<double>(std::count_if(all.begin(), all.end(), came_so)) / static_cast<double>(all.size());
  };
  for (const Expected& expected : GetParam().expected) {
    SCOPED_TRACE(expected.requirement);
    std::size_t i = 0;
    while (of.monitors[i].name() != expected.requirement) ++i;
    const double violated = share(i, Came::kViolated);
    if (expected.verdict == "holds" && !expected.p) {
      EXPECT_EQ(violated, 0);
    }
    if (!expected.p) continue;
    const auto [least, greatest] = *expected.p;
    const auto off = [&](double p) { return 4 * std::sqrt(p * (1 - p) / static_cast<double>(all.size())) + 1e-9; };
    EXPECT_LE(violated, greatest + off(greatest));
    EXPECT_GE(violated + share(i, Came::kStillOwed), least - off(least));
  }
}

// Of two faults that may stand at a time the one that the violation needs.
class Simplified : public KnownVerdicts {};
TEST_P(Simplified, CounterexamplesHaveNoFaultThatIsNotNeeded) {
  const project::Plan of = plan();
  Asked asked;
  asked.explore.faults = of.scenario.project.verify.faults;
  asked.explore.faults_at_most = of.scenario.project.verify.faults_at_most;
  const Verification found = verify(of, asked);
  const Judgement& judgement = found.judgements.front();
  ASSERT_EQ(judgement.finding, Finding::kRefuted);
  project::Scenario example = counterexample(found.graph, judgement, of.scenario);
  simplify(example, of.scenario, [&](const project::Scenario& tried) {
    auto prepared = project::prepare(tried);
    const auto told = retell(*prepared.value);
    monitor::MonitorSet monitors(prepared.value->monitors, TimePoint{});
    std::vector<monitor::MonitorSet::Decided> decided;
    for (const Told& tick : *told) {
      for (const Message& message : tick.messages) monitors.observe(message, decided);
    }
    return monitors.state(0).verdict == monitor::Verdict::kViolated;
  });
  ASSERT_EQ(example.timeline.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<project::intervention::Falsify>(example.timeline.front().what));
}
INSTANTIATE_TEST_SUITE_P(ByHand, Simplified,
                         ::testing::Values(Known{"TwoFaults",
                                                 "Only what d says is spoken of.",
                                                 kBoth,
                                                 answers("", "3"),
                                                 "falsified: never said = 1.\n",
                                                 {},
                                                 "verify: {faults: {at_most: 2, any_of: [{unreachable: e.ask}, "
                                                 "{falsify: {call: d.ask, value: 1}}]}}\n",
                                                 false,
                                                 answers("", "6", "e")}),
                         [](const auto& of) { return of.param.name; });

// What is expected is what the timeline says, in order.
class Loops : public KnownVerdicts {};
TEST_P(Loops, HaveNoFaultThatIsNotNeeded) {
  const project::Plan of = plan();
  Asked asked;
  asked.explore.faults = of.scenario.project.verify.faults;
  asked.explore.faults_at_most = of.scenario.project.verify.faults_at_most;
  asked.judge.all_fair = GetParam().all_fair;
  const Verification found = verify(of, asked);
  for (const Diagnostic& error : found.errors) FAIL() << to_string(error);
  const Judgement& judgement = found.judgements.front();
  ASSERT_EQ(judgement.finding, Finding::kRefuted);
  ASSERT_TRUE(judgement.path->loop);
  std::vector<std::string> faults;
  for (const project::Injection& one : counterexample(found.graph, judgement, of.scenario).timeline)
    faults.push_back(project::describe(one.what));
  std::vector<std::string> expected;
  for (const Expected& one : GetParam().expected) expected.push_back(one.verdict);
  EXPECT_EQ(faults, expected);
  for (const std::size_t rounds : {0U, 1U, 40U}) {
    EXPECT_EQ(again(found, judgement, of, rounds).verdict, monitor::Verdict::kUndecided);
  }
}
const std::string kAskedAfterAll =
    "let other = reply(e.ask)\nopens: whenever event(error(d.ask)), robot shall said = 6 eventually.\n";
INSTANTIATE_TEST_SUITE_P(
    ByHand, Loops,
    ::testing::Values(Known{"TheOtherOfTwo",
                            "That e is not reached has nothing to do with d, which never answers again.",
                            kBoth,
                            answers("", "6"),
                            kAskedAfterAll,
                            {{"", "kill d", {}}},
                            "verify: {faults: {at_most: 2, any_of: [{unreachable: e.ask}, {kill: d}]}}\n",
                            false,
                            answers("", "6", "e")},
                      Known{"NoneAtAll",
                            "It never opens by itself.",
                            kBoth,
                            answers("", "1"),
                            "opens: eventually said = 6.\n",
                            {},
                            "verify: {faults: {at_most: 2, any_of: [{unreachable: e.ask}, {kill: d}]}}\n",
                            false,
                            answers("", "6", "e")},
                      Known{"OneThenTheOther",
                            "e fails once and is back, since one fault stands at a time; then d never answers again.",
                            kBoth,
                            answers("", "6"),
                            "opens: whenever event(error(e.ask)), robot shall event(reply(d.ask)) eventually.\n",
                            {{"", "e.ask is unreachable", {}}, {"", "clear 1", {}}, {"", "kill d", {}}},
                            "verify: {faults: {at_most: 1, any_of: [{unreachable: e.ask}, {kill: d}]}}\n",
                            false,
                            answers("", "6", "e")},
                      Known{"WhileBothAreFair",
                            "Where e can be asked it takes each alternative, whatever d is; without d nothing opens.",
                            kBoth,
                            answers("", "6"),
                            kAskedAfterAll,
                            {{"", "kill d", {}}},
                            "verify: {faults: {at_most: 2, any_of: [{unreachable: e.ask}, {kill: d}]}}\n",
                            true,
                            answers("", "choose(1, 6)", "e")}),
    [](const auto& of) { return of.param.name; });

INSTANTIATE_TEST_SUITE_P(ByHand, KnownVerdicts, ::testing::ValuesIn(known()),
                         [](const auto& of) { return of.param.name; });

}  // namespace
}  // namespace sentree::verify
