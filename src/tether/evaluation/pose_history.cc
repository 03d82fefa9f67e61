#include "tether/evaluation/pose_history.h"

#include <algorithm>

namespace tether::evaluation {
namespace {

constexpr double kPeriod = 0.01;  // s
constexpr double kInstant = 1e-9;

}  // namespace

void PoseHistory::Add(double time, const std::map<std::string, math::Pose>& X_WO) {
  if (!samples_.empty() && time < samples_.back().first + kPeriod - kInstant) return;
  if (samples_.size() < 2 || samples_[1].first > time - kRestWindow - kInstant) {
    samples_.emplace_back();
  } else {
    // The oldest is no longer needed: its memory is used again.
    std::rotate(samples_.begin(), samples_.begin() + 1, samples_.end());
  }
  samples_.back() = {time, X_WO};
}

std::map<std::string, math::Pose> PoseHistory::Before(double time) const {
  const std::map<std::string, math::Pose>* before = nullptr;
  for (const auto& [when, X_WO] : samples_) {
    if (before == nullptr || when <= time - kRestWindow + kInstant) before = &X_WO;
  }
  return before == nullptr ? std::map<std::string, math::Pose>() : *before;
}

}  // namespace tether::evaluation
