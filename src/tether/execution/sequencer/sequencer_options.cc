#include "tether/execution/sequencer/sequencer_options.h"

#include "tether/common/document/option_check.h"

namespace tether::execution {

void SequencerOptions::Check(Diagnostics* diagnostics) const {
  const OptionCheck check("execution", diagnostics);
  check.Positive("period", period);
  check.Positive("least_width", least_width);
  check.Positive("slip_distance", slip_distance);
  check.Positive("slip_angle", slip_angle);
  check.Positive("lost_time", lost_time);
  check.Positive("stall_time", stall_time);
  check.Positive("verb_timeout", verb_timeout);
  check.NotNegative("max_retries", max_retries);
  check.Positive("faults.silence", faults.silence);
  check.Positive("faults.pose_silence", faults.pose_silence);
  check.Positive("faults.steady", faults.steady);
  check.Positive("faults.lasting", faults.lasting);
}

}  // namespace tether::execution
