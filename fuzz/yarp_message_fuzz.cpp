// What a peer may send to a port: a message with its head, the request in it, and a reply.

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "sentree/yarp/detail/bottle.h"
#include "sentree/yarp/detail/encoding.h"
#include "sentree/yarp/detail/frame.h"
#include "sentree/yarp/detail/inbox.h"

namespace {

using namespace sentree;

const idl::Service& service() {
  static const idl::ServicePtr kService =
      idl::Schema::load(
          "enum E { A = 0 } struct S { 1: i32 a, 2: string s, 3: list<double> d }\n"
          "service F { S one(1: S x, 2: bool b, 3: E e)  map<string, list<S>> two_words(1: binary x, 2: i8 y)\n"
          "  list<list<i32>> three(1: map<i64, S> x)  oneway void four(1: double x) }",
          "fuzz.thrift")
          .value->service("F");
  return *kService;
}

template <class F>
void guarded(F&& work) {
  try {
    work();
  } catch (const yarp::Broken&) {
    // As a connection ends.
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  rpc::Limits limits;
  limits.message_bytes = 1U << 16U;
  for (const yarp::Version version : {yarp::Version::kYarp3, yarp::Version::kYarp4}) {
    const yarp::Encoding encoding(version, limits);
    guarded([&] {
      yarp::Inbox in(bytes);
      while (in.buffered() > 0) {
        const yarp::Frame frame = take_frame(in, limits.message_bytes);
        (void)encoding.read_call(in, frame.payload, service());
      }
    });
    guarded([&] {
      yarp::Inbox in(bytes);
      (void)encoding.read_call(in, size, service());
    });
    for (const idl::Method* method : service().methods) {
      guarded([&] {
        yarp::Inbox in(bytes);
        (void)encoding.read_reply(in, *method);
      });
    }
    guarded([&] {
      yarp::Inbox in(bytes);
      (void)yarp::to_text(yarp::read_bottle(in, version));
    });
  }
  if (const auto items = yarp::parse_text(bytes)) (void)yarp::to_text(*items);
  return 0;
}
