#include "tether/evaluation/margins/force_record.h"

#include <gtest/gtest.h>

namespace tether::evaluation {
namespace {

TEST(ForceRecord, StretchesAreThoseOfOnePairWithoutABreak) {
  ForceRecord record(0.001);
  int which = 0;
  for (int i = 0; i < 400; ++i) {
    const double force = i < 60 ? 60 : i < 160 ? 45 : i < 200 ? 0 : i < 230 ? 60 : 0;
    const double other = i >= 100 && i < 260 ? 39 : 0;
    record.Observe(0.001 * i, {{"arm", "bench", force}, {"arm", "box", other}}, &which);
  }
  EXPECT_NEAR(record.summary().most, 60, 1e-9);
  EXPECT_EQ(record.summary().most_pair, "arm and bench");
  EXPECT_NEAR(record.summary().longest_50, 0.057, 0.003);
  EXPECT_NEAR(record.summary().longest_40, 0.156, 0.003);
}

// A block that falls onto the arm is not the arm's doing, but that it goes on pressing is.
TEST(ForceRecord, OfWhatMovesIntoTheArmOnlyWhatLastsCounts) {
  ForceRecord record(0.001);
  int which = 0;
  for (int i = 0; i < 300; ++i) {
    const double force = i < 20 ? 300 : i < 50 ? 80 : i < 220 ? 42 : 0;
    EXPECT_EQ(record.Observe(0.001 * i, {{"arm", "block", force, i < 20}}, &which), 0) << i;
  }
  EXPECT_EQ(record.summary().most, 0);
  EXPECT_GT(record.summary().struck_most, 290);
  EXPECT_EQ(record.summary().longest_50, 0);
  EXPECT_NEAR(record.summary().longest_40, 0.2, 0.015);
}

}  // namespace
}  // namespace tether::evaluation
