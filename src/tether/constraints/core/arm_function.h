#pragma once

#include <memory>
#include <span>
#include <string>

#include <Eigen/Core>

#include "tether/geometry/shape.h"
#include "tether/math/pose.h"
#include "tether/nlp/program.h"
#include "tether/robot/model.h"

namespace tether::constraints {

/// A vector-valued function of the arm's joint positions q and of the poses of a few frames, all given in one
/// common frame; the first is the robot's base B. It does not change when all poses are moved together. A
/// PoseFunction for IK solutions: the rows of key poses' configurations (docs/architecture.md,
/// "Conventions").
class ArmFunction {
 public:
  virtual ~ArmFunction() = default;

  int size() const { return size_; }
  int num_frames() const { return num_frames_; }
  nlp::Unit unit() const { return unit_; }
  int dof() const { return model_->dof(); }

  /// Writes size() rows to `r`, and if asked for the exact derivatives: `J_q` in q, size() × n, and `J_X` in
  /// a right perturbation of each pose, size() × 6·num_frames(); both or none. Allocates nothing.
  virtual void Evaluate(const Eigen::VectorXd& q, std::span<const math::Pose> X, nlp::VectorRef r,
                        nlp::JacobianRef* J_q, nlp::JacobianRef* J_X) const = 0;

 protected:
  ArmFunction(std::shared_ptr<const robot::Model> model, int size, int num_frames, nlp::Unit unit)
      : model_(std::move(model)), size_(size), num_frames_(num_frames), unit_(unit) {}
  const robot::Model& model() const { return *model_; }

 private:
  std::shared_ptr<const robot::Model> model_;
  int size_;
  int num_frames_;
  nlp::Unit unit_;
};

using ArmFunctionPtr = std::shared_ptr<const ArmFunction>;

/// A displacement, m: `by_H` turns with a frame H, `by_B` does not turn with it.
struct Offset {
  Eigen::Vector3d by_H = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_B = Eigen::Vector3d::Zero();
};

/// Frames (B, H). Where the origin of H, displaced by `offset`, is in the hand that q gives: 3 rows, m; zero
/// where the hand is there.
ArmFunctionPtr MakeHandPosition(std::shared_ptr<const robot::Model> model, const Offset& offset = {});

/// Frames (B, H). The rotation vector of H in the hand that q gives: 3 rows, rad.
ArmFunctionPtr MakeHandRotation(std::shared_ptr<const robot::Model> model);

/// Frames (B, A). distance − (signed distance of a part of a link from a part of A): 1 row, m. `solid` is an
/// index in ArmSolids::links.
ArmFunctionPtr MakeLinkClearance(std::shared_ptr<const robot::Model> model, int solid, int part,
                                 geometry::Part other, double distance);

/// Frames (B). distance − (signed distance of two parts of the arm): 1 row, m. Indices of solids as in
/// ArmSolids::pairs.
ArmFunctionPtr MakeSelfClearance(std::shared_ptr<const robot::Model> model, int solid_a, int part_a,
                                 int solid_b, int part_b, double distance);

}  // namespace tether::constraints
