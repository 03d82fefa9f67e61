#include "tether/planning/program/chain_residual.h"

#include <algorithm>
#include <cassert>

namespace tether::planning {
namespace {

using math::Pose;

std::vector<Chain> DropSharedPrefix(std::vector<Chain> chains) {
  for (;;) {
    for (const Chain& chain : chains) {
      if (chain.empty() || chain.front() != chains.front().front()) return chains;
    }
    for (Chain& chain : chains) chain.erase(chain.begin());
  }
}

std::vector<nlp::BlockRef> BlocksOf(const std::vector<Chain>& chains) {
  std::vector<int> variables;
  for (const Chain& chain : chains) {
    for (const ChainLink& link : chain) {
      if (link.variable >= 0) variables.push_back(link.variable);
    }
  }
  std::sort(variables.begin(), variables.end());
  variables.erase(std::unique(variables.begin(), variables.end()), variables.end());
  std::vector<nlp::BlockRef> blocks;
  for (int variable : variables) blocks.push_back({nlp::BlockRef::Kind::kPose, variable});
  return blocks;
}

/// Forces and moments, three columns of `rows` numbers each, from the frame at X to the one it is given in.
void CarryOver(const Pose& X, Eigen::Index rows, double* columns) {
  const Eigen::Matrix3d& R = X.R;
  const Eigen::Vector3d& p = X.p;
  for (double *c = columns, *end = columns + rows; c != end; ++c) {
    const Eigen::Vector3d f = R * Eigen::Vector3d(c[0], c[rows], c[2 * rows]);
    const Eigen::Vector3d m = R * Eigen::Vector3d(c[3 * rows], c[4 * rows], c[5 * rows]) + p.cross(f);
    for (Eigen::Index i = 0; i < 3; ++i) {
      c[i * rows] = f[i];
      c[(i + 3) * rows] = m[i];
    }
  }
}

class ChainResidual final : public nlp::Residual {
 public:
  ChainResidual(std::string name, int step, constraints::PoseFunctionPtr function, FrameChains chains)
      : Residual(std::move(name), step, function->size(), function->unit(), chains.blocks()),
        function_(std::move(function)),
        chains_(std::move(chains)) {
    assert(chains_.num_frames() == function_->num_frames());
  }

  void Evaluate(const nlp::Point& x, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    std::array<Pose, FrameChains::kMostFrames> buffer;
    const std::span<const Pose> poses = chains_.Poses(x, buffer);
    if (J == nullptr) return function_->Evaluate(poses, r, nullptr);
    chains_.WithFrameJacobian(size(), [&](Eigen::Map<Eigen::MatrixXd> J_frames) {
      nlp::JacobianRef all_frames(J_frames);
      function_->Evaluate(poses, r, &all_frames);
      chains_.Carry(x, J_frames, *J);
    });
  }

 private:
  constraints::PoseFunctionPtr function_;
  FrameChains chains_;
};

class ArmResidual final : public nlp::Residual {
 public:
  ArmResidual(std::string name, int step, constraints::ArmFunctionPtr function, FrameChains chains,
              int vector)
      : Residual(std::move(name), step, function->size(), function->unit(),
                 WithVector(chains.blocks(), vector)),
        function_(std::move(function)),
        chains_(std::move(chains)),
        vector_(vector) {
    assert(chains_.num_frames() == function_->num_frames());
  }

  void Evaluate(const nlp::Point& x, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    std::array<Pose, FrameChains::kMostFrames> buffer;
    const std::span<const Pose> poses = chains_.Poses(x, buffer);
    const Eigen::VectorXd& q = x.vectors[ToIndex(vector_)];
    if (J == nullptr) return function_->Evaluate(q, poses, r, nullptr, nullptr);
    chains_.WithFrameJacobian(size(), [&](Eigen::Map<Eigen::MatrixXd> J_frames) {
      nlp::JacobianRef all_frames(J_frames);
      const Eigen::Index columns = 6 * static_cast<Eigen::Index>(chains_.blocks().size());
      nlp::JacobianRef J_q = J->rightCols(function_->dof());
      function_->Evaluate(q, poses, r, &J_q, &all_frames);
      nlp::JacobianRef J_poses = J->leftCols(columns);
      chains_.Carry(x, J_frames, J_poses);
    });
  }

 private:
  static std::vector<nlp::BlockRef> WithVector(std::vector<nlp::BlockRef> blocks, int vector) {
    blocks.push_back({nlp::BlockRef::Kind::kVector, vector});
    return blocks;
  }

  constraints::ArmFunctionPtr function_;
  FrameChains chains_;
  int vector_;
};

}  // namespace

FrameChains::FrameChains(std::vector<Chain> all) {
  const std::vector<Chain> chains = DropSharedPrefix(std::move(all));
  num_frames_ = chains.size();
  assert(num_frames_ <= kMostFrames);
  blocks_ = BlocksOf(chains);
  for (size_t k = 0; k < num_frames_; ++k) {
    Frame& frame = frames_[k];
    frame.first = links_.size();
    frame.first_variable = frame.end = frame.first + chains[k].size();
    for (const ChainLink& link : chains[k]) {
      int column = -1;
      for (size_t b = 0; b < blocks_.size(); ++b) {
        if (blocks_[b].index == link.variable) column = static_cast<int>(6 * b);
      }
      if (column >= 0) frame.first_variable = std::min(frame.first_variable, links_.size());
      links_.push_back({link.variable, link.parameter, column});
    }
  }
}

const Pose& FrameChains::PoseOf(const Link& link, const nlp::Point& x) {
  return link.variable < 0 ? x.parameters[ToIndex(link.parameter)] : x.poses[ToIndex(link.variable)];
}

std::span<const Pose> FrameChains::Poses(const nlp::Point& x, std::array<Pose, kMostFrames>& buffer) const {
  for (size_t k = 0; k < num_frames_; ++k) {
    const Frame& frame = frames_[k];
    if (frame.first == frame.end) continue;
    buffer[k] = PoseOf(links_[frame.first], x);
    for (size_t i = frame.first + 1; i < frame.end; ++i) buffer[k] = buffer[k] * PoseOf(links_[i], x);
  }
  return {buffer.data(), num_frames_};
}

void FrameChains::Carry(const nlp::Point& x, Eigen::Map<Eigen::MatrixXd> J_frames,
                        nlp::JacobianRef& J) const {
  J.setZero();
  const Eigen::Index rows = J_frames.rows();
  for (size_t k = 0; k < num_frames_; ++k) {
    const Frame& frame = frames_[k];
    double* const at_frame = J_frames.data() + 6 * static_cast<Eigen::Index>(k) * rows;
    for (size_t i = frame.end; i-- > frame.first_variable;) {
      const Link& link = links_[i];
      if (link.variable >= 0) {
        for (Eigen::Index column = 0; column < 6; ++column) {
          double* const to = J.data() + (link.column + column) * J.outerStride();
          for (Eigen::Index row = 0; row < rows; ++row) to[row] += at_frame[column * rows + row];
        }
      }
      if (i != frame.first_variable) CarryOver(PoseOf(link, x), rows, at_frame);
    }
  }
}

std::shared_ptr<const nlp::Residual> MakeChainResidual(std::string name, int step,
                                                       constraints::PoseFunctionPtr function,
                                                       std::vector<Chain> chains) {
  return std::make_shared<ChainResidual>(std::move(name), step, std::move(function),
                                         FrameChains(std::move(chains)));
}

std::shared_ptr<const nlp::Residual> MakeArmResidual(std::string name, int step,
                                                     constraints::ArmFunctionPtr function,
                                                     std::vector<Chain> chains, int vector) {
  return std::make_shared<ArmResidual>(std::move(name), step, std::move(function),
                                       FrameChains(std::move(chains)), vector);
}

}  // namespace tether::planning
