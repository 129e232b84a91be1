#pragma once

#include <thrift/protocol/TBinaryProtocol.h>
#include <thrift/protocol/TCompactProtocol.h>
#include <thrift/transport/TBufferTransports.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/idl/schema.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/stream.h"

/// Thrift messages on a stream. Private to the library; the only header that includes Thrift's.
namespace sentree::rpc {

/// Thrown inside the library where Thrift's protocol classes leave no other way out; caught by `Wire`.
struct WireError {
  StreamStatus status = StreamStatus::kFailed;
  std::string why;
};

/// What has been received and not read yet. Keeps a message until it is finished, so that one whose end is missing at
/// the deadline can be read from its beginning later.
class Inbox final : public apache::thrift::transport::TBufferBase {
 public:
  Inbox(Stream* stream, const Limits& limits);

  /// Waits for at least one byte of the next message.
  [[nodiscard]] StreamStatus wait(Deadline deadline);
  void begin_message(Deadline deadline);
  /// Forgets the message; what follows it stays.
  void end_message();
  /// Back to the first byte of the message.
  void rewind();
  /// At least that many bytes from the message's first on; throws WireError.
  [[nodiscard]] const std::uint8_t* peek(std::size_t bytes);
  /// Reads a frame's length, then fetches all of it.
  void open_frame();
  [[nodiscard]] bool frame_used_up() const;

 private:
  std::uint32_t readSlow(std::uint8_t* out, std::uint32_t size) override;
  void writeSlow(const std::uint8_t* data, std::uint32_t size) override;
  const std::uint8_t* borrowSlow(std::uint8_t* out, std::uint32_t* size) override;
  void fetch();
  void make_room();
  // Not kOk is no exception here: it is what a look at an idle connection finds.
  [[nodiscard]] StreamStatus receive();
  void set_bounds(std::size_t position);
  [[nodiscard]] std::size_t position() const { return static_cast<std::size_t>(rBase_ - buffer_.data()); }

  Stream* stream_;
  std::size_t message_bytes_max_;
  Deadline deadline_ = kNoDeadline;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;      // of the message
  std::size_t end_ = 0;        // of what has been received
  std::size_t frame_end_ = 0;  // 0: no frame
};

/// The message being written.
class Outbox final : public apache::thrift::transport::TBufferBase {
 public:
  Outbox();
  void begin_message(bool framed);
  /// The whole message, its frame's length filled in.
  [[nodiscard]] std::pair<const std::uint8_t*, std::size_t> finish();

 private:
  std::uint32_t readSlow(std::uint8_t* out, std::uint32_t size) override;
  void writeSlow(const std::uint8_t* data, std::uint32_t size) override;
  const std::uint8_t* borrowSlow(std::uint8_t* out, std::uint32_t* size) override;

  std::vector<std::uint8_t> buffer_;
  bool framed_ = false;
};

enum class MessageType : std::uint8_t { kCall = 1, kReply = 2, kException = 3, kOneway = 4 };

struct MessageHead {
  std::string name;
  MessageType type = MessageType::kCall;
  std::int32_t sequence = 0;
};

/// What a reply can be: see `idl::Method`. An application exception is the failure that every Thrift peer knows.
struct ReplyBody {
  enum class Form : std::uint8_t { kResult, kException, kFailure };
  Form form = Form::kResult;
  Value value;  ///< kResult, kException.
  const idl::Field* exception = nullptr;
  std::string failure;
  std::int32_t failure_type = 0;  ///< As TApplicationException numbers them.
};

/// The numbers of TApplicationException.
inline constexpr std::int32_t kUnknownMethod = 1;
inline constexpr std::int32_t kInternalError = 6;
inline constexpr std::int32_t kProtocolError = 7;

/// Reads and writes the messages of one connection in one encoding. Everything that fails throws WireError.
class Wire {
 public:
  virtual ~Wire() = default;
  /// `framed` per message: a server answers as it was asked.
  [[nodiscard]] static std::unique_ptr<Wire> make(Address::Protocol protocol, bool framed, Inbox& in, Outbox& out,
                                                  const Limits& limits);

  virtual void write_call(const std::string& name, MessageType type, std::int32_t sequence,
                          const idl::Struct& arguments, const Value& values) = 0;
  virtual void write_reply(const std::string& name, std::int32_t sequence, const idl::Method& method,
                           const ReplyBody& body) = 0;
  virtual void write_failure(const std::string& name, std::int32_t sequence, const std::string& message,
                             std::int32_t type) = 0;

  [[nodiscard]] virtual MessageHead read_head() = 0;
  [[nodiscard]] virtual Value read_arguments(const idl::Method& method) = 0;
  [[nodiscard]] virtual ReplyBody read_reply(MessageType type, const idl::Method& method) = 0;
  /// Skips the body of a message that nobody wants.
  virtual void skip_body() = 0;
  virtual void end_message() = 0;
  /// Forgets the state of a message that was left in its middle.
  virtual void reset() = 0;
};

/// Which of the encodings the next message has, from its first bytes; a server's first act on a connection.
struct Encoding {
  Address::Protocol protocol = Address::Protocol::kBinary;
  bool framed = false;
};
[[nodiscard]] Encoding detect_encoding(Inbox& in);

}  // namespace sentree::rpc
