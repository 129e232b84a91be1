// The Thrift compiler as the oracle: what it accepts we accept, what it refuses we refuse.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/idl/schema.h"

namespace sentree::idl {
namespace {

constexpr auto kCases = std::to_array<const char*>({
    "",
    "# c\n/* x */ /** doc */ // z",
    "/**/ /***/ /* **/ struct A {}",
    "\xEF\xBB\xBFstruct A {}",
    "namespace cpp a.b namespace * c namespace py d (x=\"1\")",
    "namespace cpp2.x y",
    "namespace cpp",
    "cpp_namespace x",
    "struct A {} namespace cpp a",
    "cpp_include \"<vector>\" struct A {}",
    "struct A { 1: i32 a, 2: string b; 3: bool c 4: byte d }",
    "struct A { 1: i32 a;; 2: i32 b }",
    "struct A { 1 : i32 a } ; struct B {}",
    "struct A {1: i32 a}, enum B {}",
    "struct A {i32 a, i32 b}",
    "struct A {0: i32 a; -3: i32 b}",
    "struct A {-1: i32 a, i32 b}",
    "struct A {40000: i32 a}",
    "struct A {1: i32 a, 1: i32 b}",
    "struct A {1: i32 a, 2: i32 a}",
    "struct A {1: optional required i32 a}",
    "struct A {1: optional i32 a = 5 (x=\"y\", z)}",
    "struct A {1: list<list<i32>(x=\"y\")> a}",
    "struct A {1: map<i32 i32> a}",
    "struct A {1: map<i32, map<string, set<double>>> a}",
    "struct A {1: list cpp_type \"x\" <i32> a}",
    "struct A {1: list<i32> cpp_type \"x\" a}",
    "struct A {1: void a}",
    "struct A {1: Foo a}",
    "struct A {1: uuid a}",
    "struct A {1: A a}",
    "struct A {1: B b} struct B {1: i32 x}",
    "struct A {1: i32 & a}",
    "struct A xsd_all {1: i32 x xsd_optional xsd_nillable xsd_attrs {1: i32 q}}",
    "struct A.B {}",
    "struct A {1: i32 list}",
    "struct A {1: i32 struct}",
    "struct A {} struct A {}",
    "enum A {} struct A {}",
    "service A {} struct A {}",
    "struct A {1: i32 a} (x)",
    "struct A {1: i32 a",
    "struct {}",
    "union U {1: i32 a, 2: string b}",
    "union U {1: required i32 a}",
    "union U {1: i32 a = 3, 2: i32 b}",
    "union U {1: i32 a = 3, 2: i32 b = 4}",
    "exception E {1: i32 a} struct S {1: E e}",
    "typedef i32 a, typedef i32 b;",
    "typedef Foo B struct Foo {}",
    "typedef Foo B",
    "typedef void a",
    "slist",
    "typedef slist x",
    "senum X {\"a\"}",
    "enum E {A, B = 5, C}",
    "enum E {A=1, A=2}",
    "enum E {A=1, B=1}",
    "enum E {A=5000000000}",
    "enum E {A=2147483647, B}",
    "enum E {A.b = 1}",
    "enum E {A.b}",
    "enum E {A = x}",
    "enum E {A (x = \"y\"); B}",
    "const i32 a = 1, const i32 b = 2;",
    "const i32 a = 3.0",
    "const i32 a = 99999999999",
    "const i8 a = 300",
    "const i32 a = b",
    "const i32 a = 1 const i32 b = a",
    "const i32 a = 1 const i32 a = 2",
    "const i32 a = 0x1F const i32 b = -0x1F",
    "const i64 a = 9223372036854775807 const i64 b = -9223372036854775808",
    "const i64 a = 9223372036854775808",
    "const i64 a = 0x8000000000000000",
    "const i32 a = -",
    "const double a = -",
    "const double d = +",
    "const double d = .5 const double e = 1e3 const double f = -.5e-2",
    "const double d = 1.",
    "const double d = 1.5.5",
    "const double d = 1e",
    "const bool b = true const bool c = 0",
    "const bool b = 1.0",
    "const i32 x = true",
    "const string s = \"a\\q\"",
    "const string s = 'a\"b'",
    "const string s = \"a\\n\\t\\\\\\\"\"",
    "const string a = \"x",
    "const string s = 7",
    "const binary b = \"x\"",
    "const i32 a = \"7\"",
    "const void v = 1",
    "const list<i32> l = [1, 2; 3 4]",
    "const list<i32> l = {}",
    "const list<i32> l = 5",
    "const list<i32> l = {1:2}",
    "const list<i32> l = [\"a\"]",
    "const set<i32> s = [1,1,2]",
    "const map<string,i32> m = {\"a\":1 \"b\":2, \"c\":3;}",
    "const map<i32,string> m = {1:\"a\", 1:\"b\"}",
    "const map<i32,i32> m = [1]",
    "const map<i32,i32> m = {1}",
    "const map<i32,i32> m = {\"a\": 1}",
    "struct A {1: i32 x} const A a = {\"x\": 1}",
    "struct A {1: i32 x} const A a = {\"y\": 1}",
    "struct A {1: i32 x} const A a = {x: 1}",
    "struct A {1: i32 x = 1} const A a = 3",
    "struct A {1: i32 x = 1} const A a = []",
    "const A a = {} struct A {}",
    "struct A {1: i32 x = 1} struct B {1: A a = {}}",
    "struct a {1: B x = {}} struct B {1: i32 q}",
    "union X {1: i32 x, 2: i32 y} const X a = {\"x\":2}",
    "exception X {1: i32 x = 1} const X a = {\"x\":2}",
    "enum E {A=1} const E e = 1",
    "enum E {A=1} const E e = 2",
    "enum E {A=1} const E e = E.A",
    "enum E {A=1} const E e = A",
    "enum E {A=1} const E e = E.B",
    "enum E {A=1} enum X {A} const E h = X.A",
    "enum E {A=1} const E e = E.A const E f = e",
    "const E e = E.A enum E {A}",
    "enum E {A} const i32 a = E.A",
    "enum E {A} const string a = E.A",
    "enum E {a=1} struct A {1: E x = 1.5}",
    "enum E {a=0} struct A {1: E x = \"a\"}",
    "enum E {a=1} struct A {1: E x = \"a\"}",
    "enum E {A} struct S {1: map<E,string> m = {E.A: \"x\", 0: \"y\"}}",
    "struct A {1: string a = 7}",
    "struct A {1: double a = 7}",
    "struct A {1: bool a = 7}",
    "struct A {1: i32 a = \"7\"}",
    "struct A {1: string a = \"x\" 2: string b}",
    "const string s = \"x\" struct A {1: string a = s}",
    "const string s = \"x\" struct A {1: i32 a = s}",
    "service S {}",
    "service S { void f(), i32 g(1: i32 a); list<string> h() }",
    "service S { void f() void f() }",
    "service S { f() }",
    "service S { void f( }",
    "service S {} service T extends S {void f()}",
    "service S {void f()} service T extends S {void f()}",
    "service B extends A {}",
    "service B extends B {}",
    "service T extends S {} service S {}",
    "service S { oneway void f(1: i32 a) }",
    "service S { async void f() }",
    "service S { oneway i32 f() }",
    "exception E {1: i32 a} service S { oneway void f() throws (1: E e) }",
    "exception E {1: i32 a} service S { void f() throws (1: E e) }",
    "exception E {1: i32 a} service S { void f() throws (E e) }",
    "service S { void f() throws (1: i32 e) }",
    "service S { void f() throws (1: E e) } exception E {}",
    "exception E {} typedef E F service S {void f() throws (1: F e)}",
    "exception E {} service S {void f() throws (1: E e, 1: E g)}",
    "service S {i32 f(1: optional i32 a = 5)}",
    "struct S {1: i32 x} service T {void f(1: S s = {\"x\":3})}",
    "service S {void f() (a=\"b\")} (c=\"d\")",
    "include \"no.thrift\"",
    "include no.thrift",
    "include \"part.thrift\" struct A {1: part.P p}",
    "include \"part.thrift\" struct A {1: part.Q p}",
    "include \"part.thrift\" struct A {1: P p}",
    "include \"part.thrift\" const i32 k = part.K",
    "include \"part.thrift\" const i32 k = K",
    "include \"part.thrift\" struct A {1: part.E e = part.E.X}",
    "include \"part.thrift\" service S extends part.T {}",
    "include \"part.thrift\" service S extends part.U {}",
    "@",
    "struct A { 1: i32 a } $",
    "{",
    "1",
    "\"x\"",
    "const",
    "struct A {1: i32 a = }",
    "foo bar",
});

class Compiler : public ::testing::Test {
 protected:
  static constexpr const char* kPart = "struct P {1: i32 a} enum E {X} const i32 K = 3 service T {void f()}";

  void SetUp() override { std::ofstream(file("part.thrift")) << kPart; }

  // Accepted if both a generator that needs every name and one that needs none take it.
  bool compiler_accepts(const std::string& source) {
    std::ofstream(file("case.thrift")) << source;
    for (const char* generator : {"cpp", "xml"}) {
      const std::string command = std::string("timeout 10 " SENTREE_THRIFT_COMPILER " --gen ") + generator + " -out " +
                                  folder_.path().string() + " " + file("case.thrift") + " >/dev/null 2>&1";
      if (std::system(command.c_str()) != 0) return false;
    }
    return true;
  }

  static Loaded<Schema> ours(const std::string& source) {
    return Schema::load(source, "case.thrift", [](std::string_view path, std::string_view) -> Result<IncludedFile> {
      if (path == "part.thrift") return IncludedFile{"part.thrift", kPart};
      return fail("file.not-found", "there is no such file");
    });
  }

  void expect_agreement(const std::string& source) {
    const auto loaded = ours(source);
    std::string said;
    for (const Diagnostic& d : loaded.diagnostics) {
      said += to_string(d) + "\n";
      EXPECT_GT(d.span.line, 0) << source;
      EXPECT_GT(d.span.column, 0) << source;
    }
    EXPECT_EQ(loaded.ok(), compiler_accepts(source)) << source << "\nwe say: " << said;
  }

  [[nodiscard]] std::string file(const char* name) const { return (folder_.path() / name).string(); }

  const TemporaryFolder folder_{"test"};
};

TEST_F(Compiler, AgreesOnWhatIsAcceptedAndWhatIsRefused) {
  for (const char* source : kCases) expect_agreement(source);
}

TEST_F(Compiler, AgreesOnReservedWords) {
  for (const char* word :
       {"BEGIN", "abstract",   "args",   "class", "def",      "elsif",     "end",          "from",      "float",
        "in",    "instanceof", "lambda", "nil",   "self",     "switch",    "synchronized", "this",      "virtual",
        "with",  "yield",      "True",   "int",   "template", "namespace", "auto",         "operator",  "function",
        "var",   "let",        "type",   "func",  "range",    "object",    "string",       "reference", "uuid"}) {
    expect_agreement(std::string("struct A {1: i32 ") + word + "}");
    expect_agreement(std::string("service S {void ") + word + "()}");
  }
}

// Half of a good file with one token changed: mostly refused, sometimes not, and never a different answer.
TEST_F(Compiler, AgreesOnMutatedFiles) {
  const std::string good =
      "enum E { A , B = 5 } typedef list < i32 > L const i32 K = 3 struct S { 1 : required string s = \"x\" , 2 : "
      "optional E e = E.A ; "
      "3 : map < string , L > m = { \"a\" : [ 1 , K ] } } exception X { 1 : S s } service T { S f ( 1 : i64 a = 5 ) "
      "throws ( 1 : X x ) , "
      "oneway void g ( ) } service U extends T { void h ( 1 : list < S > all ) }";
  std::vector<std::string> tokens;
  for (std::size_t at = 0; at < good.size();) {
    const std::size_t end = std::min(good.find(' ', at), good.size());
    tokens.push_back(good.substr(at, end - at));
    at = end + 1;
  }
  const std::uint64_t seed = 9;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed);
  for (int round = 0; round < 150; ++round) {
    auto changed = tokens;
    const std::size_t at = rng.below(changed.size());
    switch (rng.below(3)) {
      case 0: changed.erase(changed.begin() + static_cast<std::ptrdiff_t>(at)); break;
      case 1: changed[at] = tokens[rng.below(tokens.size())]; break;
      default:
        changed.insert(changed.begin() + static_cast<std::ptrdiff_t>(at), tokens[rng.below(tokens.size())]);
        break;
    }
    std::string source;
    for (const std::string& t : changed) source += t + " ";
    expect_agreement(source);
  }
}

}  // namespace
}  // namespace sentree::idl
