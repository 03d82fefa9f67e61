#include "tether/planning/skeleton/skeleton_binding.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "tether/planning/skeleton/action_reader.h"

namespace tether::planning {

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

SkeletonBinder::SkeletonBinder(const scene::Scene& scene, std::shared_ptr<const scene::Frames> frames,
                               const std::vector<ActionSchema>& actions,
                               const std::vector<ConstraintSpec>& always)
    : scene_(scene), frames_(std::move(frames)), actions_(actions), always_(always) {}

FrameId SkeletonBinder::FindFrame(const std::string& name, const Location& where, const std::string& what,
                                  Diagnostics& diagnostics) const {
  const FrameId frame = frames_->Find(name);
  if (frame.valid()) return frame;
  std::vector<std::string> known{constraints::kHand};
  for (const scene::Object& object : scene_.objects) known.push_back(object.name);
  for (const scene::Region& region : scene_.regions) known.push_back(region.name);
  const std::string nearest = NearestMatch(name, known);
  diagnostics.Add(where, what + " names '" + name + "', which is not in the scene",
                  nearest.empty() ? "" : "did you mean '" + nearest + "'?");
  return frame;
}

BoundConstraint SkeletonBinder::Bind(const ConstraintSpec& spec, FrameId moved,
                                     Diagnostics& diagnostics) const {
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
    FindFrame(frame, spec.where, "constraint '" + spec.kind + "'", diagnostics);
  }
  bound.parameters.BindFrames(*frames_, moved);
  return bound;
}

bool SkeletonBinder::Bind(StepSchema schema, BoundStep& step, const std::string& name,
                          Diagnostics& diagnostics) const {
  step.schema = std::move(schema);
  const StepSchema& s = step.schema;
  if (s.target_is_region && scene_.FindRegion(s.target) == nullptr) {
    diagnostics.Add(s.where,
                    "a step of '" + name + "' has the target region '" + s.target +
                        "', which is not a region of the scene",
                    "a region, or a frame as target");
    return false;
  }
  step.control = FindFrame(s.control, s.where, "action '" + name + "'", diagnostics);
  step.target = FindFrame(s.target, s.where, "action '" + name + "'", diagnostics);
  for (const auto& [a, b] : s.allow) step.allow.emplace_back(frames_->Find(a), frames_->Find(b));
  for (const Verb& verb : s.execute) {
    const auto* gripper = std::get_if<GripperVerb>(&verb);
    step.close_on.push_back(gripper == nullptr ? FrameId() : frames_->Find(gripper->close_on));
  }
  for (const ConstraintSpec& spec : s.constraints)
    step.constraints.push_back(Bind(spec, step.control, diagnostics));
  // Where there is no key pose, the controller keeps the constraints that hold at every step.
  for (const ConstraintSpec& spec : always_) {
    if (s.target_is_region) break;
    step.constraints.push_back(Bind(spec, step.control, diagnostics));
  }
  return true;
}

std::vector<BoundStep> SkeletonBinder::BindAction(const std::string& action, Diagnostics& diagnostics) const {
  std::vector<BoundStep> steps;
  const ActionCall call = ParseActionCall(action);
  const auto schema = std::find_if(actions_.rbegin(), actions_.rend(), [&](const ActionSchema& candidate) {
    return candidate.name == call.name;
  });
  if (schema == actions_.rend()) {
    std::vector<std::string> names;
    for (const ActionSchema& candidate : actions_) names.push_back(candidate.name);
    diagnostics.Add({}, "action '" + call.name + "' has no geometry", SuggestFrom(call.name, names));
    return steps;
  }
  std::vector<StepSchema> bound = planning::BindAction(*schema, call.arguments);
  for (size_t k = 0; k < bound.size(); ++k) {
    BoundStep step;
    step.action = action;
    step.step_in_action = static_cast<int>(k);
    if (Bind(std::move(bound[k]), step, schema->name, diagnostics)) steps.push_back(std::move(step));
  }
  return steps;
}

Skeleton SkeletonBinder::Bind(const std::vector<std::string>& actions) const {
  Diagnostics diagnostics;
  Skeleton skeleton{frames_, actions, {}};
  for (size_t i = 0; i < actions.size(); ++i) {
    for (BoundStep& step : BindAction(actions[i], diagnostics)) {
      step.action_index = static_cast<int>(i);
      skeleton.steps.push_back(std::move(step));
    }
  }
  diagnostics.ThrowIfAny();
  return skeleton;
}

std::vector<BoundStep> BindSkeleton(const Problem& problem, const std::vector<std::string>& actions) {
  return SkeletonBinder(problem.scene, std::make_shared<scene::Frames>(problem.scene), problem.actions,
                        problem.constraints)
      .Bind(actions)
      .steps;
}

}  // namespace tether::planning
