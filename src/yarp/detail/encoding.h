#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/rpc/call.h"
#include "sentree/rpc/transport.h"
#include "sentree/yarp/address.h"

namespace sentree::yarp {

class Inbox;

/// Why the values of a method cannot be carried, as a sentence; nothing: they can. Sets, unions and structs that hold
/// themselves have no form that programs of YARP read.
[[nodiscard]] std::optional<std::string> cannot_carry(const idl::Method& method);

/// Calls and data as programs made by yarpidl_thrift write them: lists of tagged items, in which order decides. Absent
/// optional fields are sent as their default, or zero.
class Encoding {
 public:
  Encoding(Version version, const rpc::Limits& limits) : version_(version), limits_(limits) {}

  /// The name and the arguments, which conform, as one list; without the name they are data.
  void write_call(std::vector<std::uint8_t>& out, const idl::Method& method, const Value& arguments,
                  bool with_name = true) const;
  /// A result that conforms.
  void write_reply(std::vector<std::uint8_t>& out, const idl::Method& method, const Value& result) const;

  struct Call {
    const idl::Method* method = nullptr;  ///< Null: `asked` says why there is none.
    Value arguments;
    std::string asked;             ///< The words that were no call, joined by blanks.
    bool wrong_arguments = false;  ///< There is such a method, but it is called otherwise.
  };
  /// A request of `bytes` in all. Words are joined as the sender split them; the shortest name whose arguments fit
  /// wins.
  /// @param only  Data without a name are arguments of this method; null: the name comes first.
  [[nodiscard]] Call read_call(Inbox& in, std::size_t bytes, const idl::Service& service,
                               const idl::Method* only = nullptr) const;

  /// The reply to a call; throws the library's `Broken` where reading cannot go on behind it.
  [[nodiscard]] rpc::Outcome read_reply(Inbox& in, const idl::Method& method) const;

 private:
  const Version version_;
  const rpc::Limits limits_;
};

/// "[fail]", alone.
void write_fail(std::vector<std::uint8_t>& out);
/// "[many]" and lines.
void write_many(std::vector<std::uint8_t>& out, const std::vector<std::string>& lines);

}  // namespace sentree::yarp
