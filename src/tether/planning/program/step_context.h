#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tether/constraints/core/context.h"
#include "tether/constraints/core/memo.h"
#include "tether/constraints/kinds/known.h"
#include "tether/planning/plan/problem.h"
#include "tether/planning/program/frame_tree.h"
#include "tether/planning/skeleton/skeleton_binding.h"

namespace tether::planning {

/// A discrete choice by its key, and the option chosen; the best one where a key is missing.
using Variant = std::map<constraints::ChoiceKey, int>;

/// What all candidates of a problem share: its frames, their solids, and the faces that objects stand on.
class SceneFacts {
 public:
  explicit SceneFacts(const Problem& problem);

  const Problem& problem() const { return problem_; }
  const scene::Frames& frames() const { return *frames_; }
  const std::shared_ptr<const scene::Frames>& shared_frames() const { return frames_; }
  FrameId hand() const { return frames_->hand(); }
  const std::string& Name(FrameId frame) const { return frames_->Name(frame); }
  /// Of the acting robot's base.
  FrameId base() const { return base_; }
  /// What the hand holds at the start; not valid if it holds nothing.
  FrameId holds() const { return holds_; }
  /// Null where nothing is solid.
  const geometry::Shape* ShapeOf(FrameId frame) const;
  /// Of an object; straight down where there is none.
  Eigen::Vector3d DownFace(FrameId frame) const {
    const ObjectId object = frames_->ObjectOf(frame);
    return object.valid() ? down_[object] : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
  }
  /// Everything solid, the hand last.
  const std::vector<FrameId>& solids() const { return solids_; }
  const constraints::KnownOfScene& known() const { return known_; }

  /// Key poses of the first actions with certain choices; empty: none were found.
  using Beginnings = constraints::Memo<std::pair<std::vector<std::string>, Variant>, std::vector<math::Pose>>;
  const Beginnings& beginnings() const { return beginnings_; }

 private:
  const Problem& problem_;
  geometry::Shape hand_;
  std::shared_ptr<const scene::Frames> frames_;
  FrameId base_, holds_;
  IndexedVector<ObjectId, Eigen::Vector3d> down_;
  std::vector<FrameId> solids_;
  constraints::KnownOfScene known_;
  Beginnings beginnings_;
};

/// A discrete choice of a program, and its options.
struct ChoicePoint {
  constraints::ChoiceKey key;
  std::vector<constraints::Option> options;
  int chosen = 0;
  int action = 0;  ///< Index of the action that it belongs to.
};

/// A constraint's view of one step.
class StepContext final : public constraints::Context {
 public:
  using Chooser =
      std::function<int(const constraints::ChoiceKey& key, const std::vector<constraints::Option>& options)>;

  StepContext(const SceneFacts& facts, const constraints::KnownOfProgram& known, const FrameTree& tree,
              const std::vector<math::Pose>& poses, int step, const BoundStep& bound, Chooser chooser);

  int step() const override { return step_; }
  FrameId control() const override { return bound_.control; }
  FrameId target() const override { return bound_.target; }
  const scene::Scene& scene() const override { return facts_.problem().scene; }
  const scene::Frames& frames() const override { return facts_.frames(); }
  const robot::Model* robot() const override { return facts_.problem().robot.model.get(); }
  math::Pose X_WBase() const override { return facts_.problem().robot.X_WBase; }
  const geometry::Shape* ShapeOf(FrameId frame) const override { return facts_.ShapeOf(frame); }
  math::Pose PoseAt(const constraints::FrameAt& frame) const override {
    return tree_.PoseAt(frame.frame, frame.step, poses_);
  }
  FrameId ParentOf(FrameId object) const override { return tree_.ParentAt(object, step_); }
  Eigen::Vector3d DownFace(FrameId object) const override;
  const std::string& approach() const override { return approach_; }
  std::optional<double> grip_force(FrameId object) const override;
  std::optional<double> grip_margin(FrameId object) const override;
  int Choose(const constraints::ChoiceKey& key,
             const std::vector<constraints::Option>& options) const override {
    return chooser_(key, options);
  }
  const constraints::KnownOfScene& known() const override { return facts_.known(); }
  const constraints::KnownOfProgram& known_of_program() const override { return known_; }

 private:
  const SceneFacts& facts_;
  const constraints::KnownOfProgram& known_;
  const FrameTree& tree_;
  const std::vector<math::Pose>& poses_;
  const BoundStep& bound_;
  int step_;
  std::string approach_ = "down";
  Chooser chooser_;
};

}  // namespace tether::planning
