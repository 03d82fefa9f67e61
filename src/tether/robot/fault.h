#pragma once

#include <limits>
#include <string>

namespace tether::robot {

/// A fault of a robot's sensors, its clock or its gripper, or of the measured poses of objects, in
/// simulation.
struct Fault {
  enum class Kind {
    kSilence,    ///< Nothing is measured: what was measured last stays.
    kNotFinite,  ///< What is measured is not a number.
    kClock,      ///< The clock is off by `by`, s.
    kEncoder,    ///< The measured position of a joint is off by `by`, rad.
    kGripper,    ///< The gripper goes on with what it was told last.
  };
  Kind kind = Kind::kSilence;
  std::string robot;   ///< Whose sensors, clock or gripper; empty: the poses of objects …
  std::string object;  ///< … of this one, or, if empty, of all.
  int joint = -1;      ///< With kEncoder.
  double by = 0;       ///< s or rad
  double over = std::numeric_limits<double>::infinity();  ///< s
};

}  // namespace tether::robot
