#pragma once

#include <string_view>

namespace sentree::record::schemas {

// JSON schemas of the topics. Those named foxglove.… have the members of https://docs.foxglove.dev/docs/sdk/schemas, so
// that viewers draw them.
extern const std::string_view kGap;
extern const std::string_view kObservation;
extern const std::string_view kTree;
extern const std::string_view kChart;
extern const std::string_view kMonitor;
extern const std::string_view kSnapshot;
extern const std::string_view kBattery;
extern const std::string_view kMotion;
extern const std::string_view kBlackboard;
extern const std::string_view kViolation;
extern const std::string_view kPose;
extern const std::string_view kPath;
extern const std::string_view kScan;
extern const std::string_view kGrid;
extern const std::string_view kLog;
extern const std::string_view kScene;

}  // namespace sentree::record::schemas
