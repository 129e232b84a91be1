#include "sentree/scxml/script_functions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "sentree/scxml/step.h"
#include "sentree/text/xml.h"

namespace sentree::scxml {
namespace {

using testing::HasSubstr;

// A chart that executes CALL on each event "e" and says what it gives.
Chart calling(const std::string& script, const std::string& call) {
  auto loaded = load(
      "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\">\n"
      "<datamodel><data id=\"x\" expr=\"1\"/><data id=\"q\"/><data id=\"said\"/></datamodel>\n<script>" +
          text::xml_escape(script) + "</script>\n<state id=\"a\"><transition event=\"e\"><script>" +
          text::xml_escape("x = x + 1; said = " + call) + "</script></transition></state></scxml>",
      "c.scxml");
  for (const Diagnostic& diagnostic : loaded.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  return *std::move(loaded.value);
}

// What the calls give, one after the other; `afresh`: by another process each time. Why it cannot be saved, if so.
struct Told {
  std::vector<std::string> said;
  std::optional<Diagnostic> refused;
};
Told told(const std::string& script, const std::string& call, bool afresh) {
  std::optional<Chart> chart = calling(script, call);
  Host host;
  Session session;
  Effects effects;
  start(*chart, session, {}, {}, effects, host);
  Told out;
  for (int i = 0; i < 4; ++i) {
    const auto saved = save(*chart, session);
    if (!saved) out.refused = saved.error();
    if (afresh && saved) {
      chart = calling(script, call);
      auto restored = restore(*chart, *saved);
      EXPECT_TRUE(restored) << restored.error().message;
      session = *std::move(restored);
    }
    step(*chart, session, Event{.name = "e"}, {}, effects, host);
    out.said.push_back(to_json(Value(session.data(*chart))));
  }
  return out;
}

TEST(ScriptFunctions, ThatKeepNothingAreTheSameInARestoredSession) {
  const std::vector<std::pair<std::string, std::string>> charts{
      {"function twice(v) { return 2 * v; } function four(v) { return twice(twice(v)); }", "four(x)"},
      {"var next = function (v) { return v + x; }\nvar other = function () { return next(1); };", "other()"},
      {"function sum(of) { var s = 0; of.forEach(function (v) { s += v; }); return s; }", "sum([x, 2, 3])"},
      {"function above(of) { return of.filter(function (v) { return v > x; }).length; }", "above([1, 2, 3, 4])"},
      {"var scaled = (function () { var k = 3; return function (v) { return v * k; }; })();", "scaled(x)"},
      {"var scaled = (function (k) { return function (v) { return Math.min(v, k) * k; }; })(30);", "scaled(x)"},
      {"function by(k) { return function (v) { return v % k; }; } var even = by(2);", "even(x)"},
      {"var name = (function () { var all = ['a', 'b', 'c']; return function (i) { return all[i]; }; })();",
       "name(x - 2)"},
      {"var fact = (function () { function f(n) { return n < 2 ? 1 : n * f(n - 1); } return function (n) { return "
       "f(n); }; })();",
       "fact(x)"},
      {"function Point(u) { this.u = u; } Point.prototype.far = function () { return this.u > 2; };",
       "new Point(x).far()"},
      {"function size(of) { return of.length; } size.unit = 'm';", "size([x]) + size.unit"},
      {"var n = 0; function next() { n = n + 1; return n; }", "next()"},
      {"if (x > 5) { q = 1; } function f() { return x; }", "f()"},
  };
  for (const auto& [script, call] : charts) {
    SCOPED_TRACE(script);
    const Told whole = told(script, call, false);
    EXPECT_FALSE(whole.refused) << to_string(*whole.refused);
    EXPECT_EQ(told(script, call, true).said, whole.said);
  }
}

TEST(ScriptFunctions, ThatKeepSomethingAreRefusedWithTheirNameAndPlaceAndGoOnInARun) {
  struct Keeping {
    std::string script;
    std::string call;
    std::string name;
    std::vector<std::string> said;
  };
  const std::vector<Keeping> charts{
      {"var next = (function () { var n = 0; return function () { n = (n + 1) % 3; return n; }; })();",
       "next()",
       "\"next\"",
       {"1", "2", "0", "1"}},
      {"function next() { next.n = (next.n || 0) + 1; return next.n; }", "next()", "\"next\"", {"1", "2", "3", "4"}},
      {"var next = function me() { me.n = (me.n || 0) + 1; return me.n; };",
       "next()",
       "\"next\"",
       {"1", "2", "3", "4"}},
      {"function next() { var me = arguments.callee; me.n = (me.n || 0) + 1; return me.n; }",
       "next()",
       "\"next\"",
       {"1", "2", "3", "4"}},
      {"function K() {} K.prototype.x = 2;", "(K.prototype.x++, new K().x)", "\"K\"", {"3", "4", "5", "6"}},
      {"var add = (function () { var all = []; return function () { all.push(1); return all.length; }; })();",
       "add()",
       "\"add\"",
       {"1", "2", "3", "4"}},
      {"var box = (function () { var o = {n: 0}; return function () { return o; }; })();",
       "++box().n",
       "\"box\"",
       {"1", "2", "3", "4"}},
      {"function make() { var n = 0; return function () { n++; return n; }; }\nvar next = make();",
       "next()",
       "\"next\"",
       {"1", "2", "3", "4"}},
      // What is made of data, and another one with other data.
      {"var above = (function () { var k = x; return function (v) { return v - k; }; })();",
       "above(x)",
       "\"above\"",
       {"1", "2", "3", "4"}},
      {"var f; if (x > 1) { f = function () { return 1; }; } else { f = function () { return 2; }; }",
       "f()",
       "\"f\"",
       {"2", "2", "2", "2"}},
      {"var f = x > 1 ? function () { return 1; } : function () { return 2; };", "f()", "\"f\"", {"2", "2", "2", "2"}},
  };
  for (const Keeping& of : charts) {
    SCOPED_TRACE(of.script);
    const Told whole = told(of.script, of.call, false);
    ASSERT_TRUE(whole.refused);
    EXPECT_EQ(whole.refused->code, "scxml.no-value-form");
    EXPECT_THAT(whole.refused->message, HasSubstr(of.name));
    EXPECT_EQ(whole.refused->span.file, "c.scxml");
    EXPECT_GE(whole.refused->span.line, 3);
    // A run has the session itself, in which nothing is lost: the last data are those of the heap.
    std::optional<Chart> chart = calling(of.script, of.call);
    Host host;
    Session session;
    Effects effects;
    start(*chart, session, {}, {}, effects, host);
    for (const std::string& said : of.said) {
      step(*chart, session, Event{.name = "e"}, {}, effects, host);
      EXPECT_EQ(to_json(*session.data(*chart).find("said")), said);
    }
  }
}

TEST(SavedData, AreRefusedWhereTheyHaveWhatNoValueHas) {
  const std::vector<std::pair<std::string, std::string>> data{
      {"[1, , 2]", "gaps"},
      {"(function () { var o = [1]; o.x = 1; return o; })()", "beside its items"},
      {"(function () { var o = [1, 2, 3, 4, 5, 6]; o.x = 1; return o; })()", "beside its items"},
      {"Object.freeze({a: 1})", "frozen"},
      {"Object.seal([1])", "frozen"},
      {"Object.preventExtensions({a: 1})", "no more members"},
      {"Object.defineProperty({a: 1}, 'h', {value: 1})", "hidden"},
      {"Object.defineProperty({}, 'g', {enumerable: true, configurable: true, get: function () { return 1; }})",
       "accessor"},
      {"({get g() { return 1; }})", "accessor"},
      {"Object.create(null)", "without a prototype"},
      {"(function () { var r = /a/g; r.test('aaa'); return r; })()", "lastIndex"},
      {"(function () { var d = new Date(0); d.x = 1; return d; })()", "members of its own"},
      {"new Float64Array(2)", "no Uint8Array"},
      {"new Uint8Array(new ArrayBuffer(8), 2, 2)", "part of a buffer"},
  };
  for (const auto& [expression, why] : data) {
    SCOPED_TRACE(expression);
    const Told whole = told("", "(q = " + expression + ", 0)", false);
    ASSERT_TRUE(whole.refused);
    EXPECT_EQ(whole.refused->code, "scxml.no-value-form");
    EXPECT_THAT(whole.refused->message, testing::AllOf(HasSubstr("\"q\""), HasSubstr(why)));
    EXPECT_EQ(whole.refused->span.line, 2);
  }
}

TEST(SavedData, AreKeptWhereTheyHaveAValue) {
  for (const char* const expression :
       {"[1, undefined, 2]", "[]", "[1, 2, 3, 4, 5, 6, 7]",
        "(function () { var o = [1, 2, 3, 4, 5, 6]; o.x = 1; delete o.x; return o; })()", "Object.keys({a: 1, b: 2})",
        "({a: {b: [1, {c: 2}]}})", "/a/g", "new Date(5)", "new Uint8Array(3)", "-0", "NaN",
        "Object.create(Object.prototype)", "JSON.parse('{\"a\": [1]}')"}) {
    SCOPED_TRACE(expression);
    const std::string call = std::string("(q = ") + expression + ", 0)";
    const Told whole = told("", call, false);
    EXPECT_FALSE(whole.refused) << to_string(*whole.refused);
    EXPECT_EQ(told("", call, true).said, whole.said);
  }
}

}  // namespace
}  // namespace sentree::scxml
