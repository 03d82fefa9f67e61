#include "testing/evaluation/run_plan.h"

#include <cstdio>
#include <map>
#include <memory>

namespace tether::execution {

int RunResult::Count(EventKind kind) const {
  int count = 0;
  for (const Event& event : events) count += event.kind == kind;
  return count;
}

std::string RunResult::Log() const {
  std::string log;
  for (const Event& event : events) {
    char line[256];
    std::snprintf(line, sizeof line, "%8.3f s  step %d  %-16s %s\n", event.time, event.step,
                  std::string(ToString(event.kind)).c_str(), event.text.c_str());
    log += line;
  }
  return log;
}

ExecutiveOptions DefaultOptions() {
  ExecutiveOptions options;
  options.constrained = true;
  return options;
}

RunResult RunPlan(const scene::Scene& scene, const planning::Plan& plan, const Disturbance& disturb,
                  const ExecutiveOptions& options, double limit) {
  static const auto panda = robot::Model::Load("panda");
  const std::map<std::string, std::shared_ptr<const robot::Model>> models{{"panda", panda}};
  sim::World world(scene, models);
  Executive executive(scene, models, plan, options);
  robot::Observations observations = world.Observe();
  scene::WorldEstimate estimate = world.Truth();
  double rest = 0;
  while (world.time() < limit && rest < 0.3) {
    if (!executive.running()) rest += options.period;
    if (disturb) disturb(world, executive);
    world.Observe(&observations);
    world.Truth(&estimate);
    world.Apply(executive.Step(estimate, observations), options.period);
  }
  return {executive.status(),  world.time(),        executive.events(),
          executive.records(), executive.retries(), world.Truth()};
}

}  // namespace tether::execution
