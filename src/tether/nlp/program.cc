#include "tether/nlp/program.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "tether/math/numeric_derivative.h"

namespace tether::nlp {

BlockRef Program::AddPose(std::string name) {
  pose_names_.push_back(std::move(name));
  return {BlockRef::Kind::kPose, num_poses() - 1};
}

BlockRef Program::AddVector(std::string name, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  assert(lower.size() == upper.size() && (lower.array() <= upper.array()).all());
  vectors_.push_back({std::move(name), lower, upper});
  return {BlockRef::Kind::kVector, num_vectors() - 1};
}

void Program::Add(std::shared_ptr<const Residual> residual, Role role) {
  assert(residual != nullptr);
  for (const BlockRef& block : residual->blocks()) {
    const int count = block.kind == BlockRef::Kind::kPose ? num_poses() : num_vectors();
    assert(block.index >= 0 && block.index < count);
    assert(std::count(residual->blocks().begin(), residual->blocks().end(), block) == 1);
    static_cast<void>(count);
  }
  terms_.push_back({std::move(residual), role});
}

const std::string& Program::name(BlockRef block) const {
  const auto index = static_cast<size_t>(block.index);
  return block.kind == BlockRef::Kind::kPose ? pose_names_[index] : vectors_[index].name;
}

int Program::TangentSize(BlockRef block) const {
  if (block.kind == BlockRef::Kind::kPose) return 6;
  return static_cast<int>(vectors_[block.index].lower.size());
}

int Program::num_variables() const { return Offset({BlockRef::Kind::kVector, num_vectors()}); }

int Program::num_rows(Role role) const {
  int rows = 0;
  for (const Term& term : terms_) {
    if (term.role == role) rows += term.residual->size();
  }
  return rows;
}

int Program::Offset(BlockRef block) const {
  if (block.kind == BlockRef::Kind::kPose) return 6 * block.index;
  int offset = 6 * num_poses();
  for (int i = 0; i < block.index; ++i) offset += TangentSize({BlockRef::Kind::kVector, i});
  return offset;
}

Point Retract(const Point& x, const Eigen::VectorXd& delta) {
  Point moved = x;
  int offset = 0;
  for (math::Pose& X : moved.poses) {
    X = X * math::ExpSE3(delta.segment<6>(offset));
    offset += 6;
  }
  for (Eigen::VectorXd& v : moved.vectors) {
    v += delta.segment(offset, v.size());
    offset += static_cast<int>(v.size());
  }
  assert(offset == delta.size());
  return moved;
}

Assessment Assess(const Program& program, const Point& x) {
  Assessment result;
  Eigen::VectorXd r;
  for (const Term& term : program.terms()) {
    const Residual& residual = *term.residual;
    r.resize(residual.size());
    residual.Evaluate(x, r, nullptr);
    if (!r.allFinite() && result.finite) {
      result.finite = false;
      result.not_finite = residual.name();
    }
    if (term.role == Role::kCost) {
      result.cost += r.squaredNorm();
      continue;
    }
    double& largest = residual.unit() == Unit::kMetre    ? result.max_violation_m
                      : residual.unit() == Unit::kRadian ? result.max_violation_rad
                                                         : result.max_violation_other;
    for (int row = 0; row < residual.size(); ++row) {
      const double amount = term.role == Role::kEquality ? std::abs(r[row]) : std::max(r[row], 0.0);
      largest = std::max(largest, amount);
      if (amount > 1e-9) result.violations.push_back({&residual, row, amount});
    }
  }
  for (int i = 0; i < program.num_vectors(); ++i) {
    const Eigen::VectorXd& v = x.vectors[i];
    if (v.size() == 0) continue;
    result.max_bound_violation = std::max(
        {result.max_bound_violation, (program.lower(i) - v).maxCoeff(), (v - program.upper(i)).maxCoeff()});
  }
  std::stable_sort(result.violations.begin(), result.violations.end(),
                   [](const auto& a, const auto& b) { return a.amount > b.amount; });
  return result;
}

double JacobianError(const Residual& residual, const Program& program, const Point& x, double step) {
  int columns = 0;
  for (const BlockRef& block : residual.blocks()) columns += program.TangentSize(block);
  Eigen::VectorXd r(residual.size());
  // Entries that the residual forgets to write stay NaN and make the error NaN.
  Eigen::MatrixXd analytic = Eigen::MatrixXd::Constant(residual.size(), columns, std::nan(""));
  JacobianRef J(analytic);
  residual.Evaluate(x, r, &J);

  const auto along = [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
    Eigen::VectorXd all = Eigen::VectorXd::Zero(program.num_variables());
    int column = 0;
    for (const BlockRef& block : residual.blocks()) {
      const int size = program.TangentSize(block);
      all.segment(program.Offset(block), size) = delta.segment(column, size);
      column += size;
    }
    Eigen::VectorXd value(residual.size());
    residual.Evaluate(Retract(x, all), value, nullptr);
    return value;
  };
  if (analytic.size() == 0) return 0;
  const Eigen::MatrixXd numeric = math::NumericJacobian(along, Eigen::VectorXd::Zero(columns), step);
  const Eigen::MatrixXd difference = (analytic - numeric).cwiseAbs();
  if (!difference.allFinite()) return std::numeric_limits<double>::infinity();
  return difference.maxCoeff() / std::max(1.0, numeric.cwiseAbs().maxCoeff());
}

}  // namespace tether::nlp
