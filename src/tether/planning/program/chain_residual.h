#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tether/constraints/core/arm_function.h"
#include "tether/constraints/core/half_space_rows.h"
#include "tether/constraints/core/pose_function.h"
#include "tether/nlp/program.h"
#include "tether/planning/program/frame_tree.h"

namespace tether::planning {

/// The chains of a few frames in the variables of a program. Links that all of them share at their beginning
/// are dropped (the functions over frames don't change when everything moves together), so that a residual
/// depends on no more variables than it must.
class FrameChains {
 public:
  /// The most frames of a function.
  static constexpr size_t kMostFrames = 8;

  explicit FrameChains(std::vector<Chain> chains);

  int num_frames() const { return static_cast<int>(num_frames_); }
  /// The poses that the frames depend on.
  const std::vector<nlp::BlockRef>& blocks() const { return blocks_; }
  /// The frames' poses, in `buffer`.
  std::span<const math::Pose> Poses(const nlp::Point& x, std::array<math::Pose, kMostFrames>& buffer) const;
  /// Calls `use` with a matrix for `rows` rows and the frames' columns: without the heap unless it is large.
  template <typename Use>
  void WithFrameJacobian(int rows, Use use) const {
    const Eigen::Index columns = 6 * static_cast<Eigen::Index>(num_frames_);
    if (rows <= constraints::kMostRows) {
      std::array<double, 6 * kMostFrames * constraints::kMostRows> buffer;  // NOLINT: written by the function
      use(Eigen::Map<Eigen::MatrixXd>(buffer.data(), rows, columns));
    } else {
      Eigen::MatrixXd heap(rows, columns);
      use(Eigen::Map<Eigen::MatrixXd>(heap.data(), rows, columns));
    }
  }
  /// From derivatives in the frames to derivatives in the blocks: each row is, like a force and a moment at
  /// its frame, carried link by link towards the root.
  void Carry(const nlp::Point& x, Eigen::Map<Eigen::MatrixXd> J_frames, nlp::JacobianRef& J) const;

 private:
  struct Link {
    int variable, parameter;  // one of them is −1
    int column;               // of the variable's block in the Jacobian
  };
  struct Frame {
    size_t first, first_variable, end;  // in links_
  };

  static const math::Pose& PoseOf(const Link& link, const nlp::Point& x);

  size_t num_frames_ = 0;
  std::array<Frame, kMostFrames> frames_{};
  std::vector<Link> links_;
  std::vector<nlp::BlockRef> blocks_;
};

/// A pose function over frames of the kinematic tree, as a residual over the steps' variables.
std::shared_ptr<const nlp::Residual> MakeChainResidual(std::string name, int step,
                                                       constraints::PoseFunctionPtr function,
                                                       std::vector<Chain> chains);

/// The same for a function of frames and of the arm's joints, which are the program's vector block `vector`.
std::shared_ptr<const nlp::Residual> MakeArmResidual(std::string name, int step,
                                                     constraints::ArmFunctionPtr function,
                                                     std::vector<Chain> chains, int vector);

}  // namespace tether::planning
