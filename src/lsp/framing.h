#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace sentree::lsp {

/// Bytes of one message, and of its header. What is larger is passed over.
inline constexpr std::size_t kMessageBytesMax = std::size_t{16} << 20U;
inline constexpr std::size_t kHeaderBytesMax = 4096;

/// Cuts a stream of bytes into messages. Behind a header that it cannot use it finds the next one that is well formed,
/// wherever that begins; of a message that is too large no more is kept than the number of bytes that are still to
/// come. Lines of headers may end with \n alone. Source: Language Server Protocol 3.17, base protocol.
class Framing {
 public:
  struct Frame {
    std::string content;
    std::string problem;  ///< Not empty: there is no message; why.
  };

  void feed(std::string_view bytes) { waiting_.append(bytes); }
  /// Nothing: more bytes are needed.
  [[nodiscard]] std::optional<Frame> next();
  /// What came was no message, and no header has been found since. Whoever waits for an answer may wait for ever.
  [[nodiscard]] bool is_lost() const { return is_lost_; }

 private:
  std::optional<Frame> refuse(std::string problem);
  bool find_header();

  std::string waiting_;
  std::size_t at_ = 0;                 // what is before has been taken
  std::optional<std::size_t> length_;  // of the message that has begun
  std::size_t passed_over_ = 0;        // bytes of a refused message that are still to come
  bool is_lost_ = false;
};

/// The message with its header.
[[nodiscard]] std::string framed(std::string_view content);

}  // namespace sentree::lsp
