#include "tether/execution/sequencer/sequencer_options.h"

#include <cmath>

#include "tether/common/document/value.h"

namespace tether::execution {

void CheckPositive(const char* name, double value, Diagnostics* diagnostics) {
  if (std::isfinite(value) && value > 0) return;
  diagnostics->Add({}, std::string("execution option '") + name + "' is " + Value(value).AsText(),
                   "a finite number above 0");
}

void SequencerOptions::Check(Diagnostics* diagnostics) const {
  const auto check = [&](const char* name, double value) { CheckPositive(name, value, diagnostics); };
  check("period", period);
  check("least_width", least_width);
  check("slip_distance", slip_distance);
  check("slip_angle", slip_angle);
  check("lost_time", lost_time);
  check("stall_time", stall_time);
  check("verb_timeout", verb_timeout);
  check("faults.silence", faults.silence);
  check("faults.pose_silence", faults.pose_silence);
  check("faults.steady", faults.steady);
  check("faults.lasting", faults.lasting);
  if (max_retries < 0) diagnostics->Add({}, "execution option 'max_retries' is negative", "0 or more");
}

}  // namespace tether::execution
