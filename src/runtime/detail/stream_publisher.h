#pragma once

#include <memory>
#include <vector>

#include "sentree/runtime/elsewhere.h"
#include "sentree/runtime/monitors.h"
#include "sentree/runtime/publisher.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/stream.h"

namespace sentree::runtime {

/// The stream as callers see it, with the monitors and observers that gate it.
class StreamPublisher final : public Publisher {
 public:
  /// @param patience  How long a gate may take [run time].
  StreamPublisher(Stream& stream, const Monitors& monitors, Scheduler& scheduler, Duration patience);

  /// Whose observers may gate, and what was observed there comes before what is published here. Borrowed; before the
  /// run.
  void set_elsewhere(Elsewhere* elsewhere) { elsewhere_ = elsewhere; }

  void publish(Message message) override;
  bool is_heard(mission::ObservationName& name) override { return stream_.is_heard(name); }
  void pass() override { stream_.pass(); }
  std::optional<mission::Admission> request(Message message, Stream::Decided decided) override;
  std::uint64_t next_call() override { return stream_.next_call(); }
  std::vector<std::string> gates() const override;

 private:
  // Asks the monitors of this process, and publishes.
  std::optional<mission::Admission> admit(Message message, Stream::Decided decided);
  // Asks those elsewhere first, all at once; the first veto, or the deadline, decides.
  void ask(Message message, const std::vector<Observer*>& asked, Stream::Decided decided);

  Stream& stream_;
  const Monitors& monitors_;
  Scheduler& scheduler_;
  Duration patience_;
  Elsewhere* elsewhere_ = nullptr;
};

}  // namespace sentree::runtime
