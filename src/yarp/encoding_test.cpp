#include "sentree/yarp/detail/encoding.h"

#include <gmock/gmock.h>

#include "sentree/base/rng.h"
#include "sentree/idl/conform.h"
#include "sentree/text/json.h"
#include "sentree/yarp/detail/inbox.h"
#include "sentree/yarp/detail/test_octets.h"

namespace sentree::yarp {
namespace {

using test::octets;
using test::shown;
using ::testing::HasSubstr;

const idl::Service& probe() {
  static const idl::ServicePtr service = test::schema().service("Probe");
  return *service;
}
const idl::Method& method(std::string_view name) {
  const idl::Method* found = probe().find(name);
  EXPECT_NE(found, nullptr) << name;
  return *found;
}
Encoding encoding(Version version = Version::kYarp3) { return Encoding(version, rpc::Limits()); }

Value json(std::string_view text) {
  auto value = text::parse_json(text);
  EXPECT_TRUE(value) << text;
  return value ? *value : Value();
}

std::string written_call(std::string_view name, std::string_view arguments, Version version = Version::kYarp3) {
  auto conformed = idl::conform_arguments(method(name), json(arguments));
  EXPECT_TRUE(conformed) << (conformed ? "" : conformed.error().message);
  std::vector<std::uint8_t> out;
  encoding(version).write_call(out, method(name), *conformed);
  return shown(out);
}

std::string written_reply(std::string_view name, std::string_view result, Version version = Version::kYarp3) {
  auto conformed = idl::conform(*method(name).result, json(result), "result");
  EXPECT_TRUE(conformed) << (conformed ? "" : conformed.error().message);
  std::vector<std::uint8_t> out;
  encoding(version).write_reply(out, method(name), *conformed);
  return shown(out);
}

std::string read_reply(std::string_view name, const std::string& bytes, Version version = Version::kYarp3) {
  Inbox in{std::string_view(bytes)};
  try {
    const rpc::Outcome out = encoding(version).read_reply(in, method(name));
    if (!out) return "error: " + out.error().message;
    EXPECT_EQ(in.buffered(), 0U);
    return to_json(*out);
  } catch (const Broken& e) {
    return "broken: " + e.why;
  }
}

std::string read_call(const std::string& bytes, const idl::Service& service = probe()) {
  Inbox in{std::string_view(bytes)};
  const Encoding::Call call = encoding().read_call(in, bytes.size(), service);
  EXPECT_EQ(in.buffered(), 0U) << "what follows can be read";
  if (call.method == nullptr) return std::string(call.wrong_arguments ? "wrong: " : "none: ") + call.asked;
  return call.method->name + to_json(call.arguments);
}

struct Captured {
  std::string_view method;
  std::string_view arguments;
  std::string_view request;  // octets
  std::string_view result;
  std::string_view reply;
};

// Of a real server and a real client of YARP 3.9.1.
const std::vector<Captured>& captured() {
  static const std::vector<Captured> kAll = {
      {"rbool", R"({"x":true})", "00010000 02000000 04000000 05000000 'rbool' 09000000 6f6b0000", "true",
       "00010000 01000000 09000000 6f6b0000"},
      {"rbool", R"({"x":false})", "00010000 02000000 04000000 05000000 'rbool' 09000000 6661696c", "false",
       "00010000 01000000 09000000 6661696c"},
      {"ri8", R"({"x":-3})", "00010000 02000000 09000000 'ri8' 00 20000000 fd", "-3", "00010000 01000000 20000000 fd"},
      {"ri16", R"({"x":300})", "00010000 02000000 09000000 'ri16' 40000000 2c01", "300",
       "00010000 01000000 40000000 2c01"},
      {"ri32", R"({"x":-70000})", "00010000 02000000 09000000 'ri32' 01000000 90eefeff", "-70000",
       "00010000 01000000 01000000 90eefeff"},
      {"ri64", R"({"x":1099511627776})", "00010000 02000000 09000000 'ri64' 11000000 00000000 00010000",
       "1099511627776", "00010000 01000000 11000000 00000000 00010000"},
      {"rdouble", R"({"x":2.5})", "00010000 02000000 04000000 07000000 'rdouble' 0a000000 00000000 00000440", "2.5",
       "00010000 01000000 0a000000 00000000 00000440"},
      {"rstring", R"({"x":""})", "00010000 02000000 04000000 07000000 'rstring' 04000000 00000000", R"("")",
       "00010000 01000000 04000000 00000000"},
      {"rstruct", R"({"a":7})", "00010000 02000000 04000000 07000000 'rstruct' 01000000 07000000",
       R"({"a":7,"s":"in"})", "00010000 02000000 01000000 07000000 04000000 02000000 'in'"},
      {"rlistd", R"({"x":[1,2]})",
       "00010000 02000000 04000000 06000000 'rlistd' 0a010000 02000000 000000000000f03f 0000000000000040", "[1.0,2.0]",
       "00010000 01000000 0a010000 02000000 000000000000f03f 0000000000000040"},
      {"rlistd", R"({"x":[]})", "00010000 02000000 04000000 06000000 'rlistd' 0a010000 00000000", "[]",
       "00010000 01000000 0a010000 00000000"},
      {"rlists", R"({"x":[{"a":0,"s":"q"},{"a":0,"s":"q"}]})",
       "00010000 02000000 04000000 06000000 'rlists' 00010000 02000000"
       " 00010000 02000000 01000000 00000000 04000000 01000000 'q' 00010000 02000000 01000000 00000000 04000000"
       " 01000000 'q'",
       R"([{"a":0,"s":"q"},{"a":0,"s":"q"}])",
       "00010000 01000000 00010000 02000000"
       " 00010000 02000000 01000000 00000000 04000000 01000000 'q' 00010000 02000000 01000000 00000000 04000000"
       " 01000000 'q'"},
      {"rliststr", R"({"x":["a","bc"]})",
       "00010000 02000000 04000000 08000000 'rliststr' 04010000 02000000 01000000 'a' 02000000 'bc'", R"(["a","bc"])",
       "00010000 01000000 04010000 02000000 01000000 'a' 02000000 'bc'"},
      {"rlistbool", R"({"x":[true,false]})",
       "00010000 02000000 04000000 09000000 'rlistbool' 09010000 02000000 6f6b0000 6661696c", "[true,false]",
       "00010000 01000000 09010000 02000000 6f6b0000 6661696c"},
      {"rmap", R"({"x":{"k":9}})",
       "00010000 02000000 09000000 'rmap' 00010000 01000000 00010000 02000000 04000000 01000000 'k' 01000000 09000000",
       R"({"k":9})", "00010000 01000000 00010000 01000000 00010000 02000000 04000000 01000000 'k' 01000000 09000000"},
      {"rlistlist", R"({"x":[[1,2],[3]]})",
       "00010000 02000000 04000000 09000000 'rlistlist' 01010000 02000000 01010000 02000000 01000000 02000000 01010000"
       " 01000000 03000000",
       "[[1,2],[3]]",
       "00010000 01000000 01010000 02000000 01010000 02000000 01000000 02000000 01010000 01000000 03000000"},
      {"router", R"({"x":{"one":{"a":1,"s":"x"},"many":[{"a":1,"s":"x"}],"flag":true,"big":5,"raw":"raw"}})",
       "00010000 07000000 04000000 06000000 'router' 01000000 01000000 04000000 01000000 'x' 00010000 01000000 00010000"
       " 02000000 01000000 01000000 04000000 01000000 'x' 09000000 6f6b0000 11000000 05000000 00000000 0c000000"
       " 03000000 'raw'",
       R"({"one":{"a":1,"s":"x"},"many":[{"a":1,"s":"x"}],"flag":true,"big":5,"raw":"raw"})",
       "00010000 06000000 01000000 01000000 04000000 01000000 'x' 00010000 01000000 00010000"
       " 02000000 01000000 01000000 04000000 01000000 'x' 09000000 6f6b0000 11000000 05000000 00000000 0c000000"
       " 03000000 'raw'"},
      {"request_ack", "{}", "00010000 02000000 04000000 07000000 'request' 09000000 'ack' 00", "3",
       "00010000 01000000 01000000 03000000"},
      {"two_args", R"({"a":1,"b":"x"})",
       "00010000 04000000 09000000 'two' 00 09000000 'args' 01000000 01000000 04000000 01000000 'x'", "null",
       "00010000 00000000"},
  };
  return kAll;
}

TEST(Encoding, WritesCallsAndRepliesAsGeneratedProgramsDo) {
  for (const Captured& c : captured()) {
    EXPECT_EQ(written_call(c.method, c.arguments), shown(octets(c.request))) << c.method;
    EXPECT_EQ(written_reply(c.method, c.result), shown(octets(c.reply))) << c.method;
  }
}

TEST(Encoding, ReadsWhatGeneratedProgramsWrite) {
  for (const Captured& c : captured()) {
    const auto arguments = idl::conform_arguments(method(c.method), json(c.arguments));
    EXPECT_EQ(read_call(octets(c.request)), std::string(c.method) + to_json(*arguments));
    const auto result = idl::conform(*method(c.method).result, json(c.result), "result");
    EXPECT_EQ(read_reply(c.method, octets(c.reply)), to_json(*result));
  }
}

TEST(Encoding, ReadsNamesHoweverTheyAreSplit) {
  EXPECT_EQ(read_call(octets("00010000 01000000 04000000 0b000000 'request_ack'")), "request_ack{}");
  EXPECT_EQ(read_call(octets("04010000 01000000 0b000000 'request_ack'")), "request_ack{}") << "a typed list";
  EXPECT_EQ(read_call(octets("04010000 02000000 07000000 'request' 03000000 'ack'")), "request_ack{}");
}

TEST(Encoding, TakesTheShortestNameWhoseArgumentsFit) {
  EXPECT_EQ(read_call(octets("00010000 01000000 09000000 'go' 0000")), "go{}");
  EXPECT_EQ(read_call(octets("00010000 03000000 09000000 'go' 0000 09000000 'on' 0000 01000000 05000000")),
            R"(go_on{"x":5})");
}

TEST(Encoding, ReadsNumbersThatPeopleType) {
  EXPECT_EQ(read_call(octets("00010000 02000000 04000000 07000000 'rdouble' 01000000 02000000")),
            R"(rdouble{"x":2.0})");
  EXPECT_EQ(read_call(octets("00010000 02000000 04000000 04000000 'ri64' 01000000 02000000")), R"(ri64{"x":2})");
  EXPECT_EQ(read_call(octets("00010000 02000000 04000000 05000000 'rbool' 09000000 '1' 000000")), R"(rbool{"x":true})");
  EXPECT_EQ(read_call(octets("00010000 02000000 04000000 05000000 'rbool' 09000000 00000000")), R"(rbool{"x":false})");
  EXPECT_EQ(read_call(octets("00010000 02000000 04000000 06000000 'rlistd' 00010000 02000000 01000000 01000000 0a000000"
                             " 0000000000000040")),
            R"(rlistd{"x":[1.0,2.0]})");
}

TEST(Encoding, TellsAWrongCallFromAnUnknownOne) {
  EXPECT_EQ(read_call(octets("00010000 01000000 09000000 'nope'")), "none: nope");
  EXPECT_EQ(read_call(octets("00010000 01000000 09000000 'ri32'")), "wrong: ri32");
  EXPECT_EQ(read_call(octets("00010000 03000000 09000000 'ri32' 01000000 01000000 01000000 01000000")), "wrong: ri32");
  EXPECT_EQ(read_call(octets("00010000 02000000 09000000 'ri32' 04000000 01000000 'x'")), "wrong: ri32");
  EXPECT_EQ(read_call(octets("00010000 02000000 09000000 'ri32' 11000000 01000000 01000000")), "wrong: ri32")
      << "a wider integer";
  EXPECT_EQ(read_call(octets("00010000 00000000")), "none: ");
  EXPECT_EQ(read_call("garbage that is no list at all"), "none: ");
  EXPECT_EQ(read_call(octets("00010000 ffffffff")), "none: ");
  EXPECT_EQ(read_call(octets("00010000 02000000 04000000 ffffff7f 'x'")), "none: ");
}

TEST(Encoding, LeavesOutWhateverAMethodWithoutAResultIsAnswered) {
  EXPECT_EQ(
      read_reply("rvoid", octets("00010000 02000000 01010000 01000000 07000000 00020000 00010000 01000000 00010000"
                                 " 00000000")),
      "null");
  EXPECT_THAT(read_reply("rvoid", octets("00010000 01000000 01010000 02000000 07000000")), HasSubstr("broken: "));
}

TEST(Encoding, SaysThatACallFailed) {
  for (const std::string_view reply : {"09010000 01000000 6661696c", "00010000 01000000 09000000 6661696c"}) {
    EXPECT_THAT(read_reply("ri32", octets(reply)), HasSubstr("error: it answered [fail]"));
    EXPECT_THAT(read_reply("rstruct", octets(reply)), HasSubstr("error: it answered [fail]"));
    EXPECT_THAT(read_reply("rvoid", octets(reply)), HasSubstr("error: it answered [fail]"));
    EXPECT_EQ(read_reply("rbool", octets(reply)), "false") << "which is an answer of that type";
  }
  EXPECT_THAT(read_reply("ri32", octets("00010000 00000000")), HasSubstr("broken: "));
  EXPECT_THAT(read_reply("rstruct", octets("00010000 01000000 01000000 07000000")), HasSubstr("broken: "));
  EXPECT_THAT(read_reply("ri32", octets("00010000 02000000 01000000 07000000 01000000 07000000")),
              HasSubstr("broken: "));
  EXPECT_THAT(read_reply("rlistd", octets("00010000 01000000 0a010000 ffffff7f")), HasSubstr("broken: "));
  EXPECT_THAT(read_reply("rstring", octets("00010000 01000000 04000000 ffffffff")), HasSubstr("broken: "));
}

TEST(Encoding, HasOtherTagsForRealNumbersInYarp4) {
  EXPECT_EQ(written_reply("rdouble", "2.5", Version::kYarp4),
            shown(octets("00010000 01000000 14000000 00000000 00000440")));
  EXPECT_EQ(read_reply("rdouble", octets("00010000 01000000 14000000 00000000 00000440"), Version::kYarp4), "2.5");
  EXPECT_EQ(read_reply("rdouble", octets("00010000 01000000 0a000000 00002040"), Version::kYarp4), "2.5") << "float32";
  EXPECT_EQ(read_reply("rdouble", octets("00010000 01000000 80000000 00002040")), "2.5") << "float32 of YARP 3";
}

TEST(Encoding, SendsTheDefaultsOfWhatIsAbsent) {
  EXPECT_EQ(written_call("rspare", R"({"x":{"a":1}})"),
            shown(octets("00010000 05000000 04000000 06000000 'rspare' 01000000 01000000 01000000 00000000 04000000"
                         " 01000000 'd' 01000000 07000000")));
}

TEST(Encoding, RefusesWhatHasNoForm) {
  EXPECT_THAT(cannot_carry(method("rset")).value_or(""), HasSubstr("use a list"));
  EXPECT_THAT(cannot_carry(method("rself")).value_or(""), HasSubstr("holds itself"));
  EXPECT_FALSE(cannot_carry(method("router")));
}

TEST(Encoding, LeavesTheNameOfDataOut) {
  const idl::ServicePtr data = test::schema().service("Data");
  const idl::Method& level = *data->find("level");
  std::vector<std::uint8_t> out;
  encoding().write_call(out, level, Map{{"percent", 40.0}, {"charging", true}}, false);
  EXPECT_EQ(shown(out), shown(octets("00010000 02000000 0a000000 0000000000004440 09000000 6f6b0000")));
  const std::string bytes(out.begin(), out.end());
  Inbox in{std::string_view(bytes)};
  const Encoding::Call call = encoding().read_call(in, bytes.size(), *data, &level);
  ASSERT_EQ(call.method, &level);
  EXPECT_EQ(to_json(call.arguments), R"({"percent":40.0,"charging":true})");
}

TEST(Encoding, SurvivesWhatIsCutShortOrChanged) {
  constexpr std::uint64_t kSeed = 7;
  Rng rng(kSeed);
  for (int round = 0; round < 20'000; ++round) {
    const Captured& c = captured()[rng.below(captured().size())];
    std::string bytes = octets(c.request);
    bytes.resize(rng.below(bytes.size() + 1));
    for (int i = 0; i < 3 && !bytes.empty(); ++i) bytes[rng.below(bytes.size())] = static_cast<char>(rng.below(256));
    Inbox in{std::string_view(bytes)};
    (void)encoding().read_call(in, bytes.size(), probe());
    EXPECT_EQ(in.buffered(), 0U) << "seed " << kSeed << ", round " << round;
    std::string reply = octets(c.reply);
    reply[rng.below(reply.size())] = static_cast<char>(rng.below(256));
    Inbox answer{std::string_view(reply)};
    try {
      (void)encoding().read_reply(answer, method(c.method));
    } catch (const Broken& e) {
      EXPECT_FALSE(e.why.empty());
    }
  }
}

}  // namespace
}  // namespace sentree::yarp
