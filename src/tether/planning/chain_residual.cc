#include "tether/planning/chain_residual.h"

#include <algorithm>
#include <cassert>

namespace tether::planning {
namespace {

using math::Pose;

std::vector<Chain> DropSharedBeginning(std::vector<Chain> chains) {
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
    chains_.WithFrameJacobian(size(), [&](nlp::JacobianRef J_frames) {
      function_->Evaluate(poses, r, &J_frames);
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
    const Eigen::VectorXd& q = x.vectors[static_cast<size_t>(vector_)];
    if (J == nullptr) return function_->Evaluate(q, poses, r, nullptr, nullptr);
    chains_.WithFrameJacobian(size(), [&](nlp::JacobianRef J_frames) {
      const Eigen::Index columns = 6 * static_cast<Eigen::Index>(chains_.blocks().size());
      nlp::JacobianRef J_q = J->rightCols(function_->dof());
      function_->Evaluate(q, poses, r, &J_q, &J_frames);
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
  const std::vector<Chain> chains = DropSharedBeginning(std::move(all));
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
  return link.variable < 0 ? x.parameters[static_cast<size_t>(link.parameter)]
                           : x.poses[static_cast<size_t>(link.variable)];
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

void FrameChains::Carry(const nlp::Point& x, const nlp::JacobianRef& J_frames, nlp::JacobianRef& J) const {
  J.setZero();
  for (size_t k = 0; k < num_frames_; ++k) {
    const Frame& frame = frames_[k];
    for (int row = 0; row < J.rows(); ++row) {
      Eigen::Vector3d force = J_frames.block<1, 3>(row, 6 * static_cast<Eigen::Index>(k)).transpose();
      Eigen::Vector3d moment = J_frames.block<1, 3>(row, 6 * static_cast<Eigen::Index>(k) + 3).transpose();
      for (size_t i = frame.end; i-- > frame.first_variable;) {
        const Link& link = links_[i];
        if (link.variable >= 0) {
          J.block<1, 3>(row, link.column) += force.transpose();
          J.block<1, 3>(row, link.column + 3) += moment.transpose();
        }
        if (i == frame.first_variable) break;
        const Pose& X = PoseOf(link, x);
        force = X.R * force;
        moment = X.R * moment + X.p.cross(force);
      }
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
