#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tether/execution/sequencer/plan_runner.h"
#include "tether/scenario/events.h"
#include "tether/sim/world.h"

namespace tether::evaluation {

/// Does to a simulated world what the events of a run ask for, each once, at its moment.
class Disturber {
 public:
  /// Random moments are drawn from the seed. The world and the scene must outlive the disturber.
  Disturber(const scene::Scene& scene, std::vector<scenario::Event> events, uint64_t seed, sim::World& world);

  /// What has just begun or ended, of the plan that runs.
  struct Moment {
    std::vector<std::string> started, ended;  ///< Actions.
    std::vector<int> steps;                   ///< Steps that started.
  };
  /// Begins what is due, and returns it. What is held is pulled where a pull names no object.
  std::vector<const scenario::Event*> Disturb(const Moment& moment, const scene::WorldEstimate& truth,
                                              const std::string& held);

  /// Objects that are not there now.
  const std::vector<std::string>& removed() const { return removed_; }
  /// Events that have not happened, each with the reason.
  std::vector<std::string> Missed() const;

 private:
  struct Entry {
    scenario::Event event;
    double due = -1;  ///< s; −1: not known yet.
    bool done = false;
  };
  void Begin(const scenario::Event& event, const scene::WorldEstimate& truth, const std::string& held);
  math::Pose Goal(const scenario::Event& event, const scene::WorldEstimate& truth) const;

  const scene::Scene& scene_;
  std::vector<Entry> entries_;
  sim::World& world_;
  std::vector<std::string> removed_;
  std::map<std::string, math::Pose> before_;  ///< Where removed objects were.
};

}  // namespace tether::evaluation
