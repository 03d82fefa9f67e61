#include "tether/planning/skeleton/skeleton_binding.h"

#include "tether/planning/skeleton/action_reader.h"

namespace tether::planning {
namespace {

bool IsFrame(const scene::Scene& scene, const std::string& name) {
  return name == constraints::kHand || name == scene::kWorld || scene.FindObject(name) != nullptr ||
         scene.FindRegion(name) != nullptr || scene.FindRobot(name) != nullptr;
}

void RequireFrame(const scene::Scene& scene, const std::string& name, const Location& where,
                  const std::string& what, Diagnostics& diagnostics) {
  if (IsFrame(scene, name)) return;
  std::vector<std::string> known{constraints::kHand};
  for (const scene::Object& object : scene.objects) known.push_back(object.name);
  for (const scene::Region& region : scene.regions) known.push_back(region.name);
  const std::string nearest = NearestMatch(name, known);
  diagnostics.Add(where, what + " names '" + name + "', which is not in the scene",
                  nearest.empty() ? "" : "did you mean '" + nearest + "'?");
}

BoundConstraint Bind(const ConstraintSpec& spec, const scene::Scene& scene, Diagnostics& diagnostics) {
  BoundConstraint bound;
  bound.kind = constraints::FindKind(spec.kind);
  if (bound.kind == nullptr) {
    diagnostics.Add(spec.where, "unknown constraint '" + spec.kind + "'",
                    SuggestFrom(spec.kind, constraints::KindNames()));
    return bound;
  }
  bound.parameters = constraints::ReadParameters(*bound.kind, spec.parameters, diagnostics);
  for (const std::string& frame : bound.parameters.AllFrames()) {
    if (frame == constraints::kMoved || frame.empty()) continue;
    RequireFrame(scene, frame, spec.where, "constraint '" + spec.kind + "'", diagnostics);
  }
  return bound;
}

}  // namespace

ActionCall ParseActionCall(const std::string& text) {
  ActionCall call;
  const size_t open = text.find('(');
  call.name = text.substr(0, open);
  if (open == std::string::npos) return call;
  std::string argument;
  for (size_t i = open + 1; i < text.size(); ++i) {
    if (text[i] == ',' || text[i] == ')') {
      if (!argument.empty()) call.arguments.push_back(argument);
      argument.clear();
    } else if (text[i] != ' ') {
      argument += text[i];
    }
  }
  return call;
}

std::string ToString(const ActionCall& call) {
  std::string text = call.name + "(";
  for (size_t i = 0; i < call.arguments.size(); ++i) text += (i > 0 ? "," : "") + call.arguments[i];
  return text + ")";
}

std::vector<BoundStep> BindSkeleton(const Problem& problem, const std::vector<std::string>& actions) {
  Diagnostics diagnostics;
  std::vector<BoundStep> steps;
  for (size_t i = 0; i < actions.size(); ++i) {
    const ActionCall call = ParseActionCall(actions[i]);
    const ActionSchema* schema = nullptr;
    for (const ActionSchema& candidate : problem.actions) {
      if (candidate.name == call.name) schema = &candidate;
    }
    if (schema == nullptr) {
      std::vector<std::string> names;
      for (const ActionSchema& candidate : problem.actions) names.push_back(candidate.name);
      diagnostics.Add({}, "action '" + call.name + "' has no geometry",
                      "the action libraries have " + JoinAlternatives(names));
      continue;
    }
    std::vector<StepSchema> bound = BindAction(*schema, call.arguments);
    for (size_t k = 0; k < bound.size(); ++k) {
      BoundStep step;
      step.action = actions[i];
      step.action_index = static_cast<int>(i);
      step.step_in_action = static_cast<int>(k);
      step.schema = std::move(bound[k]);
      const StepSchema& s = step.schema;
      if (s.target_is_region && problem.scene.FindRegion(s.target) == nullptr) {
        diagnostics.Add(s.where,
                        "a step of '" + schema->name + "' has the target region '" + s.target +
                            "', which is not a region of the scene",
                        "a region, or a frame as target");
        continue;
      }
      RequireFrame(problem.scene, s.control, s.where, "action '" + schema->name + "'", diagnostics);
      RequireFrame(problem.scene, s.target, s.where, "action '" + schema->name + "'", diagnostics);
      for (const ConstraintSpec& spec : s.constraints) {
        step.constraints.push_back(Bind(spec, problem.scene, diagnostics));
      }
      // Where there is no key pose, the controller keeps the constraints that hold at every step.
      for (const ConstraintSpec& spec : problem.constraints) {
        if (s.target_is_region) break;
        step.constraints.push_back(Bind(spec, problem.scene, diagnostics));
      }
      steps.push_back(std::move(step));
    }
  }
  diagnostics.ThrowIfAny();
  return steps;
}

}  // namespace tether::planning
