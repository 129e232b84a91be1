// What a peer may send as a message: any octets, read as types with every kind of field. What is read is written, and
// that is read the same.

#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "sentree/ros/detail/cdr.h"

namespace {

using namespace sentree;

struct Types {
  idl::Schema ros =
      *idl::Schema::load(
           "bool a\nint8 b\nuint16 c\nint64 d\nuint64 e\nfloat32 f\nfloat64 g\nstring h\nstring<=3 i\nwstring j\n"
           "uint8[] k\nfloat64[2] l\nstring[<=3] m\nbool[] n\nint16[3] o\n",
           "p/msg/A.msg")
           .value;
  idl::Schema thrift = *idl::Schema::load(
                            "enum E { A = 1 } struct S { 1: optional list<S2> a, 2: map<string, i32> b, 3: E c } "
                            "struct S2 { 1: string x }\n"
                            "service T { void f(1: S s, 2: binary b, 3: set<i64> c) }",
                            "t.thrift")
                            .value;
  std::vector<ros::Codec> codecs;

  Types() {
    for (const idl::Schema* schema : {&ros, &thrift})
      codecs.push_back(*ros::Codec::make(schema->services().front().methods.front()->arguments));
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Types kTypes;
  rpc::Limits limits;
  limits.message_bytes = 1U << 16U;
  limits.values = 10'000;
  for (const ros::Codec& codec : kTypes.codecs) {
    const auto value = codec.read({data, size}, ros::kEncapsulation, limits);
    if (!value) continue;
    std::vector<std::uint8_t> octets;
    ros::begin_message(octets);
    // What was read may be no text, or out of bounds: then it cannot be written.
    if (!codec.write(octets, *value)) continue;
    const auto again = codec.read(octets, ros::kEncapsulation, limits);
    std::vector<std::uint8_t> twice;
    ros::begin_message(twice);
    // By octets, since a NaN is not itself.
    if (!again || !codec.write(twice, *again) || twice != octets) std::abort();
  }
  return 0;
}
