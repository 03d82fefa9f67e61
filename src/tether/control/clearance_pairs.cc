#include "tether/control/clearance_pairs.h"

#include <algorithm>

namespace tether::control {

void AddClearancePairs(const ArmBodies& bodies, const ClearanceConstraint& clearance, int constraint,
                       std::vector<ClearancePair>& pairs) {
  for (const int object : clearance.to) {
    const int b = bodies.object(object);
    for (const int a : clearance.of) {
      if (bodies.link(a) == 0) continue;
      pairs.push_back({a, b, constraint, clearance.distance, clearance.priority, false, false});
    }
    if (!clearance.held) continue;
    for (int other = bodies.hand() + 1; other < bodies.num_bodies(); ++other) {
      if (other != b)
        pairs.push_back({other, b, constraint, clearance.distance, clearance.priority, true, false});
    }
  }
}

void AddSelfPairs(const robot::Model& model, double distance, int constraint,
                  std::vector<ClearancePair>& pairs) {
  for (const auto& [a, b] : model.solids().pairs)
    pairs.push_back({a, b, constraint, distance, 0, false, false});
}

size_t NumPartPairs(const ArmBodies& bodies, const std::vector<ClearancePair>& pairs) {
  size_t number = 0;
  for (const ClearancePair& pair : pairs)
    number += static_cast<size_t>(bodies.max_parts(pair.a)) * static_cast<size_t>(bodies.max_parts(pair.b));
  return number;
}

bool IsPresent(const ArmBodies& bodies, int dof, const ClearancePair& pair) {
  const int held = bodies.held() < 0 ? -1 : bodies.object(bodies.held());
  if (pair.held) return pair.a == held;
  // The hand touches what it holds; the links keep their distance from it as from everything else.
  return !(pair.b == held && bodies.link(pair.a) == dof);
}

void AllowPairs(const ArmBodies& bodies, std::span<const std::pair<int, int>> allowed,
                std::vector<ClearancePair>& pairs) {
  const int held = bodies.held() < 0 ? -1 : bodies.object(bodies.held());
  const auto body = [held](int given) { return given < 0 ? held : given; };
  for (ClearancePair& pair : pairs) {
    pair.allowed = std::any_of(allowed.begin(), allowed.end(), [&](const std::pair<int, int>& one) {
      const int a = body(one.first), b = body(one.second);
      return (a == pair.a && b == pair.b) || (b == pair.a && a == pair.b);
    });
  }
}

void AddAlong(const robot::Kinematics& kinematics, int link, const Eigen::Vector3d& p,
              const Eigen::Vector3d& n_B, double scale, double* row) {
  for (int i = 0; i < link; ++i) {
    const math::Pose& X_BJ = kinematics.X_BL(i + 1);
    row[i] += scale * X_BJ.R.col(2).dot((p - X_BJ.p).cross(n_B));
  }
}

}  // namespace tether::control
