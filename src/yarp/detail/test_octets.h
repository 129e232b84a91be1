#pragma once

#include <gtest/gtest.h>

#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/idl/schema.h"

/// What the tests of the library share.
namespace sentree::yarp::test {

/// "00010000 'word' ff|": hex digits, blanks and bars for the eye, text in single quotes.
inline std::string octets(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == ' ' || text[i] == '|' || text[i] == '\n') continue;
    if (text[i] == '\'') {
      const std::size_t end = text.find('\'', i + 1);
      out += text.substr(i + 1, end - i - 1);
      i = end;
      continue;
    }
    out += static_cast<char>(std::stoi(std::string(text.substr(i, 2)), nullptr, 16));
    ++i;
  }
  return out;
}

inline std::string shown(std::string_view bytes) {
  std::string out;
  for (const char c : bytes) {
    char digits[4];
    std::snprintf(digits, sizeof digits, "%02x", static_cast<unsigned char>(c));
    out += digits;
  }
  return out;
}
inline std::string shown(const std::vector<std::uint8_t>& bytes) {
  return shown(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

inline constexpr std::string_view kIdl = R"(
  enum Mode { A = 0, B = 1 }
  struct Inner { 1: i32 a, 2: string s }
  struct Outer { 1: Inner one, 2: list<Inner> many, 3: bool flag, 4: i64 big, 5: binary raw }
  struct Spare { 1: i32 a, 2: optional i32 b, 3: optional string c = "d", 4: i32 e = 7 }
  struct Self { 1: optional Self other }
  service Probe {
    bool rbool(1: bool x)  i8 ri8(1: i8 x)  i16 ri16(1: i16 x)  i32 ri32(1: i32 x)  i64 ri64(1: i64 x)
    double rdouble(1: double x)  string rstring(1: string x)  binary rbinary(1: binary x)
    Inner rstruct(1: i32 a)  Outer router(1: Outer x)  Mode renum(1: Mode x)
    list<double> rlistd(1: list<double> x)  list<Inner> rlists(1: list<Inner> x)  list<string> rliststr(1: list<string> x)
    list<bool> rlistbool(1: list<bool> x)  map<string, i32> rmap(1: map<string, i32> x)
    list<list<i32>> rlistlist(1: list<list<i32>> x)  map<i32, Inner> rmaps(1: map<i32, Inner> x)
    Spare rspare(1: Spare x)
    void two_args(1: i32 a, 2: string b)  i32 request_ack()
    set<i32> rset()  Self rself()  void rvoid()
    i32 go()  i32 go_on(1: i32 x)
    oneway void tell(1: string text)
  }
  service Data { oneway void level(1: double percent, 2: bool charging) }
)";

inline idl::Schema schema() {
  auto loaded = idl::Schema::load(kIdl, "probe.thrift");
  for (const Diagnostic& d : loaded.diagnostics) ADD_FAILURE() << to_string(d);
  return *loaded.value;
}

}  // namespace sentree::yarp::test
