#pragma once

#include <vector>

#include <Eigen/Core>

namespace tether::control {

struct ContactOptions {
  double threshold = 10;       ///< Of a force that no step intends, N.
  double hold = 0.003;         ///< It must be there for so long, s.
  double filter = 0.002;       ///< Time constant of the torques' filter, s.
  double touch = 0.01;         ///< Bodies nearer than this may touch, m.
  double released = 3;         ///< Below this force the contact is over, N …
  double released_for = 0.06;  ///< … once it has lasted so long, s.
  double retreat = 0.05;       ///< Speed at which the arm backs off, m/s …
  double yield = 0.002;        ///< … and what a force adds to it, m/s/N.
};

/// A force between two bodies, told from joint torques.
struct Contact {
  bool active = false;    ///< It was not intended, or too large; the arm is to back off.
  bool began = false;     ///< In this tick.
  bool intended = false;  ///< The pair may touch, but presses with more than is allowed.
  int a = -1, b = -1;  ///< The likely pair, as in ArmBodies; −1: nothing known is near, the hand is meant.
  double force = 0;    ///< N
  double most = 0;     ///< Since it began, N.
};

/// A pair that is near enough to touch: a force f apart is felt as torques f · slope.
struct ContactCandidate {
  int row = 0;
  int a = -1, b = -1;
  bool allowed = false;
  double gap = 0;                 ///< m
  const double* slope = nullptr;  ///< n: the derivative of the distance in q, m/rad.
};

/// Tells contacts from the torques that the model does not explain: of the pairs that are near, the one
/// whose force explains them best; of none, a force on the hand.
class ContactWatch {
 public:
  ContactWatch(int dof, const ContactOptions& options);
  void Reset();
  /// `unexplained`: n, Nm; `J_BH`: 6 × n of the hand. `tolerance` (N) is added to the threshold; pairs that
  /// may touch count from `allowed_force` (N). Allocates nothing.
  void Update(const std::vector<ContactCandidate>& candidates, int count, const Eigen::VectorXd& unexplained,
              const Eigen::MatrixXd& J_BH, double tolerance, double allowed_force, double period);
  const Contact& contact() const { return contact_; }
  /// n, Nm: the unexplained torques, filtered.
  const Eigen::VectorXd& felt() const { return filtered_; }
  /// The candidate that the force was told from in the last update; −1: the hand.
  int candidate() const { return candidate_; }
  /// n: the derivative in q of the distance at the contact, m/rad.
  const Eigen::VectorXd& slope() const { return slope_; }

 private:
  void Explain(const std::vector<ContactCandidate>& candidates, int count, const Eigen::MatrixXd& J_BH);

  ContactOptions options_;
  Contact contact_;
  Eigen::VectorXd filtered_, slope_, left_;
  int candidate_ = -1;
  double above_ = 0, below_ = 0;
};

}  // namespace tether::control
