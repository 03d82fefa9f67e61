#include "tether/execution/sequencer/velocity_executive.h"

#include <algorithm>
#include <cmath>

#include "tether/common/error.h"
#include "tether/common/text.h"
#include "tether/execution/sequencer/velocity_executive_impl.h"
#include "tether/geometry/distance/distance.h"

namespace tether::execution {
namespace {

// A held object that is this much further from what it stood on than it must keep is clear of it, m.
constexpr double kClear = 0.002;
// What happens again within this time is one event, s.
constexpr double kSameEvent = 1.0;
// A grasp is lost when it has been out of place for so long, s.
constexpr double kLostTime = 0.1;

std::string Number(double value, const char* format) {
  char text[40];
  FormatInto(text, sizeof text, format, value);
  return text;
}

std::string RobotOf(const scene::Scene& scene, const planning::Plan& plan) {
  if (!plan.robot.empty() && scene.FindRobot(plan.robot) != nullptr) return plan.robot;
  if (scene.robots.empty())
    throw InputError("the scene has no robot", "a robot under 'robots' of the scenario");
  return scene.robots.front().name;
}

}  // namespace

void VelocityExecutiveOptions::Validate() const {
  controller.Validate();
  Diagnostics diagnostics;
  const auto require = [&](const char* name, double value) {
    if (std::isfinite(value) && value > 0) return;
    diagnostics.Add({}, std::string("'") + name + "' of the velocity executive is " + std::to_string(value),
                    "a finite number above zero is accepted");
  };
  require("period", period);
  require("acceleration", acceleration);
  require("turn_speed", turn_speed);
  require("foot_gap", foot_gap);
  require("least_width", least_width);
  require("slip_distance", slip_distance);
  require("slip_angle", slip_angle);
  require("stall_time", stall_time);
  require("verb_timeout", verb_timeout);
  diagnostics.ThrowIfAny();
}

VelocityExecutive::Impl::Impl(const scene::Scene& scene_in,
                              const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                              const std::vector<planning::ActionSchema>& actions, planning::Plan plan_in,
                              const VelocityExecutiveOptions& options_in)
    : scene(scene_in),
      control_scene(scene, RobotOf(scene, plan_in)),
      model(models.at(RobotOf(scene, plan_in))),
      robot_name(RobotOf(scene, plan_in)),
      plan(std::move(plan_in)),
      options(options_in),
      schemas(actions),
      controller(MakeController()),
      q(model->home()),
      objects(scene.objects.size()),
      trackers(scene.objects.size()),
      invalid(scene.objects.size(), false) {
  options.Validate();
  plan.robot = robot_name;
  BindPlan(schemas);
  records.resize(steps.size());
  for (size_t i = 0; i < records.size(); ++i) records[i].step = static_cast<int>(i);
  gripper.opening = model->gripper().max_opening;
  for (const scene::Robot& robot : scene.robots) {
    robot::Command& command = commands[robot.name];
    command.mode = robot::Command::Mode::kVelocity;
    command.velocity = Eigen::VectorXd::Zero(models.at(robot.name)->dof());
    command.gripper.opening = models.at(robot.name)->gripper().max_opening;
  }
  for (size_t i = 0; i < objects.size(); ++i) objects[i].X = scene.InitialPose(scene.objects[i].name);
  if (steps.empty()) status.state = ExecutiveStatus::State::kFinished;
}

void VelocityExecutive::Impl::Record(EventKind kind, const std::string& text) {
  events.push_back({time, kind, std::min(at, static_cast<int>(steps.size())), text});
}

void VelocityExecutive::Impl::Sense(const scene::WorldEstimate& estimate,
                                    const robot::Observations& observations) {
  const robot::Observation& seen = observations.at(robot_name);
  time = estimate.time;
  q = seen.q;
  opening = seen.gripper_opening;
  for (size_t i = 0; i < objects.size(); ++i) {
    const auto found = estimate.X_WO.find(scene.objects[i].name);
    const bool finite =
        found != estimate.X_WO.end() && found->second.R.allFinite() && found->second.p.allFinite();
    control::MovingPose& object = objects[i];
    if (!finite) {
      object.V.setZero();
      if (!invalid[i] && found != estimate.X_WO.end())
        Record(EventKind::kEstimateInvalid, "the pose of '" + scene.objects[i].name + "' is not finite");
      invalid[i] = true;
      continue;
    }
    object.X = found->second;
    // Its velocity is filtered: what stands on a contact trembles from one tick to the next, and is at rest.
    FrameTracker& tracker = trackers[i];
    if (sensed && !invalid[i]) {
      tracker.Predict(time);
      tracker.Correct(object.X);
    } else {
      tracker.Reset(object.X, time);
    }
    object.V = tracker.V_WF();
    invalid[i] = false;
  }
  sensed = true;
}

void VelocityExecutive::Impl::UpdateAllowed() {
  allowed.clear();
  // A region stands for what carries it.
  const auto names_of = [&](const std::string& name) -> std::vector<std::string> {
    const scene::Region* region = scene.FindRegion(name);
    if (region == nullptr) return {name};
    std::vector<int> found;
    FindCarriers(*region, found);
    std::vector<std::string> names;
    for (const int object : found) names.push_back(object_name(object));
    return names;
  };
  const auto allow = [&](const std::string& first, const std::string& second) {
    for (const std::string& a : names_of(first)) {
      for (const std::string& b : names_of(second)) allowed.emplace_back(a, b);
    }
  };
  if (at < static_cast<int>(steps.size())) {
    for (const auto& [first, second] : schema().allow) allow(first, second);
    if (schema().target_is_region && schema().control != "hand") allow(schema().control, schema().target);
  }
  if (held >= 0) {
    for (const int support : supports) allowed.emplace_back(held_name, object_name(support));
    for (const int object : beneath) allowed.emplace_back(held_name, object_name(object));
  }
  std::vector<std::pair<int, int>>& pairs = allowed_bodies;
  pairs.clear();
  const control::ArmBodies& bodies = controller.bodies();
  const auto bodies_of = [&](const std::string& name) {
    std::vector<int> list;
    if (const int object = control_scene.ObjectIndex(name); object >= 0)
      list.push_back(bodies.object(object));
    for (int body = 0; name == "hand" && body <= bodies.hand(); ++body) {
      if (bodies.link(body) == model->dof()) list.push_back(body);
    }
    return list;
  };
  for (const auto& [first, second] : allowed) {
    for (const int a : bodies_of(first)) {
      for (const int b : bodies_of(second)) pairs.emplace_back(a, b);
    }
  }
  controller.Allow(pairs);
}

void VelocityExecutive::Impl::Hold(int object) {
  held = object;
  held_name = object_name(object);
  lost_since = -1;
  X_HO_grasp = math::Between(X_WH, objects[static_cast<size_t>(object)].X);
  controller.Hold(object);
  supports.clear();
  const scene::Object& taken = scene.objects[static_cast<size_t>(object)];
  for (size_t i = 0; i < objects.size(); ++i) {
    if (static_cast<int>(i) == object) continue;
    const double distance = geometry::SignedDistance(taken.shape, objects[static_cast<size_t>(object)].X,
                                                     scene.objects[i].shape, objects[i].X)
                                .distance;
    if (distance < kClear) supports.push_back(static_cast<int>(i));
  }
  beneath.clear();
  UpdateAllowed();
  FindBeneath();
}

void VelocityExecutive::Impl::Release() {
  held = -1;
  held_name.clear();
  supports.clear();
  beneath.clear();
  controller.Release();
  UpdateAllowed();
}

void VelocityExecutive::Impl::WatchHeld() {
  if (held < 0) return;
  const control::MovingPose& object = objects[static_cast<size_t>(held)];
  const scene::Object& taken = scene.objects[static_cast<size_t>(held)];
  double keep = 0;
  for (const control::ConstraintSpec& spec : options.constraints) keep = std::max(keep, spec.distance);
  for (size_t i = 0; i < supports.size(); ++i) {
    const auto support = static_cast<size_t>(supports[i]);
    const double distance =
        geometry::SignedDistance(taken.shape, object.X, scene.objects[support].shape, objects[support].X)
            .distance;
    if (distance < keep + options.controller.buffer + kClear) continue;
    supports.erase(supports.begin() + static_cast<std::ptrdiff_t>(i--));
    UpdateAllowed();
  }
  FindBeneath();
  const math::Pose X_HO = math::Between(X_WH, object.X);
  const bool out = (X_HO.p - X_HO_grasp.p).norm() > options.slip_distance ||
                   math::AngleBetween(X_HO.R, X_HO_grasp.R) > options.slip_angle;
  if (!out) {
    lost_since = -1;
    return;
  }
  if (lost_since < 0) lost_since = time;
  if (time - lost_since < kLostTime) return;
  const std::string name = held_name;
  Release();
  gripper.mode = robot::GripperCommand::Mode::kOpening;
  gripper.opening = model->gripper().max_opening;
  Record(EventKind::kGraspLost, "'" + name + "' no longer moves with the hand");
  for (int step = at; step >= 0; --step) {
    const planning::StepSchema& taking = steps[static_cast<size_t>(step)].schema;
    if (taking.control != "hand" || taking.target != name) continue;
    at = step;
    return Abort(EventKind::kRetry, "'" + name + "' is grasped again", true);
  }
  Fail("'" + name + "' was lost");
}

void VelocityExecutive::Impl::WatchSafety() {
  const control::VelocityFlags& flags = controller.flags();
  if (flags.fault && !faulty)
    Record(EventKind::kSafety, q.allFinite()
                                   ? "no velocities were found that keep the constraints: the arm stops"
                                   : "a joint's position is not a finite number: the arm stops");
  faulty = flags.fault;
  if (flags.worst < 0) return;
  const std::string& name = controller.constraint_name(flags.worst);
  if (flags.escaping && !flags.relaxed) {
    if (time > escaping_until) {
      Record(EventKind::kSafety, "'" + name + "' is violated by " + Number(flags.violation, "%.4f") +
                                     " (m or rad): the arm leaves it at no more than " +
                                     Number(options.controller.escape_speed, "%.2f") + " per second");
    }
    escaping_until = time + kSameEvent;
  }
  if (flags.relaxed) {
    if (time > relaxed_until)
      Record(EventKind::kSafety, "constraints conflict: '" + name + "' is violated at " +
                                     Number(flags.violation, "%.4f") + " (m or rad) per second");
    relaxed_until = time + kSameEvent;
  }
}

void VelocityExecutive::Impl::StartStep(int step) {
  at = step;
  verb = 0;
  entered = false;
  goal.reset();
  grasp.reset();
  path.clear();
  released = -1;
  clear = false;
  verb_fields.clear();
  controller.SetExtraFields({});
  if (at >= static_cast<int>(steps.size())) {
    status.state = ExecutiveStatus::State::kFinished;
    UpdateAllowed();
    return Record(EventKind::kFinished, "the plan is finished");
  }
  StepRecord& record = records[static_cast<size_t>(at)];
  ++record.attempts;
  record.start = time;
  detours = 0;
  if (steps[static_cast<size_t>(at)].action_start == at && record.attempts == 1) held_before = held_name;
  if (steps[static_cast<size_t>(at)].action_start == at)
    Record(EventKind::kActionStarted, plan.steps[static_cast<size_t>(at)].action);
  Record(EventKind::kStepStarted, schema().control + " to " + schema().target);
  UpdateAllowed();
}

void VelocityExecutive::Impl::FinishStep() {
  records[static_cast<size_t>(at)].end = time;
  Record(EventKind::kStepFinished, schema().control + " to " + schema().target);
  if (MissedItsRegion()) return;
  StartStep(at + 1);
}

void VelocityExecutive::Impl::GiveUpAction(const std::string& reason) {
  std::string why;
  if (TryAlternative(why)) return;
  Fail(why.empty() ? reason : reason + "; " + why);
}

bool VelocityExecutive::Impl::TryAlternative(std::string& why) {
  if (!options.alternative) return false;
  if (replanner >= options.max_alternatives) {
    why = "other actions have been tried " + std::to_string(replanner) + " times";
    return false;
  }
  const int action = plan.steps[static_cast<size_t>(at)].action_index;
  const std::string blocked = plan.actions[static_cast<size_t>(action)];
  planning::Plan next = plan;
  next.actions.resize(static_cast<size_t>(action));
  const auto found = options.alternative(next.actions, blocked, why);
  if (!found) return false;
  next.actions.insert(next.actions.end(), found->begin(), found->end());
  std::erase_if(next.steps, [&](const planning::PlanStep& step) { return step.action_index >= action; });
  planning::Plan before = std::move(plan);
  std::vector<BoundVelocityStep> steps_before = std::move(steps);
  plan = std::move(next);
  steps.clear();
  try {
    BindPlan(schemas);
  } catch (const InputError& error) {
    plan = std::move(before);
    steps = std::move(steps_before);
    why = "other actions can't be executed: " + std::string(error.what());
    return false;
  }
  ++replanner;
  if (held >= 0 && held_name != held_before) {
    // It was grasped by the action that is given up.
    Record(EventKind::kReleased, "'" + held_name + "'");
    Release();
    gripper.mode = robot::GripperCommand::Mode::kOpening;
    gripper.opening = model->gripper().max_opening;
  }
  std::erase_if(retries_of_action, [&](const auto& entry) { return entry.first >= action; });
  const auto first = std::find_if(plan.steps.begin(), plan.steps.end(), [&](const planning::PlanStep& step) {
    return step.action_index >= action;
  });
  at = static_cast<int>(first - plan.steps.begin());
  records.resize(steps.size());
  for (size_t i = static_cast<size_t>(at); i < records.size(); ++i) {
    records[i] = {};
    records[i].step = static_cast<int>(i);
  }
  std::string text = "without " + blocked + ":";
  for (const std::string& name : *found) text += " " + name;
  Record(EventKind::kReplanned, text);
  StartStep(at);
  return true;
}

void VelocityExecutive::Impl::Fail(const std::string& reason) {
  status.state = ExecutiveStatus::State::kFailed;
  status.reason = plan.steps[static_cast<size_t>(at)].action + ": " + reason;
  goal.reset();
  path.clear();
  Record(EventKind::kFailed, status.reason);
}

void VelocityExecutive::Impl::Abort(EventKind kind, const std::string& text, bool retry) {
  Record(kind, text);
  int& tried = retries_of_action[plan.steps[static_cast<size_t>(at)].action_index];
  if (!retry || tried >= options.max_retries) return GiveUpAction(text);
  ++tried;
  ++retries;
  const int step = at;
  if (kind != EventKind::kRetry) Record(EventKind::kRetry, plan.steps[static_cast<size_t>(step)].action);
  StartStep(step);
}

void VelocityExecutive::Impl::Advance() {
  // Verbs that are done at once are passed in one tick.
  while (status.state == ExecutiveStatus::State::kRunning) {
    const Outcome outcome = RunVerb();
    if (outcome == Outcome::kRunning) return;
    if (outcome == Outcome::kAborted) return;
    goal.reset();
    verb_fields.clear();
    controller.SetExtraFields({});
    entered = false;
    clear = false;
    if (++verb < schema().execute.size()) continue;
    FinishStep();
  }
}

void VelocityExecutive::Impl::Control() {
  const control::VelocityInput input{q, opening, objects};
  robot::Command& command = commands[robot_name];
  command.velocity = controller.Compute(input, goal ? &*goal : nullptr);
  command.gripper = gripper;
}

VelocityExecutive::VelocityExecutive(const scene::Scene& scene,
                                     const std::map<std::string, std::shared_ptr<const robot::Model>>& models,
                                     const std::vector<planning::ActionSchema>& actions, planning::Plan plan,
                                     const VelocityExecutiveOptions& options)
    : impl_(std::make_unique<Impl>(scene, models, actions, std::move(plan), options)) {}
VelocityExecutive::~VelocityExecutive() = default;

const robot::Commands& VelocityExecutive::Step(const scene::WorldEstimate& estimate,
                                               const robot::Observations& observations) {
  Impl& s = *impl_;
  const bool first = !s.sensed;
  s.Sense(estimate, observations);
  if (first) {
    // Places the arm, so that the hand's pose is known.
    s.Control();
    if (s.status.state == ExecutiveStatus::State::kRunning) s.StartStep(0);
  }
  if (s.q.allFinite()) {
    const control::ArmBodies& bodies = s.controller.bodies();
    if (first) s.X_WH = s.control_scene.X_WBase() * bodies.pose(bodies.hand()).X;
    s.WatchHeld();
    s.Advance();
  }
  s.Control();
  const control::ArmBodies& bodies = s.controller.bodies();
  if (!s.controller.flags().fault) s.X_WH = s.control_scene.X_WBase() * bodies.pose(bodies.hand()).X;
  s.WatchSafety();
  return s.commands;
}

const planning::Plan& VelocityExecutive::plan() const { return impl_->plan; }
const ExecutiveStatus& VelocityExecutive::status() const { return impl_->status; }
int VelocityExecutive::step() const { return impl_->at; }
const std::string& VelocityExecutive::held() const { return impl_->held_name; }
const std::vector<Event>& VelocityExecutive::events() const { return impl_->events; }
const std::vector<StepRecord>& VelocityExecutive::records() const { return impl_->records; }
int VelocityExecutive::retries() const { return impl_->retries; }
int VelocityExecutive::replans() const { return impl_->replanner; }
const std::vector<std::pair<std::string, std::string>>& VelocityExecutive::allowed() const {
  return impl_->allowed;
}
const std::vector<control::FieldConstraint>& VelocityExecutive::verb_fields() const {
  static const std::vector<control::FieldConstraint> none;
  return impl_->path.empty() ? impl_->verb_fields : none;
}
const control::ConstrainedVelocity& VelocityExecutive::controller() const { return impl_->controller; }

}  // namespace tether::execution
