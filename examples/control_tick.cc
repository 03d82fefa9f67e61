// One tick of the torque controller: from a measured state and a target for the hand to joint torques. The
// arm is then moved by its own model of dynamics, a thousand ticks long, to see the hand arrive.

#include <cstdio>

#include <Eigen/Cholesky>

#include "tether/control/operational_space.h"
#include "tether/robot/model.h"

int main() {
  using namespace tether;
  const auto model = robot::Model::Load("panda");
  control::OperationalSpaceController controller(model, {}, model->home());

  robot::State state(model);  // At home, at rest.
  control::HandTarget target;
  target.X_BH = state.X_BH();
  target.X_BH.p += Eigen::Vector3d(0.05, 0.05, -0.05);

  Eigen::VectorXd q = state.q(), v = state.v();
  constexpr double kPeriod = 0.001;  // s
  for (int tick = 0; tick < 1000; ++tick) {
    state.Set(q, v);
    const Eigen::VectorXd& torque = controller.Compute(state, target);  // Allocates nothing.
    if ((torque.cwiseAbs().array() > model->max_torque().array()).any()) return 1;
    v += kPeriod * state.M().llt().solve(torque - state.bias());
    q += kPeriod * v;
  }
  state.Set(q, v);
  const double error = (state.X_BH().p - target.X_BH.p).norm();
  std::printf("after 1 s the hand is %.2f mm from its target, and moves at %.4f m/s\n", 1e3 * error,
              (state.J_BH() * v).head<3>().norm());
  return error < 0.002 ? 0 : 1;
}
