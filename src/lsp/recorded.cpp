#include "sentree/lsp/detail/recorded.h"

#include <algorithm>
#include <chrono>

#include "sentree/record/observation.h"
#include "sentree/record/reader.h"

namespace sentree::lsp {

namespace {

namespace fs = std::filesystem;

// What follows "name": in an observation, without reading all of it.
std::string_view name_in(std::string_view text) {
  constexpr std::string_view kName = "\"name\":\"";
  const std::size_t from = text.find(kName);
  if (from == std::string_view::npos) return {};
  const std::size_t end = text.find('"', from + kName.size());
  return end == std::string_view::npos ? std::string_view()
                                       : text.substr(from + kName.size(), end - from - kName.size());
}

}  // namespace

std::optional<Recorded::Last> Recorded::last(const fs::path& folder, const std::string& observation) {
  fs::path newest;
  fs::file_time_type changed;
  std::size_t count = 0;
  std::error_code error;
  fs::directory_iterator it(folder / "runs", error);
  for (; !error && it != fs::directory_iterator() && count < kRecordingsMax; it.increment(error), ++count) {
    if (it->path().extension() != ".mcap") continue;
    const auto time = it->last_write_time(error);
    if (error || (!newest.empty() && time <= changed)) continue;
    newest = it->path();
    changed = time;
  }
  if (newest.empty()) return std::nullopt;
  if (newest != file_ || changed != changed_) {
    file_ = newest;
    changed_ = changed;
    texts_.clear();
    read(newest);
  }
  const auto found = texts_.find(observation);
  if (found == texts_.end()) return std::nullopt;
  record::RawMessage raw;
  raw.data = found->second.text;
  raw.log_time = found->second.time_ns;
  const auto message = record::read_observation(raw);
  if (!message) return std::nullopt;
  return Last{message->data, std::chrono::duration<double>(message->time.time_since_epoch()).count(),
              newest.filename().string()};
}

void Recorded::read(const fs::path& file) {
  const auto reader = record::Reader::open(file.string());
  if (!reader) return;
  const auto channels = (*reader)->channels_of(record::kObservationsTopic);
  std::size_t bytes = 0;
  for (std::size_t part = (*reader)->parts(); part > 0 && bytes < kRecordedBytesMax; --part) {
    const auto records = (*reader)->part(part - 1);
    if (!records) continue;
    bytes += records->size();
    std::map<std::string_view, record::RawMessage> last;
    (*reader)->each_message(*records, [&](const record::RawMessage& message) {
      if (std::find(channels.begin(), channels.end(), message.channel) == channels.end()) return;
      if (const auto name = name_in(message.data); !name.empty()) last[name] = message;
    });
    for (const auto& [name, message] : last)
      texts_.try_emplace(std::string(name), Text{std::string(message.data), message.log_time});
  }
}

}  // namespace sentree::lsp
