#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tether/constraints/core/context.h"
#include "tether/planning/plan/problem.h"
#include "tether/planning/program/frame_tree.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {

/// What all candidates of a problem share: solids by frame name, and the faces that objects stand on.
class SceneFacts {
 public:
  explicit SceneFacts(const Problem& problem);

  const Problem& problem() const { return problem_; }
  const geometry::Shape* ShapeOf(const std::string& frame) const;
  const Eigen::Vector3d& DownFace(const std::string& object) const { return down_.at(object); }
  /// Names of everything solid, the hand last.
  const std::vector<std::string>& solids() const { return solids_; }
  const constraints::Memo& memo() const { return memo_; }

 private:
  const Problem& problem_;
  geometry::Shape hand_;
  std::map<std::string, Eigen::Vector3d> down_;
  std::vector<std::string> solids_;
  constraints::Memo memo_;
};

/// A discrete choice of a program, and its options.
struct ChoicePoint {
  std::string key;
  std::vector<constraints::Option> options;
  int chosen = 0;
  int action = 0;  ///< Index of the action that it belongs to.
};

/// A constraint's view of one step.
class StepContext final : public constraints::Context {
 public:
  using Chooser = std::function<int(const std::string& key, const std::vector<constraints::Option>& options)>;

  StepContext(const SceneFacts& facts, const constraints::Memo& program_memo, const FrameTree& tree,
              const std::vector<math::Pose>& poses, int step, const BoundStep& bound, Chooser chooser);

  int step() const override { return step_; }
  const std::string& control() const override { return control_; }
  const std::string& target() const override { return target_; }
  const scene::Scene& scene() const override { return facts_.problem().scene; }
  const robot::Model* robot() const override { return facts_.problem().robot.model.get(); }
  math::Pose X_WBase() const override { return facts_.problem().robot.X_WBase; }
  const geometry::Shape* ShapeOf(const std::string& frame) const override { return facts_.ShapeOf(frame); }
  math::Pose PoseAt(const constraints::FrameAt& frame) const override {
    return tree_.PoseAt(frame.frame, frame.step, poses_);
  }
  std::string ParentOf(const std::string& object) const override { return tree_.ParentAt(object, step_); }
  Eigen::Vector3d DownFace(const std::string& object) const override;
  const std::string& approach() const override { return approach_; }
  std::optional<double> grip_force(const std::string& object) const override;
  std::optional<double> grip_margin(const std::string& object) const override;
  int Choose(const std::string& key, const std::vector<constraints::Option>& options) const override {
    return chooser_(key, options);
  }
  const constraints::Memo& memo() const override { return facts_.memo(); }
  const constraints::Memo& program_memo() const override { return program_memo_; }

 private:
  const SceneFacts& facts_;
  const constraints::Memo& program_memo_;
  const FrameTree& tree_;
  const std::vector<math::Pose>& poses_;
  const BoundStep& bound_;
  int step_;
  std::string control_, target_, approach_ = "down";
  Chooser chooser_;
};

}  // namespace tether::planning
