#include "tether/execution/sequencer/plan_runner.h"

#include <algorithm>

#include "tether/control/constrained_velocity.h"

namespace tether::execution {

const std::vector<PlanningRecord>& PlanRunner::plannings() const {
  static const std::vector<PlanningRecord> none;
  return none;
}

const std::vector<std::pair<std::string, std::string>>& PlanRunner::allowed() const {
  static const std::vector<std::pair<std::string, std::string>> none;
  return none;
}

bool PlanRunner::Allows(const std::string& a, const std::string& b) const {
  return std::any_of(allowed().begin(), allowed().end(), [&](const auto& pair) {
    return (pair.first == a && pair.second == b) || (pair.first == b && pair.second == a);
  });
}

const std::vector<control::FieldConstraint>& PlanRunner::verb_fields() const {
  static const std::vector<control::FieldConstraint> none;
  return none;
}

}  // namespace tether::execution
