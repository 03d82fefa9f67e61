#include "tether/planning/program/program_builder.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tether/common/limits.h"
#include "tether/constraints/core/path_length.h"
#include "tether/planning/program/chain_residual.h"

namespace tether::planning {
namespace {

using constraints::FrameAt;
using constraints::kHand;
using math::Pose;
using nlp::Role;

// A pair without a row may be nearer than its clearance by this much, m.
constexpr double kClearanceTolerance = 1e-5;

/// Turns the rows of constraints into residuals of the program.
class ProgramSink final : public constraints::RowSink {
 public:
  /// Without `rows`, only refutations are recorded.
  ProgramSink(KeyPoseProgram& target, std::vector<Exemption>& exemptions, bool rows = true)
      : target_(target), exemptions_(exemptions), rows_(rows) {}

  void BeginStep(int step, const std::string& action, int action_index = -1) {
    PollLimits();
    step_ = step;
    action_ = action;
    action_index_ = action_index;
  }

  void Add(Role role, const std::string& label, constraints::PoseFunctionPtr function,
           std::vector<FrameAt> frames) override {
    if (!rows_) return;
    std::vector<Chain> chains;
    for (const FrameAt& frame : frames) chains.push_back(target_.tree.ChainTo(frame.frame, frame.step));
    auto residual = MakeChainResidual(action_ + ": " + label, step_, std::move(function), std::move(chains));
    if (residual->blocks().empty()) {
      RefuteIfViolated(*residual, role, label);
      return;
    }
    target_.program.Add(std::move(residual), role);
  }
  void Exempt(int step, const std::string& a, const std::string& b, int part_a) override {
    exemptions_.push_back({step, a, b, part_a});
  }
  void Refute(const std::string& reason) override { Fail(reason, true, true); }
  void Decline(const std::string& reason) override { Fail("not modelled: " + reason, false, true); }
  /// Refuted whatever the variant, but perhaps not after other actions.
  void RefuteHere(const std::string& reason) { Fail(reason, true, false); }
  /// Rows from now on are the planner's own margins, which prove nothing.
  void BeginMargins() { margins_ = true; }

 private:
  void Fail(const std::string& reason, bool proved, bool anywhere) {
    NoteRefutation(reason);
    // A proof replaces an earlier reason that is none.
    if (target_.refuted_action >= 0 && (target_.refuted_proved || !proved)) return;
    target_.refuted_action = action_index_;
    target_.refuted_reason = action_ + ": " + reason;
    target_.refuted_proved = proved;
    target_.refuted_anywhere = anywhere;
  }

  void NoteRefutation(const std::string& reason) {
    const std::string text = action_ + ": " + reason;
    auto& all = target_.refutations;
    if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(text);
  }

  /// A row without variables either holds or is a refutation.
  void RefuteIfViolated(const nlp::Residual& residual, Role role, const std::string& label) {
    if (role == Role::kCost) return;
    Eigen::VectorXd r(residual.size());
    nlp::Point nothing;
    nothing.parameters = target_.tree.parameters();
    residual.Evaluate(nothing, r, nullptr);
    const double violation = role == Role::kEquality ? r.cwiseAbs().maxCoeff() : r.maxCoeff();
    if (violation <= 1e-3) return;
    const char* unit = residual.unit() == nlp::Unit::kRadian ? "rad" : "m";
    char text[48];
    std::snprintf(text, sizeof text, " is off by %.3f %s, and nothing moves there", violation, unit);
    target_.constant_proof = target_.constant_proof || (target_.choices.empty() && !margins_);
    NoteRefutation(label + text);
  }

  KeyPoseProgram& target_;
  std::vector<Exemption>& exemptions_;
  bool rows_;
  int step_ = 0;
  std::string action_;
  int action_index_ = -1;
  bool margins_ = false;
};

void AddClearances(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                   const std::vector<ClearancePair>& pairs, ProgramSink& sink) {
  for (const ClearancePair& pair : pairs) {
    const std::string& a = facts.solids()[static_cast<size_t>(pair.solid_a)];
    const std::string& b = facts.solids()[static_cast<size_t>(pair.solid_b)];
    sink.BeginStep(pair.step, steps[static_cast<size_t>(pair.step)].action);
    sink.Add(Role::kInequality, "clearance(" + a + ", " + b + ")",
             constraints::MakePartDistance(facts.ShapeOf(a)->parts[static_cast<size_t>(pair.part_a)],
                                           facts.ShapeOf(b)->parts[static_cast<size_t>(pair.part_b)],
                                           pair.clearance, -1),
             {{a, pair.step}, {b, pair.step}});
  }
}

void AddReach(const Problem& problem, int num_steps, const std::vector<BoundStep>& steps, ProgramSink& sink) {
  if (problem.robot.model == nullptr) return;
  const robot::Reach& reach = problem.robot.model->reach();
  for (int t = 0; t < num_steps; ++t) {
    sink.BeginStep(t, steps[static_cast<size_t>(t)].action);
    const std::vector<FrameAt> frames{{problem.robot.name, t}, {kHand, t}};
    sink.Add(Role::kInequality, "reach(" + problem.robot.name + ")",
             constraints::MakePointDistance(reach.centre, reach.wrist_hand, reach.max, 1), frames);
    sink.Add(Role::kInequality, "reach(" + problem.robot.name + "): not too near",
             constraints::MakePointDistance(reach.centre, reach.wrist_hand, reach.min, -1), frames);
  }
}

/// Paper A, eq. (4), between consecutive key poses of the hand.
void AddCosts(const Problem& problem, int num_steps, ProgramSink& sink) {
  const bool length = problem.program.objective == Objective::kLength;
  const Weights& weights = problem.program.weights;
  const double translation = length ? weights.translation : std::sqrt(weights.translation);
  const double rotation = length ? weights.rotation : std::sqrt(weights.rotation);
  const auto add = [&](int step, const std::vector<FrameAt>& frames) {
    sink.BeginStep(step, "objective");
    const auto travel = constraints::MakeTravel(translation);
    const auto turn = constraints::MakeTurn(rotation);
    sink.Add(Role::kCost, "travel of the hand", length ? constraints::MakeRootOfLength(travel) : travel,
             frames);
    sink.Add(Role::kCost, "turn of the hand", length ? constraints::MakeRootOfLength(turn) : turn, frames);
  };
  for (int t = 0; t < num_steps; ++t) add(t, {{kHand, t - 1}, {kHand, t}});
  if (problem.program.home && num_steps > 0) add(num_steps - 1, {{kHand, num_steps - 1}, {kHand, -1}});
}

Pose Noise(Random& random, double scale) {
  math::Vector6d delta;
  for (int i = 0; i < 3; ++i) delta[i] = 0.12 * scale * random.Normal();
  for (int i = 3; i < 6; ++i) delta[i] = 0.2 * scale * random.Normal();
  return math::ExpSE3(delta);
}

}  // namespace

KeyPoseProgram BuildProgram(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                            const Variant& variant, const ProgramStart& start) {
  Random random = start.random;
  const Problem& problem = facts.problem();
  KeyPoseProgram out{.tree = FrameTree(problem.scene, problem.robot.X_WHand, problem.robot.holds),
                     .program = {},
                     .guess = {},
                     .choices = {},
                     .refutations = {},
                     .clearances = {}};
  std::vector<Exemption> exemptions;
  ProgramSink sink(out, exemptions, !start.guess_only);

  std::vector<Pose>& poses = out.guess.poses;
  const auto choose = [&](const std::string& key, const std::vector<constraints::Option>& options) {
    for (const ChoicePoint& choice : out.choices) {
      if (choice.key == key) return choice.chosen;
    }
    const auto wanted = variant.find(key);
    const int chosen =
        wanted == variant.end() ? 0 : std::min(wanted->second, static_cast<int>(options.size()) - 1);
    out.choices.push_back({key, options, chosen, steps[poses.size() - 1].action_index});
    return chosen;
  };

  const constraints::Memo memo;
  for (int t = 0; t < static_cast<int>(steps.size()); ++t) {
    const BoundStep& step = steps[static_cast<size_t>(t)];
    const std::string& control = step.schema.control;
    const std::string& target = step.schema.target;
    sink.BeginStep(t, step.action, step.action_index);
    const Pose X_TC =
        math::Between(out.tree.PoseAt(target, t - 1, poses), out.tree.PoseAt(control, t - 1, poses));
    if (!out.tree.AddStep(control, target)) {
      sink.RefuteHere(target + " is attached to " + control + " and can't carry it");
      return out;
    }
    out.program.AddPose(step.action + ": " + control + " in " + target);
    poses.push_back(start.noise > 0 ? X_TC * Noise(random, start.noise) : X_TC);
    const StepContext context(facts, memo, out.tree, poses, t, step, choose);
    for (const BoundConstraint& constraint : step.constraints) {
      Pose guess = poses.back();
      if (constraint.kind->guess) constraint.kind->guess(context, constraint.parameters, guess);
      poses.back() = guess;
    }
    if (poses.size() <= start.beginning.size()) poses.back() = start.beginning[poses.size() - 1];
    if (const auto placed = start.placed.find(t); placed != start.placed.end()) poses.back() = placed->second;
    for (const BoundConstraint& constraint : step.constraints) {
      constraint.kind->build(context, constraint.parameters, sink);
    }
    for (const auto& [a, b] : step.schema.allow) sink.Exempt(t, a, b, -1);
  }
  const int num_steps = static_cast<int>(steps.size());
  if (start.guess_only) return out;
  sink.BeginMargins();
  AddReach(problem, num_steps, steps, sink);
  out.clearances.emplace(facts, steps, out.tree, exemptions, start.tight);
  AddClearances(facts, steps, out.clearances->TakeNear(out.tree, poses, start.near), sink);
  AddCosts(problem, num_steps, sink);
  out.guess.parameters = out.tree.parameters();
  return out;
}

bool AddMissingClearances(const SceneFacts& facts, const std::vector<BoundStep>& steps,
                          const std::vector<Pose>& poses, double near, KeyPoseProgram& key_poses) {
  if (!key_poses.clearances->AnyViolated(key_poses.tree, poses, kClearanceTolerance)) return false;
  std::vector<Exemption> exemptions;
  ProgramSink sink(key_poses, exemptions);
  AddClearances(facts, steps, key_poses.clearances->TakeNear(key_poses.tree, poses, near), sink);
  key_poses.guess = {poses, key_poses.guess.vectors, key_poses.tree.parameters()};
  return true;
}

}  // namespace tether::planning
