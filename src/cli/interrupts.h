#pragma once

namespace sentree::cli {

/// As long as it lives, SIGINT, SIGTERM and SIGHUP (unless nohup has it ignored) end nothing, but are noted; the next
/// one ends the program, unless the first has been taken. One at a time.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;
};

/// One of them has come since the last `Interrupts` was made.
[[nodiscard]] bool is_interrupted();
/// The same, and forgets it.
[[nodiscard]] bool take_interrupt();

}  // namespace sentree::cli
