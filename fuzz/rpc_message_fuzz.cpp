// Any bytes from a peer, to a server and to a client, in any encoding and framing: a message, or an error.

#include <algorithm>
#include <cstdint>
#include <string>

#include "sentree/base/assert.h"
#include "sentree/idl/conform.h"
#include "sentree/rpc/detail/connection.h"
#include "sentree/rpc/detail/wire.h"

using namespace sentree;
using namespace sentree::rpc;

namespace {

constexpr std::string_view kIdl = R"(
  enum E { A = 1, B }
  struct S { 1: optional S s, 2: E e = E.A, 3: set<double> d, 4: map<string, i32> m, 5: map<i16, list<bool>> n, 6: binary b, 7: required i64 r }
  union U { 1: i32 a, 2: S s, 3: list<U> us }
  exception X { 1: U u }
  service T { S f(1: U u, 2: S s, 3: i8 t, 4: string text) throws (1: X x) }
)";

// What is there, a few bytes at a time, and then the end.
class Bytes final : public Stream {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  Received receive(std::uint8_t* out, std::size_t size, Deadline) override {
    const std::size_t n = std::min({size, left_, std::size_t{7}});
    if (n == 0) return {StreamStatus::kClosed, 0};
    std::copy(data_, data_ + n, out);
    data_ += n;
    left_ -= n;
    return {StreamStatus::kOk, n};
  }
  StreamStatus send(const std::uint8_t*, std::size_t, Deadline) override { return StreamStatus::kOk; }
  void shut_down() override {}
  int descriptor() const override { return -1; }
  std::string why() const override { return "the end"; }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

void expect_form(const idl::Type& type, const Value& value) {
  // A union may come empty; everything else a reader makes has the form of the IDL.
  const auto made = idl::conform(type, value, "value");
  SENTREE_ASSERT(made || made.error().code == "idl.union" || made.error().code == "idl.missing");
}

void read_all(const std::uint8_t* data, std::size_t size, const idl::Method& method, bool as_server) {
  const Limits limits{.message_bytes = 1 << 16, .nesting = 20, .container_items = 2000, .values = 20000};
  Bytes bytes(data, size);
  Inbox in(&bytes, limits);
  Outbox out;
  try {
    std::unique_ptr<Wire> wire;
    while (in.wait(kNoDeadline) == StreamStatus::kOk) {
      in.begin_message(kNoDeadline);
      if (wire == nullptr) {
        const Encoding e = detect_encoding(in);
        wire = Wire::make(e.protocol, e.framed, in, out, limits);
      }
      const MessageHead head = wire->read_head();
      if (head.name == "skip") {
        wire->skip_body();
      } else if (as_server) {
        if (auto made = idl::conform_arguments(method, wire->read_arguments(method)))
          wire->write_call("f", MessageType::kCall, 1, method.arguments, *made);
      } else {
        const ReplyBody body = wire->read_reply(head.type, method);
        if (body.form == ReplyBody::Form::kResult) expect_form(*method.result, body.value);
        if (body.form == ReplyBody::Form::kException) expect_form(*body.exception->type, body.value);
      }
      wire->end_message();
    }
  } catch (const WireError&) {
    return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const idl::ServicePtr kService = idl::Schema::load(kIdl, "fuzz.thrift").value->service("T");
  read_all(data, size, *kService->find("f"), true);
  read_all(data, size, *kService->find("f"), false);
  return 0;
}
