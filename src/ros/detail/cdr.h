#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/idl/schema.h"
#include "sentree/rpc/transport.h"

namespace sentree::ros {

/// The octets before a message that say how it is encoded.
inline constexpr std::size_t kEncapsulation = 4;

/// Structs as CDR, the encoding of DDS (XCDR version 1, plain). What a type is on the wire says its name where it is of
/// ROS ("uint8", "float32[36]", "string<=10"), else its kind: a Thrift double is a float64, an enum an int32, a set a
/// sequence, a map a sequence of pairs, an optional field a sequence of at most one.
///
/// Values have the form of `idl::conform`; arrays of octets are bytes; what of a uint64 is beyond 2^63 is negative.
/// Immutable, thread-safe. Refers to the types that it was made of.
class Codec {
 public:
  /// Errors: ros.type, where a type has no form in CDR: unions, and structs that hold themselves.
  [[nodiscard]] static Result<Codec> make(const idl::Struct& structure);

  /// Appends the fields; `before` are the octets of the message that stand before them (a request's identity, or a
  /// goal's), `out.size() - kEncapsulation` in all. Error: ros.value, naming the field, where a number or a length is
  /// out of the type's bounds.
  [[nodiscard]] Result<void> write(std::vector<std::uint8_t>& out, const Value& value) const;

  /// Reads what `write` makes, of either byte order, from `from` on. Surplus octets behind it are left.
  /// Errors: ros.message, naming the field: too short, too many items, no text.
  /// Cost: O(octets); at most `limits.values` values.
  [[nodiscard]] Result<Value> read(std::span<const std::uint8_t> message, std::size_t from,
                                   const rpc::Limits& limits = {}) const;

  struct Node;  ///< Private to the library.

 private:
  explicit Codec(std::shared_ptr<const Node> root) : root_(std::move(root)) {}
  std::shared_ptr<const Node> root_;
};

/// The encapsulation of a message of ours: little-endian.
void begin_message(std::vector<std::uint8_t>& out);

}  // namespace sentree::ros
