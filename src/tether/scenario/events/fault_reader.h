#pragma once

#include <string>

#include "tether/common/document/value.h"
#include "tether/robot/fault.h"
#include "tether/scenario/events.h"

namespace tether::scenario {

/// Reads an event's `fault`: {kind: silence, robot: panda, over: 0.1}. Mistakes go to `diagnostics`.
class FaultParser {
 public:
  FaultParser(const EventNames& names, Diagnostics& diagnostics) : names_(names), diagnostics_(diagnostics) {}

  robot::Fault Parse(const Value& value);

 private:
  void ReadRobot(const Value& value, robot::Fault& fault);
  void ReadObject(const Value& value, robot::Fault& fault);
  int ReadJoint(const Value& value, const robot::Fault& fault);

  const EventNames& names_;
  Diagnostics& diagnostics_;
};

/// "fault of panda: silence for 0.1 s".
std::string DescribeFault(const robot::Fault& fault);

}  // namespace tether::scenario
