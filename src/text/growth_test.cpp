// Reading takes time in proportion to the size, whatever is large.

#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <functional>
#include <limits>
#include <ostream>
#include <string>

#include "sentree/text/detail/xml_scan.h"
#include "sentree/text/json.h"
#include "sentree/text/xml.h"
#include "sentree/text/yaml.h"

namespace sentree::text {
namespace {

std::string repeated(std::size_t count, const std::function<std::string(std::string)>& piece) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all += piece(std::to_string(i));
  return all;
}

struct Case {
  const char* name;
  std::size_t size;  // such that a run takes some milliseconds
  std::function<std::string(std::size_t)> document;
  std::function<bool(const std::string&)> read;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

bool xml(const std::string& source) { return XmlDocument::parse(source).has_value(); }
bool lenient_xml(const std::string& source) { return XmlDocument::parse(source, {}, {.lenient = true}).has_value(); }
bool yaml(const std::string& source) { return parse_yaml(source).has_value(); }
bool yaml_value(const std::string& source) {
  const auto node = parse_yaml(source);
  return node && !node->value().is_null();
}
bool json(const std::string& source) { return parse_json(source).has_value(); }

std::string attributes(std::size_t count) {
  return repeated(count, [](const std::string& i) { return " a" + i + "=''"; });
}

const Case kCases[] = {
    {"elements", 8000,
     [](std::size_t n) {
       return "<a>" + repeated(n, [](const std::string& i) { return "<b c='" + i + "'/>"; }) + "</a>";
     },
     xml},
    {"elements with many attributes", 1,
     [](std::size_t n) {
       const std::string all = attributes(kXmlAttributesMax);
       return "<a>" + repeated(n, [&](const std::string&) { return "<b" + all + "/>"; }) + "</a>";
     },
     xml},
    {"prefixes", 1,
     [](std::size_t n) {
       std::string open;
       std::string close;
       for (std::size_t k = 0; k < n; ++k) {
         const std::string level = std::to_string(k);
         open += "<a" +
                 repeated(500, [&](const std::string& i) { return " xmlns:p" + level + "x" + i + "='u" + i + "'"; }) +
                 repeated(500, [&](const std::string& i) { return " p0x" + i + ":a='" + level + "'"; }) + ">";
         close += "</a>";
       }
       return open + close;
     },
     xml},
    {"references", 12'000, [](std::size_t n) { return "<a b='" + std::string(n, '&') + "'/>"; },
     [](const std::string& source) {
       return !xml(source) && !lenient_xml(source);  // more warnings than are kept
     }},
    {"text", 4'000,
     [](std::size_t n) { return "<a>" + repeated(n, [](const std::string&) { return "]] &lt; "; }) + "</a>"; }, xml},
    {"keys of JSON", 700,
     [](std::size_t n) {
       return "{\"\":0" + repeated(n, [](const std::string& i) { return ",\"k" + i + "\":0"; }) + "}";
     },
     json},
    {"items of JSON", 4'000,
     [](std::size_t n) { return "[0" + repeated(n, [](const std::string&) { return ",{}"; }) + "]"; }, json},
    {"keys of YAML", 500,
     [](std::size_t n) { return repeated(n, [](const std::string& i) { return "k" + i + ": 1\n"; }); }, yaml_value},
    {"items of YAML", 500,
     [](std::size_t n) { return repeated(n, [](const std::string& i) { return "- " + i + "\n"; }); }, yaml},
    {"anchors of YAML", 150,
     [](std::size_t n) {
       return repeated(n,
                       [](const std::string& i) { return "k" + i + ": &a" + i + " [x]\nl" + i + ": *a" + i + "\n"; });
     },
     yaml},
};

// Of this thread's processor, so that others do not count.
double seconds_of(const Case& c, const std::string& document) {
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double begin = now();
    EXPECT_TRUE(c.read(document));
    best = std::min(best, now() - begin);
  }
  return best;
}

class Growth : public testing::TestWithParam<Case> {};

TEST_P(Growth, IsLinear) {
  // Linear readers take 16 times as long, quadratic ones 256 times.
  constexpr std::size_t kFactor = 16;
  const Case& c = GetParam();
  const double small = seconds_of(c, c.document(c.size));
  const double large = seconds_of(c, c.document(kFactor * c.size));
  EXPECT_LT(large, 4 * kFactor * small) << small << " s and " << large << " s";
}

INSTANTIATE_TEST_SUITE_P(Text, Growth, testing::ValuesIn(kCases));

}  // namespace
}  // namespace sentree::text
