#include "tether/common/limits.h"

#include <vector>

#include <gtest/gtest.h>

namespace tether {
namespace {

TEST(LimitsTest, WithoutLimitsNothingIsReached) {
  const Limits limits;
  EXPECT_EQ(limits.Reached(), std::nullopt);
  EXPECT_NO_THROW(limits.Poll());
}

TEST(LimitsTest, ADeadlineThatPassedIsReached) {
  Limits limits;
  limits.SetTimeLimit(1e-9);
  while (!limits.Reached()) {
  }
  EXPECT_EQ(limits.Reached(), Limit::kTime);
  limits.SetTimeLimit(1e300);
  EXPECT_EQ(limits.Reached(), std::nullopt);
  limits.SetTimeLimit(0);
  EXPECT_EQ(limits.deadline, std::nullopt);
}

TEST(LimitsTest, AnInterruptionComesFirst) {
  std::atomic<bool> stop{false};
  Limits limits;
  limits.interrupted = &stop;
  limits.deadline = std::chrono::steady_clock::time_point{};
  EXPECT_EQ(limits.Reached(), Limit::kTime);
  stop = true;
  EXPECT_EQ(limits.Reached(), Limit::kInterrupted);
  try {
    limits.Poll();
    FAIL();
  } catch (const LimitReached& reached) {
    EXPECT_EQ(reached.limit(), Limit::kInterrupted);
    EXPECT_STREQ(reached.what(), "interrupted");
  }
}

TEST(LimitsTest, MemoryOfTheProcessIsLimited) {
  const size_t before = MemoryInUse();
  if (before == 0) GTEST_SKIP() << "the system does not say";
  Limits limits;
  limits.memory = 1;
  EXPECT_EQ(limits.Reached(), Limit::kMemory);
  limits.memory = size_t{1} << 60;
  EXPECT_EQ(limits.Reached(), std::nullopt);
  constexpr size_t kSome = size_t{64} << 20;
  const std::vector<char> block(kSome, 1);
  EXPECT_GT(MemoryInUse(), before + kSome / 2) << block[kSome / 3];
}

TEST(LimitsTest, APollerComesToAPollInTheEnd) {
  std::atomic<bool> stop{true};
  Limits limits;
  limits.interrupted = &stop;
  LimitPoller poller(limits);
  EXPECT_THROW(
      {
        for (int i = 0; i < 256; ++i) poller.Tick();
      },
      LimitReached);
}

TEST(LimitsTest, MemorySizesHaveUnits) {
  EXPECT_EQ(ParseMemorySize("0"), 0u);
  EXPECT_EQ(ParseMemorySize("512"), size_t{512} << 20);
  for (const char* text : {"2G", "2g", "2GB", "2GiB", "2 gib", "2048", "2048M", "2097152k"})
    EXPECT_EQ(ParseMemorySize(text), kDefaultMemoryLimit) << text;
  EXPECT_EQ(ParseMemorySize("1.5m"), size_t{3} << 19);
  for (const char* text : {"", "G", "-1", "nan", "inf", "2X", "2GX", "1e30", "2G 3"})
    EXPECT_EQ(ParseMemorySize(text), std::nullopt) << text;
}

}  // namespace
}  // namespace tether
