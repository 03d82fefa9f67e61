#include <benchmark/benchmark.h>

#include "tether/common/random.h"
#include "tether/robot/kinematics.h"
#include "tether/robot/model.h"

namespace tether::robot {
namespace {

Eigen::VectorXd RandomConfiguration(const Model& model, Random& random) {
  Eigen::VectorXd q(model.dof());
  for (int i = 0; i < model.dof(); ++i) q[i] = random.Uniform(model.lower()[i], model.upper()[i]);
  return q;
}

void BM_Kinematics(benchmark::State& run) {
  const auto model = Model::Load("panda");
  Random random(1);
  Kinematics kinematics(model);
  Eigen::MatrixXd J(6, model->dof());
  const Eigen::VectorXd q = RandomConfiguration(*model, random);
  for (auto _ : run) {
    kinematics.Set(q);
    kinematics.HandJacobian(J);
    benchmark::DoNotOptimize(J.data());
  }
}
BENCHMARK(BM_Kinematics);

void BM_State(benchmark::State& run) {
  const auto model = Model::Load("panda");
  Random random(1);
  State state(model);
  const Eigen::VectorXd q = RandomConfiguration(*model, random), v = Eigen::VectorXd::Zero(model->dof());
  for (auto _ : run) {
    state.Set(q, v);
    benchmark::DoNotOptimize(state.J_BH().data());
  }
}
BENCHMARK(BM_State);

}  // namespace
}  // namespace tether::robot
