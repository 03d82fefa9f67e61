#include "tether/execution/observer/frame_tracker.h"

#include <gtest/gtest.h>

#include "tether/common/random.h"

namespace tether::execution {
namespace {

math::Pose Noisy(const math::Pose& X, Random& random) {
  const auto draw = [&](double s) -> Eigen::Vector3d {
    return s * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
  };
  return {math::ExpSO3(draw(0.005)) * X.R, X.p + draw(0.003)};
}

// find velocity_noise_delay: differences of noisy poses were taken for velocities (0.3 m/s of a frame at
// rest).
TEST(FrameTracker, VelocityNoiseDelay_AFrameAtRestHasNoVelocityHoweverNoisyItIs) {
  for (const double rate : {30.0, 200.0, 1000.0}) {
    Random random(3);
    FrameTracker tracker;
    tracker.Reset(Noisy({}, random), 0);
    double fastest = 0, off = 0, turning = 0;
    for (int i = 1; i < 10 * rate; ++i) {
      tracker.Predict(i / rate);
      tracker.Correct(Noisy({}, random));
      if (i < 2 * rate) continue;
      fastest = std::max(fastest, tracker.V_WF().head<3>().norm());
      turning = std::max(turning, tracker.V_WF().tail<3>().norm());
      off = std::max(off, tracker.X_WF().p.norm());
    }
    EXPECT_LT(fastest, 0.03) << rate;
    EXPECT_LT(turning, 0.06) << rate;
    EXPECT_LT(off, 0.006) << rate;
    EXPECT_FALSE(tracker.exact());
  }
}

TEST(FrameTracker, ANoisyFrameThatBeginsToMoveIsFollowed) {
  for (const double rate : {30.0, 200.0}) {
    Random random(4);
    FrameTracker tracker;
    tracker.Reset({}, 0);
    const double begins = 3;
    for (int i = 1; i / rate < begins + 0.8; ++i) {
      const double t = i / rate, x = t < begins ? 0 : 0.2 * (t - begins);
      tracker.Predict(t);
      tracker.Correct(Noisy(math::Pose(Eigen::Vector3d(x, 0, 0)), random));
      if (t > begins) {
        EXPECT_NEAR(tracker.X_WF().p.x(), x, 0.045) << rate << " Hz, " << t;
      }
    }
    EXPECT_NEAR(tracker.V_WF()[0], 0.2, 0.1) << rate;
    EXPECT_NEAR(tracker.X_WF().p.x(), 0.16, 0.012) << rate;
  }
}

}  // namespace
}  // namespace tether::execution
