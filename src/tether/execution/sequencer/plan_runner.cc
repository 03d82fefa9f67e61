#include "tether/execution/sequencer/plan_runner.h"

#include "tether/control/constrained_velocity.h"

namespace tether::execution {

const std::vector<PlanningRecord>& PlanRunner::plannings() const {
  static const std::vector<PlanningRecord> none;
  return none;
}

const TouchList& PlanRunner::allowed() const {
  static const TouchList none;
  return none;
}

const std::vector<control::FieldConstraint>& PlanRunner::verb_fields() const {
  static const std::vector<control::FieldConstraint> none;
  return none;
}

}  // namespace tether::execution
