#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "tether/control/constrained_velocity.h"
#include "tether/robot/kinematics.h"

namespace tether::control {

/// Two bodies that keep a distance: what both constrained controllers make their rows of.
struct ClearancePair {
  int a, b;  ///< Bodies.
  int constraint;
  double distance;  ///< m
  Priority priority;
  bool held;     ///< Only while one of them, an object, is held and the other is not.
  bool allowed;  ///< They may touch.
};

/// The pairs of a clearance, which is constraint number `constraint`.
void AddClearancePairs(const ArmBodies& bodies, const ClearanceConstraint& clearance, int constraint,
                       std::vector<ClearancePair>& pairs);
/// The pairs of the arm's own parts, `distance` apart, m.
void AddSelfPairs(const robot::Model& model, double distance, int constraint,
                  std::vector<ClearancePair>& pairs);

/// How many pairs of parts these are: the most rows.
size_t NumPartPairs(const ArmBodies& bodies, const std::vector<ClearancePair>& pairs);

/// Whether the pair exists while what is held now is held, whether or not it may touch. `dof`: of the arm,
/// whose last link carries the hand.
bool IsPresent(const ArmBodies& bodies, int dof, const ClearancePair& pair);

/// Pairs of bodies that may touch, in place of those before; −1 stands for the held object. Allocates
/// nothing.
void AllowPairs(const ArmBodies& bodies, std::span<const std::pair<int, int>> allowed,
                std::vector<ClearancePair>& pairs);

/// Adds scale · d(n · v)/dq̇ of the point p on a link to a row of n entries. Both in the base frame.
void AddAlong(const robot::Kinematics& kinematics, int link, const Eigen::Vector3d& p,
              const Eigen::Vector3d& n_B, double scale, double* row);

}  // namespace tether::control
