#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "sentree/base/rng.h"
#include "sentree/base/value.h"
#include "sentree/idl/schema.h"

/// Types of ROS, written down or drawn, and values of them. For tests only.
namespace sentree::ros {

/// What definitions may use, by file.
inline std::map<std::string, std::string> messages() {
  return {{"builtin_interfaces/msg/Time.msg", "int32 sec\nuint32 nanosec\n"},
          {"std_msgs/msg/Header.msg", "builtin_interfaces/Time stamp\nstring frame_id\n"},
          {"geometry_msgs/msg/Point.msg", "float64 x\nfloat64 y\nfloat64 z\n"},
          {"geometry_msgs/msg/Quaternion.msg", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
          {"geometry_msgs/msg/Pose.msg", "Point position\nQuaternion orientation\n"},
          {"p/msg/None.msg", ""}};
}

/// Kept: codecs refer to the types.
inline const idl::Schema& loaded_schema(const std::string& source, const std::string& file = "p/msg/A.msg") {
  static std::deque<idl::Schema> kept;
  auto loaded =
      idl::Schema::load(source, file, [](std::string_view path, std::string_view) -> Result<idl::IncludedFile> {
        const auto all = messages();
        const auto found = all.find(std::string(path));
        if (found == all.end()) return fail("file.missing", "no such file");
        return idl::IncludedFile{found->first, found->second};
      });
  return kept.emplace_back(loaded.value.value());
}

inline const idl::Struct& fields_of(const idl::Schema& schema) {
  return schema.services().front().methods.front()->arguments;
}

/// Random types with random values of them.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : rng_(seed) {}
  std::int64_t below(std::int64_t n) { return static_cast<std::int64_t>(rng_.next() % static_cast<std::uint64_t>(n)); }

  std::string type() {
    static const char* const kBases[] = {
        "bool",    "byte",   "char",    "int8",      "uint8",           "int16",
        "uint16",  "int32",  "uint32",  "int64",     "uint64",          "float32",
        "float64", "string", "wstring", "string<=5", "std_msgs/Header", "geometry_msgs/Pose",
        "p/None"};
    static const char* const kMany[] = {"", "", "", "[]", "[3]", "[<=4]"};
    return std::string(kBases[below(std::size(kBases))]) + kMany[below(std::size(kMany))];
  }

  std::string message() {
    std::string out;
    const std::int64_t n = below(8);
    for (std::int64_t i = 0; i < n; ++i) out += type() + " f" + std::to_string(i) + "\n";
    return out;
  }

  Value value(const idl::Type& t) {
    const std::string& name = t.name;
    const auto open = name.rfind('[');
    const std::size_t items = open == std::string::npos ? 0
                              : name[open + 1] == ']'   ? static_cast<std::size_t>(below(6))
                              : name[open + 1] == '<'   ? static_cast<std::size_t>(below(5))
                                                        : 3;
    switch (t.kind) {
      case idl::Kind::kBool: return Value(below(2) == 1);
      case idl::Kind::kDouble: {
        const double x = static_cast<double>(below(2'000'000) - 1'000'000) / 64.0;
        return Value(below(20) == 0 ? std::numeric_limits<double>::infinity() : x);
      }
      case idl::Kind::kString: {
        static const char* const kTexts[] = {"", "a", "ab", "abc", "abcd", "ä€"};
        return Value(kTexts[below(std::size(kTexts))]);
      }
      case idl::Kind::kBinary: {
        Bytes out;
        for (std::size_t i = 0; i < items; ++i) out.octets.push_back(static_cast<std::byte>(below(256)));
        return Value(std::move(out));
      }
      case idl::Kind::kList: {
        List out;
        for (std::size_t i = 0; i < items; ++i) out.push_back(value(*t.element));
        return Value(std::move(out));
      }
      case idl::Kind::kStruct: return value(*t.structure);
      default:
        if (name == "int8") return Value(below(256) - 128);
        if (name == "int16") return Value(below(65536) - 32768);
        if (name == "uint16") return Value(below(65536));
        if (name == "int32") return Value(below(std::int64_t{1} << 32) - (std::int64_t{1} << 31));
        if (name == "uint32") return Value(below(std::int64_t{1} << 32));
        if (name.ends_with("int64")) return Value(static_cast<std::int64_t>(rng_.next()));
        return Value(below(256));
    }
  }
  Value value(const idl::Struct& s) {
    Map out;
    for (const idl::Field& f : s.fields) out[f.name] = value(*f.type);
    return Value(std::move(out));
  }

 private:
  Rng rng_;
};

}  // namespace sentree::ros
