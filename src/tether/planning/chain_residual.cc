#include "tether/planning/chain_residual.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "tether/constraints/half_space_rows.h"

namespace tether::planning {
namespace {

using math::Pose;

// No pose function takes more frames than this.
constexpr size_t kMostFrames = 4;

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
  ChainResidual(std::string name, int step, constraints::PoseFunctionPtr function,
                const std::vector<Chain>& chains)
      : Residual(std::move(name), step, function->size(), function->unit(), BlocksOf(chains)),
        function_(std::move(function)),
        num_frames_(chains.size()) {
    assert(num_frames_ == static_cast<size_t>(function_->num_frames()) && num_frames_ <= kMostFrames);
    for (size_t k = 0; k < num_frames_; ++k) {
      Frame& frame = frames_[k];
      frame.first = links_.size();
      frame.first_variable = frame.end = frame.first + chains[k].size();
      for (const ChainLink& link : chains[k]) {
        int column = -1;
        for (size_t b = 0; b < blocks().size(); ++b) {
          if (blocks()[b].index == link.variable) column = static_cast<int>(6 * b);
        }
        if (column >= 0) frame.first_variable = std::min(frame.first_variable, links_.size());
        links_.push_back({link.variable, link.parameter, column});
      }
    }
  }

  void Evaluate(const nlp::Point& x, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    std::array<Pose, kMostFrames> poses;
    for (size_t k = 0; k < num_frames_; ++k) {
      const Frame& frame = frames_[k];
      if (frame.first == frame.end) continue;
      poses[k] = PoseOf(links_[frame.first], x);
      for (size_t i = frame.first + 1; i < frame.end; ++i) poses[k] = poses[k] * PoseOf(links_[i], x);
    }
    const std::span<const Pose> span(poses.data(), num_frames_);
    if (J == nullptr) return function_->Evaluate(span, r, nullptr);

    const Eigen::Index columns = 6 * static_cast<Eigen::Index>(num_frames_);
    if (size() <= constraints::kMostRows) {
      std::array<double, 6 * kMostFrames * constraints::kMostRows> buffer;  // NOLINT: written by the function
      ChainRows(x, span, r, Eigen::Map<Eigen::MatrixXd>(buffer.data(), size(), columns), *J);
    } else {
      Eigen::MatrixXd heap(size(), columns);
      ChainRows(x, span, r, Eigen::Map<Eigen::MatrixXd>(heap.data(), size(), columns), *J);
    }
  }

 private:
  struct Link {
    int variable, parameter;  // one of them is −1
    int column;               // of the variable's block in the Jacobian
  };
  struct Frame {
    size_t first, first_variable, end;  // in links_
  };

  static const Pose& PoseOf(const Link& link, const nlp::Point& x) {
    return link.variable < 0 ? x.parameters[static_cast<size_t>(link.parameter)]
                             : x.poses[static_cast<size_t>(link.variable)];
  }

  /// Each row of J_frames is, like a force and a moment at its frame, carried link by link towards the root;
  /// all rows at once, where they are.
  void ChainRows(const nlp::Point& x, std::span<const Pose> poses, nlp::VectorRef& r,
                 Eigen::Map<Eigen::MatrixXd> J_frames, nlp::JacobianRef& J) const {
    nlp::JacobianRef all_frames(J_frames);
    function_->Evaluate(poses, r, &all_frames);
    J.setZero();
    const Eigen::Index rows = size();
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

  /// Forces and moments, three columns of `rows` numbers each, from the frame at X to the one it is given in.
  static void CarryOver(const Pose& X, Eigen::Index rows, double* columns) {
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

  constraints::PoseFunctionPtr function_;
  size_t num_frames_;
  std::array<Frame, kMostFrames> frames_{};
  std::vector<Link> links_;
};

}  // namespace

std::shared_ptr<const nlp::Residual> MakeChainResidual(std::string name, int step,
                                                       constraints::PoseFunctionPtr function,
                                                       std::vector<Chain> chains) {
  return std::make_shared<ChainResidual>(std::move(name), step, std::move(function),
                                         DropSharedBeginning(std::move(chains)));
}

}  // namespace tether::planning
