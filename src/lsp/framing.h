#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace sentree::lsp {

/// Bytes of one message, and of its header. What is larger is passed over.
inline constexpr std::size_t kMessageBytesMax = std::size_t{16} << 20U;
inline constexpr std::size_t kHeaderBytesMax = 4096;

/// Cuts a stream of bytes into messages. It finds the next one again behind a header that it cannot use and behind a
/// message that is too large, of which no more is kept than the number of bytes that are still to come.
/// Source: Language Server Protocol 3.17, base protocol.
class Framing {
 public:
  struct Frame {
    std::string content;
    std::string problem;  ///< Not empty: there is no message; why.
  };

  void feed(std::string_view bytes) { waiting_.append(bytes); }
  /// Nothing: more bytes are needed.
  [[nodiscard]] std::optional<Frame> next();

 private:
  std::string waiting_;
  std::size_t at_ = 0;                 // what is before has been taken
  std::optional<std::size_t> length_;  // of the message that has begun
  std::size_t passed_over_ = 0;        // bytes of a refused message that are still to come
};

/// The message with its header.
[[nodiscard]] std::string framed(std::string_view content);

}  // namespace sentree::lsp
