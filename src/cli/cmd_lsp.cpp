#include <poll.h>
#include <unistd.h>

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <string>

#include "sentree/base/write_all.h"
#include "sentree/cli/commands.h"
#include "sentree/lsp/framing.h"
#include "sentree/lsp/server.h"

namespace sentree::cli {

namespace {
constexpr int kLostMax_ms = 2000;  // without a header that can be used
}  // namespace

int lsp() {
  lsp::Server server(SENTREE_VERSION);
  lsp::Framing framing;
  bool is_open = true;
  while (!server.is_over() && (is_open || server.has_work())) {
    // What comes goes before what is to be done: it may cancel that, or change the text that would be checked.
    pollfd input{STDIN_FILENO, POLLIN, 0};
    const bool may_read = is_open && server.has_room();
    // An editor whose message was none may wait for the answer, and say nothing more.
    const int patience_ms = server.has_work() ? 0 : framing.is_lost() ? kLostMax_ms : -1;
    const int ready = may_read ? poll(&input, 1, patience_ms) : 0;
    if (ready < 0 && errno != EINTR) return kEnvironment;
    if (ready > 0) {
      char buffer[64 * 1024];
      const ssize_t got = read(STDIN_FILENO, buffer, sizeof buffer);
      if (got < 0 && errno == EINTR) continue;
      is_open = got > 0;
      framing.feed({buffer, static_cast<std::size_t>(got > 0 ? got : 0)});
      while (const auto frame = framing.next()) {
        if (frame->problem.empty())
          server.receive(frame->content);
        else
          server.refuse(frame->problem);
      }
    } else if (server.has_work()) {
      server.work();
    } else if (ready == 0 && may_read) {
      break;
    }
    for (const std::string& message : server.take_answers()) {
      if (!write_all(STDOUT_FILENO, lsp::framed(message))) return kEnvironment;
    }
  }
  if (framing.is_lost()) {
    fmt::print(stderr,
               "sentree lsp: what came was no message of the protocol (Content-Length: NUMBER, an empty line, "
               "the message), and none came behind it; end\n");
  }
  return server.is_over() ? server.exit_code() : kFindings;
}

}  // namespace sentree::cli
