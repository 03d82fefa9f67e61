#include "tether/evaluation/margins/torque_margins.h"

#include <gtest/gtest.h>

namespace tether::evaluation {
namespace {

const Margin& Find(const TorqueMargins& margins, const std::string& name) {
  for (const Margin& margin : margins.margins()) {
    if (margin.name == name) return margin;
  }
  ADD_FAILURE() << name;
  return margins.margins().front();
}

TEST(TorqueMargins, TorquesAndTheirRatesAreMeasuredFromWhatIsCommanded) {
  const auto model = robot::Model::Load("panda");
  TorqueMargins margins(model, 40, 0.001);
  Eigen::VectorXd torque = Eigen::VectorXd::Zero(7);
  margins.Observe(0, torque, {});
  torque[4] = 0.25;
  margins.Observe(0.001, torque, {});
  torque[4] = 2;
  margins.Observe(0.002, torque, {});
  EXPECT_DOUBLE_EQ(Find(margins, "joint torque limits").minimum, 10);
  EXPECT_EQ(Find(margins, "joint torque limits").what, "joint5");
  EXPECT_NEAR(Find(margins, "joint torque rate limits").minimum, 1000 - 1750, 1e-9);
  EXPECT_DOUBLE_EQ(Find(margins, "joint torque rate limits").time, 0.002);
}

TEST(TorqueMargins, AForceIsThatOfAPairOverTenMilliseconds) {
  TorqueMargins margins(robot::Model::Load("panda"), 40, 0.001);
  const Eigen::VectorXd torque = Eigen::VectorXd::Zero(7);
  EXPECT_DOUBLE_EQ(Find(margins, "unintended force").minimum, 40);
  // 345 N for a millisecond, then 30 N, are 61.5 N over 10 ms; two pairs are not added up.
  for (int i = 0; i < 30; ++i) {
    const double force = i == 5 ? 345 : i > 5 ? 30 : 0;
    margins.Observe(0.001 * i, torque, {{"panda", "bench", force}, {"panda", "shelf", 20}});
  }
  EXPECT_NEAR(Find(margins, "unintended force").minimum, 40 - 61.5, 1e-9);
  EXPECT_EQ(Find(margins, "unintended force").what, "panda and bench");
  EXPECT_NEAR(margins.forces().most, 61.5, 1e-9);
  margins.ForgetLast();
  margins.Observe(0.03, torque, {{"panda", "bench", 30}, {"panda", "shelf", 20}});
  EXPECT_NEAR(Find(margins, "unintended force").last, 10, 1e-9);
}

}  // namespace
}  // namespace tether::evaluation
