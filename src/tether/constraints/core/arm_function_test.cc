#include "tether/constraints/core/arm_function.h"

#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/geometry/distance/distance.h"
#include "tether/math/numeric_derivative.h"
#include "tether/robot/kinematics.h"

namespace tether::constraints {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using math::Pose;

std::shared_ptr<const robot::Model> Panda() {
  static const std::shared_ptr<const robot::Model> model = robot::Model::Load("panda");
  return model;
}

Pose RandomPose(Random& random, double angle = 1) {
  const auto vector = [&] { return Vector3d(random.Normal(), random.Normal(), random.Normal()); };
  const Vector3d w = angle * vector();
  return {math::ExpSO3(w), vector()};
}

struct Named {
  std::string name;
  std::function<ArmFunctionPtr(Random&)> make;
};

std::vector<Named> AllFunctions() {
  return {{"HandPosition", [](Random&) { return MakeHandPosition(Panda()); }},
          {"DisplacedHandPosition",
           [](Random&) {
             return MakeHandPosition(Panda(), {{0.1, -0.2, 0.05}, {0.02, 0.03, 0.3}});
           }},
          {"HandRotation", [](Random&) { return MakeHandRotation(Panda()); }},
          {"LinkClearance",
           [](Random& r) {
             return MakeLinkClearance(Panda(), 1 + r.Index(7), 0,
                                      {geometry::Box{{0.3, 0.2, 0.1}}, RandomPose(r)}, 0.01);
           }},
          {"SelfClearance", [](Random& r) {
             const auto& pairs = Panda()->solids().pairs;
             const auto& [a, b] = pairs[r.Index(static_cast<int>(pairs.size()))];
             return MakeSelfClearance(Panda(), a, 0, b, 0, 0.01);
           }}};
}

VectorXd RandomConfiguration(Random& random) {
  VectorXd q(7);
  for (int i = 0; i < 7; ++i) q[i] = random.Uniform(Panda()->lower()[i], Panda()->upper()[i]);
  return q;
}

TEST(ArmFunctionTest, DerivativesAreExact) {
  Random random(1);
  for (const Named& named : AllFunctions()) {
    for (int i = 0; i < 40; ++i) {
      const ArmFunctionPtr f = named.make(random);
      const VectorXd q = RandomConfiguration(random);
      std::vector<Pose> X;
      for (int k = 0; k < f->num_frames(); ++k) X.push_back(RandomPose(random, 0.7));
      const int m = f->size();
      MatrixXd J_q(m, 7), J_X(m, 6 * f->num_frames());
      VectorXd r(m), plus(m), minus(m);
      nlp::JacobianRef ref_q(J_q), ref_X(J_X);
      f->Evaluate(q, X, r, &ref_q, &ref_X);
      f->Evaluate(q, X, plus, nullptr, nullptr);
      EXPECT_EQ(r, plus) << named.name;
      if (f->unit() == nlp::Unit::kRadian && r.norm() > 3) continue;  // at half a turn it has two branches
      constexpr double step = 1e-6;
      for (int j = 0; j < 7; ++j) {
        f->Evaluate(q + step * VectorXd::Unit(7, j), X, plus, nullptr, nullptr);
        f->Evaluate(q - step * VectorXd::Unit(7, j), X, minus, nullptr, nullptr);
        EXPECT_LT((J_q.col(j) - (plus - minus) / (2 * step)).norm(), 1e-6) << named.name << ", joint " << j;
      }
      for (int j = 0; j < 6 * f->num_frames(); ++j) {
        const auto moved = [&](double by) {
          std::vector<Pose> Y = X;
          math::Vector6d delta = math::Vector6d::Zero();
          delta[j % 6] = by;
          Y[j / 6] = Y[j / 6] * math::ExpSE3(delta);
          return Y;
        };
        f->Evaluate(q, moved(step), plus, nullptr, nullptr);
        f->Evaluate(q, moved(-step), minus, nullptr, nullptr);
        EXPECT_LT((J_X.col(j) - (plus - minus) / (2 * step)).norm(), 1e-6) << named.name << ", column " << j;
      }
    }
  }
}

TEST(ArmFunctionTest, MovingEverythingChangesNothing) {
  Random random(2);
  for (const Named& named : AllFunctions()) {
    const ArmFunctionPtr f = named.make(random);
    const VectorXd q = RandomConfiguration(random);
    const Pose G = RandomPose(random);
    std::vector<Pose> X, Y;
    for (int k = 0; k < f->num_frames(); ++k) {
      X.push_back(RandomPose(random));
      Y.push_back(G * X.back());
    }
    VectorXd r(f->size()), s(f->size());
    f->Evaluate(q, X, r, nullptr, nullptr);
    f->Evaluate(q, Y, s, nullptr, nullptr);
    EXPECT_LT((r - s).norm(), 1e-9) << named.name;
  }
}

TEST(ArmFunctionTest, RowsSayWhatTheyMeasure) {
  Random random(3);
  robot::State state(Panda());
  robot::Kinematics kinematics(Panda());
  for (int i = 0; i < 20; ++i) {
    const VectorXd q = RandomConfiguration(random);
    state.Set(q, VectorXd::Zero(7));
    kinematics.Set(q);
    const Pose X_WB = RandomPose(random), X_WO = RandomPose(random, 0.3);
    VectorXd r(3);
    const std::vector<Pose> at_hand{X_WB, X_WB * state.X_BH()};
    MakeHandPosition(Panda())->Evaluate(q, at_hand, r, nullptr, nullptr);
    EXPECT_LT(r.norm(), 1e-12);
    MakeHandRotation(Panda())->Evaluate(q, at_hand, r, nullptr, nullptr);
    EXPECT_LT(r.norm(), 1e-7);
    const geometry::Part box{geometry::Box{{0.3, 0.2, 0.1}}, RandomPose(random)};
    VectorXd one(1);
    const std::vector<Pose> X{X_WB, X_WO};
    MakeLinkClearance(Panda(), 4, 1, box, 0.01)->Evaluate(q, X, one, nullptr, nullptr);
    const geometry::Part& part = Panda()->solids().links[4].shape.parts[1];
    const double distance =
        geometry::SignedDistance(part.primitive, X_WB * kinematics.X_BSolid(4) * part.X_SP, box.primitive,
                                 X_WO * box.X_SP)
            .distance;
    EXPECT_NEAR(one[0], 0.01 - distance, 1e-9);
  }
}

}  // namespace
}  // namespace tether::constraints
