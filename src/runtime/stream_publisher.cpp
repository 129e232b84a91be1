#include "sentree/runtime/detail/stream_publisher.h"

#include <atomic>
#include <utility>

namespace sentree::runtime {

StreamPublisher::StreamPublisher(Stream& stream, const Monitors& monitors, Scheduler& scheduler, Duration patience)
    : stream_(stream), monitors_(monitors), scheduler_(scheduler), patience_(patience) {}

void StreamPublisher::publish(Message message) {
  if (elsewhere_ != nullptr) elsewhere_->take_observations();
  stream_.publish(std::move(message));
}

std::vector<std::string> StreamPublisher::gates() const {
  std::vector<std::string> all = monitors_.gated();
  if (elsewhere_ == nullptr) return all;
  for (const auto& observer : elsewhere_->observers())
    all.insert(all.end(), observer->gates().begin(), observer->gates().end());
  return all;
}

std::optional<mission::Admission> StreamPublisher::request(Message message, Stream::Decided decided) {
  if (elsewhere_ != nullptr) elsewhere_->take_observations();
  std::vector<Observer*> asked;
  if (elsewhere_ != nullptr) {
    for (const auto& observer : elsewhere_->observers()) {
      if (observer->is_gate_of(call_of(message))) asked.push_back(observer.get());
    }
  }
  if (asked.empty()) return admit(std::move(message), std::move(decided));
  ask(std::move(message), asked, std::move(decided));
  return std::nullopt;
}

std::optional<mission::Admission> StreamPublisher::admit(Message message, Stream::Decided decided) {
  if (!monitors_.is_gated(call_of(message))) {
    stream_.publish(std::move(message));
    return mission::Admission{};
  }
  return stream_.publish_if(
      std::move(message), [this](const Message& request) { return monitors_.judge(request); },
      scheduler_.now() + patience_, std::move(decided));
}

void StreamPublisher::ask(Message message, const std::vector<Observer*>& asked, Stream::Decided decided) {
  struct Question {
    Message request;
    Stream::Decided decided;
    std::atomic<std::size_t> unanswered;
    std::atomic<bool> open = true;
  };
  message.time = scheduler_.now();
  message.tick = stream_.tick();
  const auto question = std::make_shared<Question>();
  question->request = std::move(message);
  question->decided = std::move(decided);
  question->unanswered = asked.size();
  scheduler_.at(stream_.actor(), scheduler_.now() + patience_, mission::Rank::kTimer, [question] {
    if (question->open.exchange(false)) question->decided({mission::Veto{"", "an observer did not answer in time"}});
  });
  // Among the listeners of the stream, so that an observer has got whatever led to the request before it is asked.
  scheduler_.post(stream_.actor(), [this, question, asked] {
    stream_.flush();
    for (Observer* observer : asked) {
      observer->ask(question->request, [this, question](mission::Admission admission) {
        if (admission.veto) {
          if (question->open.exchange(false)) question->decided(std::move(admission));
        } else if (--question->unanswered == 0 && question->open.exchange(false)) {
          if (auto decision = admit(question->request, question->decided)) question->decided(std::move(*decision));
        }
      });
    }
  });
}

}  // namespace sentree::runtime
