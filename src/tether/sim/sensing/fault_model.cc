#include "tether/sim/sensing/fault_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tether::sim {
namespace {

using Kind = robot::Fault::Kind;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void DistortRobot(const robot::Fault& fault, const robot::Observations& before, robot::Observation* seen) {
  switch (fault.kind) {
    case Kind::kSilence:
      *seen = before.at(fault.robot);
      return;
    case Kind::kNotFinite:
      seen->q.setConstant(kNan);
      seen->v.setConstant(kNan);
      return;
    case Kind::kClock:
      seen->time += fault.by;
      return;
    case Kind::kEncoder:
      seen->q[fault.joint] += fault.by;
      return;
    case Kind::kGripper:
      return;
  }
}

void DistortPoses(const robot::Fault& fault, const scene::WorldEstimate& before,
                  scene::WorldEstimate* estimate) {
  if (fault.kind == Kind::kClock) {
    estimate->time += fault.by;
    return;
  }
  if (fault.object.empty()) {
    if (fault.kind == Kind::kSilence) *estimate = before;
    return;
  }
  if (fault.kind == Kind::kSilence) {
    estimate->X_WO.erase(fault.object);
  } else if (const auto found = estimate->X_WO.find(fault.object); found != estimate->X_WO.end()) {
    found->second.p.setConstant(kNan);
  }
}

}  // namespace

void FaultModel::Start(const robot::Fault& fault, double time, const scene::WorldEstimate& estimate,
                       const robot::Observations& observations, const robot::Commands& commands) {
  faults_.push_back({fault, time, estimate, observations, commands});
}

bool FaultModel::active(double time) const {
  return std::any_of(faults_.begin(), faults_.end(), [&](const Active& one) { return one.holds(time); });
}

void FaultModel::Distort(double time, scene::WorldEstimate* estimate,
                         robot::Observations* observations) const {
  for (const Active& one : faults_) {
    if (!one.holds(time)) continue;
    if (one.fault.robot.empty()) {
      DistortPoses(one.fault, one.estimate, estimate);
    } else {
      DistortRobot(one.fault, one.observations, &observations->at(one.fault.robot));
    }
  }
}

void FaultModel::Distort(double time, robot::Commands* commands) const {
  for (const Active& one : faults_) {
    if (!one.holds(time) || one.fault.kind != Kind::kGripper) continue;
    commands->at(one.fault.robot).gripper = one.commands.at(one.fault.robot).gripper;
  }
}

}  // namespace tether::sim
