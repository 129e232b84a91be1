#include "sentree/lsp/framing.h"

#include <gtest/gtest.h>

namespace sentree::lsp {
namespace {

TEST(Framing, PutsMessagesTogetherThatComeInPieces) {
  Framing framing;
  const std::string stream = framed("{\"a\":1}") + framed("{}");
  std::vector<std::string> got;
  for (const char byte : stream) {
    framing.feed({&byte, 1});
    while (const auto frame = framing.next()) got.push_back(frame->content);
  }
  EXPECT_EQ(got, (std::vector<std::string>{"{\"a\":1}", "{}"}));
}

TEST(Framing, ReadsHeadersOfOtherOrderAndCase) {
  Framing framing;
  framing.feed("Content-Type: application/vscode-jsonrpc; charset=utf-8\r\ncontent-length:  2 \r\n\r\n{}");
  EXPECT_EQ(framing.next()->content, "{}");
}

TEST(Framing, PassesOverWhatIsTooLargeWithoutKeepingIt) {
  Framing framing;
  const std::size_t size = kMessageBytesMax + 3;
  framing.feed("Content-Length: " + std::to_string(size) + "\r\n\r\n");
  EXPECT_NE(framing.next()->problem, "");
  const std::string piece(std::size_t{1} << 20U, 'x');
  std::size_t sent = 0;
  for (; sent + piece.size() <= size; sent += piece.size()) {
    framing.feed(piece);
    EXPECT_FALSE(framing.next());
  }
  framing.feed(std::string(size - sent, 'x') + framed("{}"));
  EXPECT_EQ(framing.next()->content, "{}");
}

TEST(Framing, GoesOnBehindAHeaderWithoutLength) {
  for (const char* header :
       {"Content-Length: -1\r\n\r\n", "Content-Length: 99999999999999999999999\r\n\r\n", "Hello\r\n\r\n"}) {
    Framing framing;
    framing.feed(header + framed("{}"));
    EXPECT_NE(framing.next()->problem, "") << header;
    EXPECT_EQ(framing.next()->content, "{}") << header;
  }
}

TEST(Framing, FindsTheNextHeaderBehindOneThatIsWrong) {
  const std::string lost = "{\"jsonrpc\":\"2.0\",\"id\":1}";
  for (const std::string& wrong :
       {"Content-Length: -5\r\n\r\n" + lost, "Content-Type: x\r\n\r\n" + lost, lost, "Content-Length: 3\r\n" + lost,
        "\r\n\r\n" + lost, "Content-Length: 26 bytes\r\n\r\n" + lost}) {
    // Whole, and byte by byte.
    for (const bool in_pieces : {false, true}) {
      Framing framing;
      std::vector<std::string> got;
      int problems = 0;
      const auto feed = [&](std::string_view bytes) {
        framing.feed(bytes);
        while (const auto frame = framing.next()) {
          if (frame->problem.empty())
            got.push_back(frame->content);
          else
            ++problems;
        }
      };
      const std::string stream = wrong + framed("{}") + framed("[]");
      if (in_pieces)
        for (const char byte : stream) feed({&byte, 1});
      else
        feed(stream);
      EXPECT_EQ(got, (std::vector<std::string>{"{}", "[]"})) << wrong;
      EXPECT_EQ(problems, 1) << wrong;
      EXPECT_FALSE(framing.is_lost()) << wrong;
    }
  }
}

TEST(Framing, TakesLinesThatEndWithALineFeedAlone) {
  Framing framing;
  framing.feed("Content-Length: 2\n\n{}" + framed("[]"));
  EXPECT_EQ(framing.next()->content, "{}");
  EXPECT_EQ(framing.next()->content, "[]");
}

TEST(Framing, SaysAtOnceThatNoHeaderBegins) {
  Framing framing;
  framing.feed("{\"jsonrpc\"");
  EXPECT_NE(framing.next()->problem, "");
  EXPECT_FALSE(framing.next());
  EXPECT_TRUE(framing.is_lost());
  framing.feed("Content-Len");
  EXPECT_FALSE(framing.next());
  EXPECT_TRUE(framing.is_lost());
}

TEST(Framing, GivesUpAHeaderThatDoesNotEnd) {
  Framing framing;
  framing.feed(std::string(kHeaderBytesMax - 1, 'x'));
  EXPECT_FALSE(framing.next());
  framing.feed("x");
  EXPECT_NE(framing.next()->problem, "");
  framing.feed(framed("{}"));
  EXPECT_EQ(framing.next()->content, "{}");
}

}  // namespace
}  // namespace sentree::lsp
