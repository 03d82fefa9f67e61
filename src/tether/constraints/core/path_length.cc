#include "tether/constraints/core/path_length.h"

#include <cmath>
#include <utility>

namespace tether::constraints {
namespace {

constexpr double kTip = 1e-3;

class RootOfLength final : public PoseFunction {
 public:
  explicit RootOfLength(PoseFunctionPtr f)
      : PoseFunction(f->size(), f->num_frames(), f->unit()), f_(std::move(f)) {}

  void Evaluate(std::span<const math::Pose> X, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    f_->Evaluate(X, r, J);
    const double s = r.squaredNorm() + kTip * kTip;
    const double scale = std::pow(s, -0.25);
    if (J != nullptr) {
      for (Eigen::Index column = 0; column < J->cols(); ++column) {
        const double along = r.dot(J->col(column)) / (2 * s);
        J->col(column) = scale * (J->col(column) - along * r);
      }
    }
    r *= scale;
  }

 private:
  PoseFunctionPtr f_;
};

}  // namespace

PoseFunctionPtr MakeRootOfLength(PoseFunctionPtr f) { return std::make_shared<RootOfLength>(std::move(f)); }

}  // namespace tether::constraints
