#include "sentree/scxml/expression.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/detail/script_heap.h"
#include "sentree/scxml/model.h"
#include "sentree/text/xml.h"

namespace sentree::scxml {
namespace {

class Scope final : public NativeScope {
 public:
  std::vector<std::optional<Value>> variables;
  Event present;
  bool variable(std::uint32_t slot, ScriptValue& value) override {
    value = variables[slot] ? ScriptValue::of(*variables[slot]) : ScriptValue();
    return true;
  }
  const Event* event() override { return &present; }
  std::string_view system(SystemVariable which) override {
    return which == SystemVariable::kName ? "chart" : "session";
  }
  bool in(std::string_view state) override { return state == "s"; }
  bool call(std::string_view function, List&& arguments, Value& result) override {
    if (function != "first" || arguments.empty()) return false;
    result = arguments.front();
    return result.as_list() == nullptr && result.as_map() == nullptr;
  }
};

class World final : public ScriptWorld {
 public:
  bool script_in(std::string_view state) override { return state == "s"; }
  double script_now_ms() override { return 0; }
  double script_random() override { return 0; }
  const std::vector<NativeFunction>& script_functions() override { return functions_; }
  const std::vector<NativeValue>& script_values() override { return no_values_; }

 private:
  std::vector<NativeFunction> functions_{{"first", [](std::span<const Value> of) -> Result<Value> {
                                            if (of.empty()) return fail("test.nothing", "nothing is first");
                                            return of.front();
                                          }}};
  std::vector<NativeValue> no_values_;
};

const std::vector<std::string> kNames{"a", "b", "c", "d", "e"};

template <class T>
const T& pick(Rng& rng, const std::vector<T>& from) {
  return from[rng.below(from.size())];
}

Value random_value(Rng& rng, int depth) {
  switch (rng.below(depth > 2 ? 6 : 9)) {
    case 0: return {};
    case 1: return rng.below(2) == 0;
    case 2: return static_cast<std::int64_t>(rng.below(7)) - 3;
    case 3:
      return pick<double>(rng, {0.5, -0.0, 1e21, 1e-7, 123456789.125, 0.1, std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity()});
    case 4:
    case 5:
      return pick<std::string>(
          rng, {"", "5", " 12 ", "abc", "abd", "1e3", "0x10", "-3", "é", "true", "a b", ".5", "5.", "NaN"});
    case 6: return List{random_value(rng, depth + 1), random_value(rng, depth + 1)};
    default: return Map{{"level", random_value(rng, depth + 1)}, {"name", random_value(rng, depth + 1)}};
  }
}

std::string random_expression(Rng& rng, int depth) {
  if (depth > 4 || rng.below(4) == 0) {
    return pick<std::string>(rng, {"a",
                                   "b",
                                   "c",
                                   "d",
                                   "e",
                                   "_event.data",
                                   "_event.name",
                                   "_event.sendid",
                                   "_event.data.level",
                                   "a.level",
                                   "b.name",
                                   "c[0]",
                                   "c.length",
                                   "d['level']",
                                   "e[1]",
                                   "_name",
                                   "_sessionid",
                                   "undefined",
                                   "null",
                                   "true",
                                   "false",
                                   "0",
                                   "1",
                                   "20",
                                   "1.5",
                                   "1e3",
                                   ".25",
                                   "'x'",
                                   "\"level\"",
                                   "''",
                                   "'5'",
                                   "a.toString",
                                   "-0",
                                   "9007199254740993",
                                   "1e400",
                                   "'\u00e9'",
                                   "'a b'",
                                   "_event.type",
                                   "_event.origin",
                                   "_event.data.level.name",
                                   "a.level[1]",
                                   "b[c]",
                                   "c['length']",
                                   "d.constructor",
                                   "e.__proto__",
                                   "In('s')",
                                   "In(\"nowhere\")",
                                   "b.missing",
                                   "c[7]"});
  }
  const auto sub = [&] { return random_expression(rng, depth + 1); };
  switch (rng.below(12)) {
    case 11: return "first(" + pick<std::string>(rng, {sub(), sub() + ", " + sub(), sub() + ", first()", ""}) + ")";
    case 10:
      return "Math." + pick<std::string>(rng, {"abs(" + sub() + ")", "ceil(" + sub() + ")", "floor(" + sub() + ")",
                                               "round(" + sub() + ")", "sign(" + sub() + ")", "sqrt(" + sub() + ")",
                                               "min(" + sub() + ", " + sub() + ")", "max(" + sub() + ")",
                                               "max(" + sub() + ", " + sub() + ", " + sub() + ")", "max()",
                                               "abs(" + sub() + ", 1)", "pow(" + sub() + ", 2)", "PI"});
    case 9:
      return pick<std::string>(rng, {"({})", "({level: " + sub() + ", 'a b': " + sub() + "})",
                                     "({name: {level: " + sub() + "}, if: " + sub() + ",})"});
    case 8: return "['abc', 5, \"5\", 0.5, ''].indexOf(" + sub() + ")";
    case 0: return "!" + sub();
    case 1: return "-" + std::string(rng.below(2) ? " " : "") + sub();
    case 2: return "typeof " + sub();
    case 3: return "(" + sub() + ")";
    case 4: return sub() + " ? " + sub() + " : " + sub();
    case 5: return "+" + sub();
    default: {
      const std::string op =
          pick<std::string>(rng, {"+", "-", "*", "/", "%", "<", ">", "<=", ">=", "==", "!=", "===", "!==", "&&", "||"});
      const std::string space = rng.below(3) ? " " : "";
      return sub() + space + op + space + sub();
    }
  }
}

// Whatever the native evaluator decides, the interpreter decides alike; and where the interpreter fails, it does not
// decide.
TEST(NativeExpressions, AgreeWithTheInterpreterOnRandomInputs) {
  int native = 0;
  int objects = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Rng rng(seed);
    std::string source =
        R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" name="chart"><datamodel>)";
    for (const std::string& name : kNames) source += "<data id=\"" + name + "\"/>";
    source += "</datamodel><state id=\"s\"><onentry>";
    for (int i = 0; i < 150; ++i) source += "<log expr=\"" + text::xml_escape(random_expression(rng, 0)) + "\"/>";
    source += "</onentry></state></scxml>";
    const auto loaded = load(source);
    ASSERT_TRUE(loaded.ok());
    const Model& model = loaded.value->model();
    auto heap = ScriptHeap::create(model, 32U << 20U);
    ASSERT_TRUE(heap);
    World world;
    (*heap)->attach(&world);
    ASSERT_TRUE((*heap)->set_system("session", {}));
    for (int round = 0; round < 8; ++round) {
      Scope scope;
      for (std::uint32_t slot = 0; slot < kNames.size(); ++slot) {
        scope.variables.emplace_back();
        if (rng.below(6) != 0) scope.variables.back() = random_value(rng, 0);
        ASSERT_TRUE((*heap)->write(slot, scope.variables.back()));
      }
      scope.present = {.name = "battery.reply", .sendid = rng.below(2) ? "id" : ""};
      if (rng.below(4) != 0) scope.present.data = random_value(rng, 0);
      ASSERT_TRUE((*heap)->set_event(&scope.present));
      for (ExpressionId id = 0; id < model.expressions.size(); ++id) {
        const Expression& expression = model.expressions[id];
        std::vector<std::string> text;
        ScriptValue here;
        if (expression.native.empty() || !evaluate_native(expression.native, scope, text, here)) continue;
        const auto there = (*heap)->evaluate(id);
        ASSERT_TRUE(there) << expression.text << ": " << there.error().message;
        ++native;
        const auto condition = (*heap)->condition(id);
        EXPECT_EQ(here.truthy(), *condition) << expression.text;
        // Of others the interpreter has copies.
        const NativeCode::Op made_by = expression.native.nodes.back().op;
        const bool made = made_by == NativeCode::Op::kObject || made_by == NativeCode::Op::kWith;
        if (here.kind == ScriptValue::Kind::kObject && !made) continue;
        if (made) {
          EXPECT_EQ(to_json(*here.to_value()), to_json(**there)) << expression.text;
          ++objects;
          continue;
        }
        EXPECT_EQ(here.to_value(), *there)
            << expression.text << " here " << (here.to_value() ? to_json(*here.to_value()) : "undefined") << " there "
            << (*there ? to_json(**there) : "undefined");
      }
    }
  }
  EXPECT_GT(native, 20'000);
  EXPECT_GT(objects, 500);
}

TEST(NativeExpressions, LeaveTheRestToTheInterpreter) {
  const SlotLookup slots = [](std::string_view name) {
    return name == "x" ? std::optional<std::uint32_t>(0) : std::nullopt;
  };
  for (const char* source : {"x = 1",  "x++",    "--x",    "f(x)",     "[1]",     "{}",     "y",
                             "x => 1", "x ** 2", "x & 1",  "010",      "x /* */", "1 // 2", "'\\u0041'",
                             "x.y()",  "new X",  "x in y", "a <!-- b", "1.5.2",   "x === ", "(x",
                             "x)",     "",       "return", "this",     "x, 1",    "`x`",    "é"}) {
    EXPECT_TRUE(compile_native(source, slots).empty()) << source;
  }
  EXPECT_FALSE(compile_native(" ( x + 1 ) * - 2 % 3 >= x.y ? x['z'] : ! x ", slots).empty());
  EXPECT_FALSE(compile_native("['a', 2].indexOf(x.y) >= 0", slots).empty());
  for (const char* source : {"['a']", "['a'].length", "[x].indexOf(x)", "['a',].indexOf(x)", "[].indexOf(x)",
                             "['a'].indexOf(x, 1)", "['a'].indexOf(x + 'b')", "['a'].indexOf(['b'].indexOf(x))"}) {
    EXPECT_TRUE(compile_native(source, slots).empty()) << source;
  }
  EXPECT_FALSE(compile_native("({level: x / 2, 'a b': {of: 'x', if: null,}}).level", slots).empty());
  for (const char* source :
       {"({x})", "({x: 1, x: 2})", "({1: x})", "({'1': x})", "({$date: 1})", "({__proto__: x})", "({get x() {}})",
        "({'': x})", "({x: 1", "({,})", "({x: 1,,})", "({[x]: 1})", "({...x})"}) {
    EXPECT_TRUE(compile_native(source, slots).empty()) << source;
  }
  EXPECT_TRUE(compile_native(std::string(1000, '(') + "x" + std::string(1000, ')'), slots).empty());
  const IsGlobal is_global = [](std::string_view name) { return name == "Math" || name == "f"; };
  for (const char* source : {"Math.max(x, 1, -x)", "f()", "f(x, {y: x}) || Math.sign(f(1))", "Math.round(x % 2)"})
    EXPECT_FALSE(compile_native(source, slots, is_global).empty()) << source;
  for (const char* source :
       {"Math", "Math.PI", "Math['max'](x)", "Math.max", "Math.max()", "Math.abs(x, 1)", "f", "f(", "f(x,)", "f(, x)",
        "f(x y)", "g(x)", "x.f(1)", "new f(x)", "f(x)(x)", "['a'].indexOf(f(x))"}) {
    EXPECT_TRUE(compile_native(source, slots, is_global).empty()) << source;
  }
}

// What else a script may call so, the interpreter has to find out.
TEST(NativeExpressions, AreOfNamesThatNoScriptTouches) {
  const auto is_native = [](const std::string& expression, const std::string& rest) {
    const auto loaded = load(
        R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><datamodel><data id="x"/>)" +
        rest + "</datamodel><state id=\"s\"><onentry><log expr=\"" + expression + "\"/></onentry></state></scxml>");
    for (const Expression& one : loaded.value->model().expressions) {
      if (one.text == expression) return !one.native.empty();
    }
    return false;
  };
  struct {
    const char* script;
    bool math;
    bool function;
  } constexpr kTouched[] = {{"Math.random() + f(1)", false, false},
                            {"x.f + x.Math", false, false},
                            {"Math", true, false},
                            {"f", false, true},
                            {"[Math]", true, false},
                            {"Math = {}", true, false},
                            {"Math['a']", true, false},
                            {"function Math() {}", true, false},
                            {"f = Math.f", false, true},
                            {"new f(1)", false, true},
                            {"function f() {}", false, true},
                            {"eval('1')", true, true},
                            {"'", true, true}};
  for (const auto& [script, math, function] : kTouched) {
    const std::string rest = "<data id=\"y\" expr=\"" + std::string(script) + "\"/>";
    EXPECT_NE(is_native("Math.max(x, 1)", rest), math) << script;
    EXPECT_NE(is_native("f(x)", rest), function) << script;
  }
  EXPECT_FALSE(is_native("f(x)", "<data id=\"f\"/>"));
  EXPECT_FALSE(is_native("parseInt(x)", ""));
}

TEST(Numbers, ArePrintedAsScriptsDo) {
  EXPECT_EQ(number_to_string(1e21), "1e+21");
  EXPECT_EQ(number_to_string(123456789012345680000.0), "123456789012345680000");
  EXPECT_EQ(number_to_string(1e-7), "1e-7");
  EXPECT_EQ(number_to_string(0.000001), "0.000001");
  EXPECT_EQ(number_to_string(-1.5), "-1.5");
  EXPECT_EQ(number_to_string(-0.0), "0");
}

}  // namespace
}  // namespace sentree::scxml
