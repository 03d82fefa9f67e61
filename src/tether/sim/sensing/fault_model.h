#pragma once

#include <vector>

#include "tether/robot/fault.h"
#include "tether/robot/interface.h"
#include "tether/scene/scene.h"

namespace tether::sim {

/// Faults that are simulated: what they make of measurements on their way to the executive, and of commands
/// on their way to the robots. Deterministic.
class FaultModel {
 public:
  /// The fault begins at `time` (s) and is seen from the next Distort() on; what was seen last, and what the
  /// robots were told last, is what stays.
  void Start(const robot::Fault& fault, double time, const scene::WorldEstimate& estimate,
             const robot::Observations& observations, const robot::Commands& commands);
  /// Whether any fault is there at this time, s.
  bool active(double time) const;
  void Distort(double time, scene::WorldEstimate* estimate, robot::Observations* observations) const;
  void Distort(double time, robot::Commands* commands) const;

 private:
  struct Active {
    robot::Fault fault;
    double begin = 0;
    scene::WorldEstimate estimate;
    robot::Observations observations;
    robot::Commands commands;
    bool holds(double time) const { return time < begin + fault.over; }
  };
  std::vector<Active> faults_;
};

}  // namespace tether::sim
