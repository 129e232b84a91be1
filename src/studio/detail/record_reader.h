#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "sentree/base/time.h"
#include "sentree/record/run_record.h"

namespace sentree::studio {

/// What a channel of a run's recording holds.
struct Topic {
  enum class Kind : std::uint8_t {
    kNone,  ///< Nothing that a page shows.
    kObservation,
    kChart,
    kMonitor,
    kLog,
    kBlackboard,
    kViolation,
    kScene,
    kPose,
    kEstimate,
    kScan,
    kPath,
    kParticles,
    kMotion,
    kBattery
  };
  Kind kind = Kind::kNone;
  std::string robot;  ///< Of the topics of a robot.
};
[[nodiscard]] Topic topic_of(std::string_view topic);

/// Whether an observation changes what is known of the run beside being one of its observations.
[[nodiscard]] bool changes_state(const Message& message);

/// Makes records of the JSON of a recording's messages, of which it believes nothing: what is missing or of another
/// type is left as it is in an empty record.
class RecordReader {
 public:
  enum class Depth : std::uint8_t {
    kIndex,  ///< What is needed to find things: no data of charts, and of observations only where `changes_state`;
             ///< of scans, paths, particles and motions only whose they are.
    kWhole,
  };

  RecordReader();
  ~RecordReader();
  RecordReader(const RecordReader&) = delete;
  RecordReader& operator=(const RecordReader&) = delete;

  /// Nothing if the text is no JSON object. Cost: one pass over the text.
  [[nodiscard]] std::optional<record::RunRecord> read(const Topic& topic, TimePoint time, std::string_view json,
                                                      Depth depth);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
