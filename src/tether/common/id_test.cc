#include "tether/common/id.h"

#include <map>
#include <unordered_set>

#include <gtest/gtest.h>

namespace tether {
namespace {

TEST(IdTest, NamesNothingUnlessGivenANumber) {
  EXPECT_FALSE(ActionId().valid());
  EXPECT_EQ(ActionId().value(), -1);
  EXPECT_TRUE(ActionId(0).valid());
  EXPECT_EQ(ActionId(3).index(), 3u);
  EXPECT_LT(ActionId(), ActionId(0));
  EXPECT_LT(ActionId(1), ActionId(2));
  EXPECT_EQ(ObjectId(size_t{4}), ObjectId(4));
}

TEST(IdTest, KindsDoNotMix) {
  EXPECT_FALSE((std::is_convertible_v<ActionId, ObjectId>));
  EXPECT_FALSE((std::is_convertible_v<int, ActionId>));
  EXPECT_FALSE((std::is_convertible_v<ActionId, int>));
  EXPECT_FALSE((std::is_constructible_v<FrameId, ObjectId>));
}

TEST(IdTest, IsAKey) {
  const std::map<FrameId, int> ordered = {{FrameId(2), 20}, {FrameId(1), 10}};
  EXPECT_EQ(ordered.begin()->second, 10);
  const std::unordered_set<FrameId> hashed = {FrameId(2), FrameId(2), FrameId()};
  EXPECT_EQ(hashed.size(), 2u);
}

TEST(IndexedVectorTest, HasOneOfEachId) {
  IndexedVector<ObjectId, double> weights;
  EXPECT_EQ(weights.next_id(), ObjectId(0));
  for (const double weight : {1.0, 2.0, 4.0}) {
    const ObjectId id = weights.next_id();
    weights.push_back(weight);
    EXPECT_EQ(weights[id], weight);
  }
  double sum = 0;
  int last = -1;
  for (const ObjectId id : weights.ids()) {
    EXPECT_EQ(id.value(), ++last);
    weights[id] *= 2;
    sum += weights[id];
  }
  EXPECT_EQ(last, 2);
  EXPECT_EQ(sum, 14);
  EXPECT_EQ(weights.values().back(), 8);
}

TEST(IndexedVectorTest, PlainNumbersAreIndicesToo) {
  IndexedVector<int, bool> done(3, false);
  done[1] = true;
  int count = 0;
  for (const int i : done.ids()) count += done[i];
  EXPECT_EQ(count, 1);
  EXPECT_EQ(ToIndex(2), 2u);
}

}  // namespace
}  // namespace tether
