#include "tether/constraints/core/pose_function.h"

#include "tether/constraints/core/path_length.h"

#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "tether/common/random.h"
#include "tether/constraints/core/field_function.h"
#include "tether/math/numeric_derivative.h"

namespace tether::constraints {
namespace {

using Eigen::Vector3d;
using math::Pose;

Vector3d RandomVector(Random& random, double scale = 1) {
  return scale * Vector3d(random.Normal(), random.Normal(), random.Normal());
}

Pose RandomPose(Random& random, double angle = 1) {
  return {math::ExpSO3(RandomVector(random, angle)), RandomVector(random)};
}

struct Named {
  std::string name;
  std::function<PoseFunctionPtr(Random&)> make;
};

std::vector<Named> AllFunctions() {
  return {
      {"HalfSpaces",
       [](Random& r) {
         return MakeHalfSpaces({{RandomVector(r), RandomVector(r).normalized(), 0.3},
                                {RandomVector(r), RandomVector(r).normalized(), -0.1}});
       }},
      {"MeanHalfSpaces",
       [](Random& r) {
         return MakeMeanHalfSpaces(
             {{RandomVector(r).normalized(), 0.3}, {RandomVector(r).normalized(), -0.1}},
             {{RandomVector(r), 0.5}, {RandomVector(r), 0.2}, {RandomVector(r), 0.3}});
       }},
      {"Directions",
       [](Random& r) {
         return MakeDirections(ParallelRows(RandomVector(r).normalized(), Vector3d::UnitX()));
       }},
      {"RotationMatch", [](Random& r) { return MakeRotationMatch(RandomPose(r).R); }},
      {"RotationChange", [](Random&) { return MakeRotationChange(); }},
      {"Displacement",
       [](Random& r) {
         return MakeDisplacement({RandomVector(r), RandomVector(r)});
       }},
      {"DisplacementInTarget",
       [](Random& r) {
         return MakeDisplacementInTarget({RandomVector(r), RandomVector(r)});
       }},
      {"PointDistance",
       [](Random& r) { return MakePointDistance(RandomVector(r), RandomVector(r), 0.4, -1); }},
      {"AxisDistance",
       [](Random& r) {
         return MakeAxisDistance(RandomVector(r), RandomVector(r).normalized(), RandomVector(r), 0.2);
       }},
      {"PartDistance",
       [](Random& r) {
         return MakePartDistance({geometry::Box{Vector3d(0.3, 0.2, 0.1)}, RandomPose(r)},
                                 {geometry::Capsule{0.05, 0.3}, RandomPose(r)}, 0.01, -1);
       }},
      {"CappedCylinder",
       [](Random& r) {
         return MakePartDistance({geometry::Cylinder{0.3, 0.4}, RandomPose(r)},
                                 {geometry::Sphere{0}, RandomPose(r)}, 0.01, -1);
       }},
      {"LineDistance",
       [](Random& r) {
         return MakeLineDistance({RandomVector(r), RandomVector(r).normalized()},
                                 {RandomVector(r), RandomVector(r).normalized()}, 0.1, -1);
       }},
      {"Angle",
       [](Random& r) { return MakeAngle(RandomVector(r).normalized(), RandomVector(r).normalized(), 0.35); }},
      {"NarrowingAngle",
       [](Random& r) {
         return MakeNarrowingAngle(RandomVector(r).normalized(), RandomVector(r).normalized(), 0.1, 0.7,
                                   RandomVector(r));
       }},
      {"PointCone",
       [](Random& r) {
         const Vector3d start(r.Normal(), r.Normal(), r.Uniform(0.1, 1));
         return MakePointCone(0.06, start, RandomVector(r));
       }},
      {"Frustum",
       [](Random& r) {
         const Vector3d start(r.Normal(), r.Normal(), r.Uniform(0.1, 1));
         return MakeFrustum({0.1, 0.2}, start, RandomVector(r));
       }},
      {"Travel", [](Random&) { return MakeTravel(0.7); }},
      {"Turn", [](Random&) { return MakeTurn(1.2); }},
      {"LengthOfTravel", [](Random&) { return MakeRootOfLength(MakeTravel(0.7)); }},
      {"LengthOfTurn", [](Random&) { return MakeRootOfLength(MakeTurn(1.2)); }},
  };
}

class PoseFunctionTest : public ::testing::TestWithParam<Named> {};

TEST_P(PoseFunctionTest, DerivativeAgreesWithNumericDifferentiation) {
  // The root of a length is rounded off over a millimetre, which the steps have to be small against.
  const double step = GetParam().name.starts_with("LengthOf") ? 5e-6 : 1e-4;
  Random random(3);
  for (double angle : {0.0, 1e-8, 0.3, 1.0}) {
    for (int trial = 0; trial < 25; ++trial) {
      const PoseFunctionPtr f = GetParam().make(random);
      std::vector<Pose> X;
      for (int k = 0; k < f->num_frames(); ++k) X.push_back(RandomPose(random, angle));
      Eigen::VectorXd r(f->size());
      Eigen::MatrixXd J(f->size(), 6 * f->num_frames());
      J.setConstant(1e9);
      nlp::JacobianRef J_ref(J);
      f->Evaluate(X, r, &J_ref);
      for (int k = 0; k < f->num_frames(); ++k) {
        const Eigen::MatrixXd numeric = math::NumericPoseJacobian(
            [&](const Pose& X_k) {
              std::vector<Pose> moved = X;
              moved[k] = X_k;
              Eigen::VectorXd value(f->size());
              f->Evaluate(moved, value, nullptr);
              return value;
            },
            X[k], step);
        EXPECT_LT((numeric - J.middleCols(6 * k, 6)).cwiseAbs().maxCoeff(), 2e-7)
            << "frame " << k << ", angle " << angle;
      }
    }
  }
}

TEST_P(PoseFunctionTest, DoesNotChangeWhenEverythingMoves) {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const PoseFunctionPtr f = GetParam().make(random);
    const Pose X_VW = RandomPose(random);
    std::vector<Pose> X, X_moved;
    for (int k = 0; k < f->num_frames(); ++k) {
      X.push_back(RandomPose(random));
      X_moved.push_back(X_VW * X.back());
    }
    Eigen::VectorXd r(f->size()), r_moved(f->size());
    f->Evaluate(X, r, nullptr);
    f->Evaluate(X_moved, r_moved, nullptr);
    if (GetParam().name == "Travel" || GetParam().name == "LengthOfTravel") {
      EXPECT_NEAR(r.norm(), r_moved.norm(), 1e-12);
    } else {
      EXPECT_LT((r - r_moved).norm(), 1e-9);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, PoseFunctionTest, ::testing::ValuesIn(AllFunctions()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace tether::constraints
