#include "tether/control/torque/contact_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

namespace tether::control {
namespace {

// Slopes shorter than this tell no force, m/rad.
constexpr double kShortLever = 0.02;
// A pair that is near and leaves less than this share of the torques' square unexplained is the likely one …
constexpr double kExplained = 0.4;
// … and so is one of which a force on the hand, which has three directions, leaves more than this share.
constexpr double kMuchBetter = 0.25;
constexpr double kRegular = 1e-4;

}  // namespace

ContactWatch::ContactWatch(int dof, const ContactOptions& options)
    : options_(options),
      filtered_(Eigen::VectorXd::Zero(dof)),
      slope_(Eigen::VectorXd::Zero(dof)),
      left_(Eigen::VectorXd::Zero(dof)) {}

void ContactWatch::Reset() {
  contact_ = {};
  filtered_.setZero();
  above_ = below_ = 0;
  candidate_ = -1;
}

void ContactWatch::Explain(const std::vector<ContactCandidate>& candidates, int count,
                           const Eigen::MatrixXd& J_BH) {
  const Eigen::Index n = filtered_.size();
  const double all = filtered_.squaredNorm();
  double best = std::numeric_limits<double>::infinity();
  candidate_ = -1;
  contact_.force = 0;
  for (int i = 0; i < count; ++i) {
    const ContactCandidate& c = candidates[static_cast<size_t>(i)];
    const Eigen::Map<const Eigen::VectorXd> slope(c.slope, n);
    const double length = slope.squaredNorm();
    if (length < kShortLever * kShortLever) continue;
    const double force = slope.dot(filtered_) / length;
    if (force <= 0) continue;
    const double left = all - force * force * length;
    if (left >= best) continue;
    best = left;
    candidate_ = i;
    contact_.force = force;
  }
  // The force on the hand that explains the torques best.
  Eigen::Matrix3d JJt;
  JJt.noalias() = J_BH.topRows<3>() * J_BH.topRows<3>().transpose();
  JJt.diagonal().array() += kRegular;
  const Eigen::Vector3d force = JJt.ldlt().solve(Eigen::Vector3d(J_BH.topRows<3>() * filtered_));
  left_.noalias() = filtered_ - J_BH.topRows<3>().transpose() * force;
  if (candidate_ >= 0 && (best <= kExplained * all || left_.squaredNorm() >= kMuchBetter * best)) {
    const ContactCandidate& c = candidates[static_cast<size_t>(candidate_)];
    slope_ = Eigen::Map<const Eigen::VectorXd>(c.slope, n);
    return;
  }
  // Something allowed that is near explains a force on the hand in any direction: friction, and what is held.
  const bool near_allowed = candidate_ >= 0 && candidates[static_cast<size_t>(candidate_)].allowed;
  if (!near_allowed) candidate_ = -1;
  contact_.force = force.norm();
  if (contact_.force > 0) slope_.noalias() = J_BH.topRows<3>().transpose() * (force / contact_.force);
}

void ContactWatch::Update(const std::vector<ContactCandidate>& candidates, int count,
                          const Eigen::VectorXd& unexplained, const Eigen::MatrixXd& J_BH, double tolerance,
                          double allowed_force, double period) {
  contact_.began = false;
  if (!unexplained.allFinite()) return;
  filtered_ += std::min(1.0, period / options_.filter) * (unexplained - filtered_);
  Explain(candidates, count, J_BH);
  bool allowed = false;
  for (int i = 0; i < count && candidate_ < 0; ++i) {
    allowed = allowed || candidates[static_cast<size_t>(i)].allowed;
  }
  if (candidate_ >= 0) allowed = candidates[static_cast<size_t>(candidate_)].allowed;
  const double threshold = allowed ? std::max(allowed_force, options_.threshold) : options_.threshold;
  above_ = contact_.force > threshold + tolerance ? above_ + period : 0;
  below_ = contact_.force < options_.released + tolerance ? below_ + period : 0;
  if (contact_.active) {
    contact_.most = std::max(contact_.most, contact_.force);
    if (below_ > options_.released_for) contact_.active = false;
    return;
  }
  if (above_ < options_.hold) return;
  contact_.active = contact_.began = true;
  contact_.intended = allowed;
  contact_.most = contact_.force;
  contact_.a = candidate_ >= 0 ? candidates[static_cast<size_t>(candidate_)].a : -1;
  contact_.b = candidate_ >= 0 ? candidates[static_cast<size_t>(candidate_)].b : -1;
}

}  // namespace tether::control
