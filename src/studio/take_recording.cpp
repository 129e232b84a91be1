#include "sentree/studio/detail/take_recording.h"

#include <map>

#include "sentree/studio/detail/record_reader.h"

namespace sentree::studio {

Result<void> take_recording(History& history, const std::string& recording,
                            const std::function<bool(const record::RawMessage&, const record::RunRecord&)>& wants) {
  const auto reader = record::Reader::open(recording);
  if (!reader) return tl::unexpected(reader.error());
  std::map<record::ChannelId, Topic> topics;
  for (const auto& [id, channel] : (*reader)->channels()) topics.emplace(id, topic_of(channel.topic));
  RecordReader record_reader;
  for (std::size_t part = 0; part < (*reader)->parts(); ++part) {
    const auto records = (*reader)->part(part);
    if (!records) return tl::unexpected(records.error());
    (*reader)->each_message(*records, [&](const record::RawMessage& message) {
      const TimePoint time(Duration(message.log_time));
      const auto record =
          record_reader.read(topics.at(message.channel), time, message.data, RecordReader::Depth::kWhole);
      if (record && wants(message, *record)) history.take(time, *record);
    });
  }
  return {};
}

}  // namespace sentree::studio
