// Writes a residual of one's own, checks its derivative, and solves a program with it: a pose as near as
// possible to a target, whose origin stays within a sphere.

#include <cmath>
#include <cstdio>
#include <memory>

#include "tether/math/pose.h"
#include "tether/math/so3.h"
#include "tether/nlp/program.h"
#include "tether/nlp/solver.h"

namespace {

using namespace tether;

/// p − p_target, 3 rows, m.
class Displacement : public nlp::Residual {
 public:
  Displacement(nlp::BlockRef pose, Eigen::Vector3d target)
      : Residual("displacement", 0, 3, nlp::Unit::kMetre, {pose}), target_(std::move(target)) {}
  void Evaluate(const nlp::Point& x, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    const math::Pose& X = x.poses[static_cast<size_t>(blocks()[0].index)];
    r = X.p - target_;
    if (J == nullptr) return;
    // A right perturbation, X ← X · Exp(δ), moves the origin by R δ_p, and its rotation does not move it.
    J->leftCols<3>() = X.R;
    J->rightCols<3>().setZero();
  }

 private:
  Eigen::Vector3d target_;
};

/// ‖p‖ − radius, 1 row, m: at most zero inside the sphere. Not to be asked for at the centre.
class WithinSphere : public nlp::Residual {
 public:
  WithinSphere(nlp::BlockRef pose, double radius)
      : Residual("within_sphere", 0, 1, nlp::Unit::kMetre, {pose}), radius_(radius) {}
  void Evaluate(const nlp::Point& x, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    const math::Pose& X = x.poses[static_cast<size_t>(blocks()[0].index)];
    r(0) = X.p.norm() - radius_;
    if (J == nullptr) return;
    J->leftCols<3>() = X.p.normalized().transpose() * X.R;
    J->rightCols<3>().setZero();
  }

 private:
  double radius_;
};

}  // namespace

int main() {
  nlp::Program program;
  const nlp::BlockRef pose = program.AddPose("hand");
  program.Add(std::make_shared<Displacement>(pose, Eigen::Vector3d(0.6, 0, 0.8)), nlp::Role::kCost);
  program.Add(std::make_shared<WithinSphere>(pose, 0.5), nlp::Role::kInequality);

  nlp::Point guess;
  guess.poses = {math::Pose(math::ExpSO3({0.3, -0.2, 0.1}), {0.1, 0.2, 0.3})};
  for (const nlp::Term& term : program.terms()) {
    const double error = nlp::JacobianError(*term.residual, program, guess);
    std::printf("%s: derivative off by %.1e\n", term.residual->name().c_str(), error);
    if (error > 1e-6) return 1;
  }
  const nlp::Result result = nlp::MakeSolver(nlp::Backend::kNative)->Solve(program, guess, {});
  const Eigen::Vector3d p = result.x.poses[0].p;
  std::printf("%s\norigin at (%.4f, %.4f, %.4f) m\n", result.Summary().c_str(), p.x(), p.y(), p.z());
  return result.ok() && (p - Eigen::Vector3d(0.3, 0, 0.4)).norm() < 1e-4 ? 0 : 1;
}
