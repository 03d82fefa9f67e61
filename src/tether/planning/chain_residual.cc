#include "tether/planning/chain_residual.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace tether::planning {
namespace {

using math::Pose;

// No pose function takes more frames than this.
constexpr size_t kMostFrames = 4;

bool SameLink(const ChainLink& a, const ChainLink& b) {
  return a.variable == b.variable && (a.variable >= 0 || (a.X.R == b.X.R && a.X.p == b.X.p));
}

std::vector<Chain> DropSharedBeginning(std::vector<Chain> chains) {
  for (;;) {
    for (const Chain& chain : chains) {
      if (chain.empty() || !SameLink(chain.front(), chains.front().front())) return chains;
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
  ChainResidual(std::string name, int step, constraints::PoseFunctionPtr function, std::vector<Chain> chains)
      : Residual(std::move(name), step, function->size(), function->unit(), BlocksOf(chains)),
        function_(std::move(function)),
        chains_(std::move(chains)) {
    assert(chains_.size() == static_cast<size_t>(function_->num_frames()) && chains_.size() <= kMostFrames);
    for (const Chain& chain : chains_) {
      std::vector<int>& columns = columns_.emplace_back();
      for (const ChainLink& link : chain) {
        int column = -1;
        for (size_t k = 0; k < blocks().size(); ++k) {
          if (blocks()[k].index == link.variable) column = static_cast<int>(6 * k);
        }
        columns.push_back(column);
      }
    }
  }

  void Evaluate(const nlp::Point& x, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    std::array<Pose, kMostFrames> poses;
    for (size_t k = 0; k < chains_.size(); ++k) {
      for (const ChainLink& link : chains_[k]) {
        poses[k] = poses[k] * (link.variable < 0 ? link.X : x.poses[static_cast<size_t>(link.variable)]);
      }
    }
    const std::span<const Pose> span(poses.data(), chains_.size());
    if (J == nullptr) return function_->Evaluate(span, r, nullptr);

    Eigen::MatrixXd J_frames(size(), 6 * static_cast<Eigen::Index>(chains_.size()));
    nlp::JacobianRef J_ref(J_frames);
    function_->Evaluate(span, r, &J_ref);
    J->setZero();
    for (size_t k = 0; k < chains_.size(); ++k) {
      // From the frame back to the root: a link's perturbation reaches the frame through what hangs below the
      // link.
      Pose below;
      for (size_t i = chains_[k].size(); i-- > 0;) {
        const ChainLink& link = chains_[k][i];
        if (link.variable >= 0) {
          J->middleCols<6>(columns_[k][i]).noalias() +=
              J_frames.middleCols<6>(6 * static_cast<Eigen::Index>(k)) * math::AdjointInverse(below);
        }
        if (i > 0) below = (link.variable < 0 ? link.X : x.poses[static_cast<size_t>(link.variable)]) * below;
      }
    }
  }

 private:
  constraints::PoseFunctionPtr function_;
  std::vector<Chain> chains_;
  std::vector<std::vector<int>> columns_;  // first column of each link's block; −1 for constants
};

}  // namespace

std::shared_ptr<const nlp::Residual> MakeChainResidual(std::string name, int step,
                                                       constraints::PoseFunctionPtr function,
                                                       std::vector<Chain> chains) {
  return std::make_shared<ChainResidual>(std::move(name), step, std::move(function),
                                         DropSharedBeginning(std::move(chains)));
}

}  // namespace tether::planning
