#include "sentree/sim/topics.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "sentree/sim/services.h"

namespace sentree::sim {
namespace {

TEST(Topics, AreAnswersOfServicesThatAreThere) {
  for (const TopicInfo& info : topics()) {
    const ServiceInfo* const service = find_service(info.service);
    ASSERT_NE(service, nullptr) << info.topic;
    EXPECT_NE(std::find(service->methods.begin(), service->methods.end(), info.method), service->methods.end())
        << info.topic;
    EXPECT_EQ(find_topic(info.topic), &info);
  }
  EXPECT_EQ(find_topic("batery"), nullptr);
  EXPECT_EQ(find_service(kTelemetry), nullptr);
}

}  // namespace
}  // namespace sentree::sim
