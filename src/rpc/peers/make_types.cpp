// Writes a Thrift file with random types, and the C++ that makes code generated from it echo: make_types SEED FOLDER.
// The same seed writes the same files.

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "sentree/base/rng.h"

namespace {

constexpr int kStructs = 24;

class Maker {
 public:
  explicit Maker(std::uint64_t seed) : rng_(seed) {}

  std::string idl() {
    std::string out =
        "namespace cpp peers\n\nenum Colour { RED = 0, GREEN = 7, BLUE = -3 }\ntypedef i64 Stamp\ntypedef list<string> "
        "Names\n\n";
    for (int i = 0; i < kStructs; ++i) out += structure(i);
    out +=
        "exception Failure { 1: string why, 2: S0 detail }\n\nservice Base { void ping() }\n\nservice Echo extends "
        "Base {\n";
    for (int i = 0; i < kStructs; ++i)
      out += "  S" + number(i) + " echo" + number(i) + "(1: S" + number(i) + " value)\n";
    out +=
        "  string fail(1: S0 detail) throws (1: Failure failure)\n  oneway void tell(1: string text)\n  i64 add(1: i64 "
        "a, 2: i32 b = 5)\n}\n";
    return out;
  }

  // A handler that passes every call on to another Echo.
  static std::string relay() {
    std::string out =
        "#include \"Echo.h\"\n\nclass Relay : public peers::EchoIf {\n public:\n  explicit Relay(peers::EchoIf& next) "
        ": next_(next) {}\n"
        "  void ping() override { next_.ping(); }\n"
        "  void fail(std::string& out, const peers::S0& detail) override { next_.fail(out, detail); }\n"
        "  void tell(const std::string& text) override { next_.tell(text); }\n"
        "  std::int64_t add(std::int64_t a, std::int32_t b) override { return next_.add(a, b); }\n";
    for (int i = 0; i < kStructs; ++i) {
      const std::string n = number(i);
      out += "  void echo" + n + "(peers::S" + n + "& out, const peers::S" + n + "& value) override { next_.echo" + n +
             "(out, value); }\n";
    }
    return out + "\n private:\n  peers::EchoIf& next_;\n};\n";
  }

 private:
  static std::string number(int i) { return std::to_string(i); }

  std::string key() {
    static const std::vector<std::string> kTypes = {"bool",   "i8",     "i16",    "i32",  "i64",
                                                    "string", "binary", "Colour", "Stamp"};
    return kTypes[rng_.below(kTypes.size())];
  }

  std::string type(int structs, int depth) {
    const auto pick = rng_.below(depth > 2 ? 6 : 10);
    if (pick < 5) return key();
    if (pick == 5) return rng_.below(3) == 0 ? "Names" : "double";
    if (pick == 6) return "list<" + type(structs, depth + 1) + ">";
    if (pick == 7) return "set<" + key() + ">";
    if (pick == 8) return "map<" + key() + ", " + type(structs, depth + 1) + ">";
    return structs == 0 ? "double" : "S" + std::to_string(rng_.below(static_cast<std::uint64_t>(structs)));
  }

  std::string structure(int i) {
    const bool is_union = i % 6 == 5;
    std::string out = (is_union ? "union S" : "struct S") + number(i) + " {\n";
    int id = 0;
    const auto fields = 1 + rng_.below(8);
    for (std::uint64_t f = 0; f < fields; ++f) {
      // Compact writes large steps between numbers in another way than small ones.
      id += 1 + static_cast<int>(rng_.below(4) == 0 ? rng_.below(300) : 0);
      const auto requiredness = rng_.below(3);
      const bool defaulted = !is_union && rng_.below(5) == 0;
      out += "  " + number(id) + ": ";
      if (!is_union) out += requiredness == 0 ? "required " : requiredness == 1 ? "optional " : "";
      out += defaulted ? "i32 f" + std::to_string(f) + " = " + std::to_string(rng_.below(1000))
                       : type(i, 0) + " f" + std::to_string(f);
      out += ",\n";
    }
    if (!is_union && i % 4 == 2) out += "  " + number(id + 1) + ": list<S" + number(i) + "> children\n";
    return out + "}\n\n";
  }

  sentree::Rng rng_;
};

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) {
    std::cerr << "make_types SEED FOLDER\n";
    return 2;
  }
  Maker maker(std::strtoull(arguments[1], nullptr, 10));
  const std::string folder = arguments[2];
  std::ofstream(folder + "/peers.thrift") << maker.idl();
  std::ofstream(folder + "/relay.h") << Maker::relay();
}
