#include "tether/evaluation/log/run_recorder.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "tether/common/file.h"
#include "tether/common/version.h"
#include "tether/evaluation/log/log_channels.h"
#include "tether/evaluation/log/log_stream.h"
#include "tether/evaluation/log/message_template.h"
#include "tether/evaluation/log/pose_values.h"
#include "tether/evaluation/log/scene_entities.h"
#include "tether/planning/plan/plan_file.h"
#include "tether/scene/region.h"

namespace tether::evaluation {
namespace {

constexpr double kPeriod = 0.05;  // Between samples, s.
constexpr int kPromptly = 25;     // Between looks at what was handed over, ms.
constexpr double kNone = std::numeric_limits<double>::infinity();

const std::string kNumber(1, kNumberSlot), kTime(1, kTimeSlot);

Value TimeValue(double time) {
  const auto nanoseconds = static_cast<int64_t>(std::llround(time * 1e9));
  return Value::Object().Set("sec", nanoseconds / 1'000'000'000).Set("nsec", nanoseconds % 1'000'000'000);
}

std::string Quoted(const std::string& text) {
  std::string quoted;
  AppendQuoted(text, &quoted);
  return quoted;
}

std::string TransformText(const std::string& parent, const std::string& child) {
  return "{\"timestamp\":" + kTime + ",\"parent_frame_id\":" + Quoted(parent) +
         ",\"child_frame_id\":" + Quoted(child) + ",\"translation\":{\"x\":" + kNumber + ",\"y\":" + kNumber +
         ",\"z\":" + kNumber + "},\"rotation\":{\"x\":" + kNumber + ",\"y\":" + kNumber +
         ",\"z\":" + kNumber + ",\"w\":" + kNumber + "}}";
}

Value Transform(const std::string& parent, const std::string& child, const math::Pose& X) {
  return Value::Object()
      .Set("timestamp", TimeValue(0))
      .Set("parent_frame_id", parent)
      .Set("child_frame_id", child)
      .Set("translation", VectorValue(X.p))
      .Set("rotation", QuaternionValue(X.Quaternion()));
}

std::string ActionOf(const planning::Plan& plan, int step) {
  return step >= 0 && step < static_cast<int>(plan.steps.size()) ? plan.steps[step].action : "";
}

/// foxglove.Log's levels.
int LevelOf(const std::string& kind) {
  constexpr int kInfo = 2, kWarning = 3, kError = 4;
  if (kind == "failed") return kError;
  for (const char* trouble : {"miss", "lost", "stalled", "slipped", "retry", "invalid", "never_happened",
                              "disturbance", "no_contact", "replan", "detour", "safety", "fault"}) {
    if (kind.find(trouble) != std::string::npos) return kWarning;
  }
  return kInfo;
}

std::string Base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t three = 0;
    const size_t here = std::min<size_t>(3, bytes.size() - i);
    for (size_t k = 0; k < 3; ++k)
      three = three << 8 | (k < here ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (size_t k = 0; k < 4; ++k) text += k <= here ? kDigits[three >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string AbsolutePath(const std::string& path) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(path, error);
  return path.empty() || error ? path : absolute.lexically_normal().string();
}

/// The objects that may move: those with a mass, and fixed ones that an event moves, with what is mounted on
/// them.
std::vector<const scene::Object*> FindMoving(const scene::Scene& scene,
                                             const std::vector<scenario::Event>& events) {
  std::vector<const scene::Object*> moving;
  for (const scene::Object& object : scene.objects) {
    bool moves = object.movable();
    const scene::Object* mount = &object;
    for (size_t depth = 0; mount != nullptr && !moves && depth <= scene.objects.size(); ++depth) {
      moves = std::any_of(events.begin(), events.end(),
                          [&](const scenario::Event& event) { return event.object == mount->name; });
      mount = scene.FindObject(mount->parent);
    }
    if (moves) moving.push_back(&object);
  }
  return moving;
}

LogPreamble MakePreamble(const LogSettings& settings, const scenario::Scenario& scenario,
                         const execution::PlanRunner& runner) {
  LogPreamble preamble;
  preamble.library = "tether " + Version();
  preamble.metadata_name = kLogMetadata;
  preamble.files = settings.files;
  preamble.channels = LogChannels();
  // In real time the last sample is up to 50 ms old when it is handed over.
  if (settings.realtime) preamble.look_ms = kPromptly;
  preamble.metadata = {{"format", kLogFormat},
                       {"tether", Version()},
                       {"physics", sim::PhysicsVersion()},
                       {"seed", std::to_string(settings.seed)},
                       {"scenario", scenario.title},
                       {"scenario_file", AbsolutePath(scenario.path)},
                       {"robot", runner.plan().robot},
                       {"controller", ToString(scenario.execution.controller)},
                       {"rate_hz", Value(scenario.execution.rate).AsText()}};
  if (!settings.goal.empty()) {
    preamble.metadata["goal"] = settings.goal;
    preamble.metadata["semantics"] = settings.semantics;
  }
  return preamble;
}

}  // namespace

RunRecorder::RunRecorder(const LogSettings& settings, const scenario::Scenario& scenario,
                         const scene::Scene& scene, const std::vector<scenario::Event>& events,
                         const sim::World& world, const execution::PlanRunner& runner)
    : scenario_(scenario),
      scene_(scene),
      world_(world),
      seed_(settings.seed),
      stream_(std::make_unique<LogStream>(settings.path, MakePreamble(settings, scenario, runner))),
      moving_(FindMoving(scene, events)) {
  for (const scene::Robot& robot : scene.robots) {
    arms_.push_back(
        {&robot, robot::Kinematics(scenario.models.at(robot.name)), scene.InitialPose(robot.name)});
  }
  WriteOnce();
  MakeTransforms();
  MakeJoints();
}

RunRecorder::~RunRecorder() = default;

void RunRecorder::Text(int channel, double time, Value message) {
  stream_->WriteText(channel, time, WriteJson(message, 0));
}

void RunRecorder::WriteOnce() {
  Value transforms = Value::Array(), robots = Value::Array();
  for (const scene::Object& object : scene_.objects) {
    if (std::find(moving_.begin(), moving_.end(), &object) != moving_.end()) continue;
    transforms.Append(Transform(scene::kWorld, object.name, scene_.InitialPose(object.name)));
  }
  for (const scene::Region& region : scene_.regions)
    transforms.Append(Transform(region.parent, region.name, region.X_ParentRegion));
  for (const Arm& arm : arms_) {
    const robot::Model& model = arm.kinematics.model();
    const std::string& name = arm.robot->name;
    transforms.Append(Transform(scene::kWorld, name, arm.X_WB));
    transforms.Append(Transform(name, LinkFrame(name, 0), {}));
    Value joints = Value::Array();
    for (int i = 0; i < model.dof(); ++i) {
      joints.Append(Value::Object()
                        .Set("name", model.joint_names()[i])
                        .Set("lower", model.lower()[i])
                        .Set("upper", model.upper()[i])
                        .Set("max_velocity", model.max_velocity()[i])
                        .Set("max_torque", model.max_torque()[i]));
    }
    robots.Append(Value::Object().Set("name", name).Set("model", model.name()).Set("joints", joints));
  }
  Text(kRobots, 0, Value::Object().Set("robots", robots));
  Text(kStaticTransforms, 0, Value::Object().Set("transforms", transforms));
  Text(kSceneUpdate, 0, SceneEntities(scene_, scenario_.models));
}

void RunRecorder::MakeTransforms() {
  std::string text;
  const auto add = [&](const std::string& parent, const std::string& child) {
    text += (text.empty() ? "" : ",") + TransformText(parent, child);
  };
  for (const scene::Object* object : moving_) add(scene::kWorld, object->name);
  for (const Arm& arm : arms_) {
    const std::string& name = arm.robot->name;
    for (int link = 1; link <= arm.kinematics.dof(); ++link) add(name, LinkFrame(name, link));
    add(name, HandFrame(name));
  }
  add(scene::kWorld, "target");
  transforms_ = stream_->AddTemplate(kTransforms, "{\"transforms\":[" + text + "]}");
}

void RunRecorder::MakeJoints() {
  std::string text;
  for (const Arm& arm : arms_) {
    for (const std::string& joint : arm.kinematics.model().joint_names()) {
      text += (text.empty() ? "{\"name\":" : ",{\"name\":") + Quoted(arm.robot->name + "/" + joint) +
              ",\"position\":" + kNumber + ",\"velocity\":" + kNumber + ",\"effort\":" + kNumber + "}";
    }
    text += ",{\"name\":" + Quoted(arm.robot->name + "/gripper") + ",\"position\":" + kNumber + "}";
  }
  joints_ = stream_->AddTemplate(kJoints, "{\"timestamp\":" + kTime + ",\"joints\":[" + text + "]}");
}

void RunRecorder::Observe(const RunMoment& moment) {
  const execution::PlanRunner& runner = moment.runner;
  margins_seen_ = margins_seen_ || runner.running();
  const bool changed = runner.step() != step_ || moment.actions_done != done_ || runner.held() != held_ ||
                       runner.running() != running_ || runner.retries() != retries_ ||
                       runner.replans() != replans_;
  if (!changed && moment.commands != nullptr && moment.time < next_ - 1e-9) return;
  if (changed || runner.plan().actions != actions_) WriteState(moment);
  WriteTransforms(moment);
  WriteJoints(moment);
  if (moment.commands != nullptr) WriteCommands(moment);
  WriteContacts(moment.time);
  if (margins_seen_) WriteMargins(moment.time, moment.margins);
  while (next_ <= moment.time + 1e-9) next_ += kPeriod;
}

void RunRecorder::WriteState(const RunMoment& moment) {
  const execution::PlanRunner& runner = moment.runner;
  if (runner.replans() != replans_ || runner.plan().actions != actions_)
    WritePlan(moment.time, runner.plan());
  step_ = runner.step();
  done_ = moment.actions_done;
  held_ = runner.held();
  running_ = runner.running();
  retries_ = runner.retries();
  replans_ = runner.replans();
  Text(kState, moment.time,
       Value::Object()
           .Set("timestamp", TimeValue(moment.time))
           .Set("step", step_)
           .Set("actions_done", done_)
           .Set("action", ActionOf(runner.plan(), step_))
           .Set("held", held_)
           .Set("running", running_)
           .Set("retries", retries_)
           .Set("replans", replans_));
}

void RunRecorder::WritePlan(double time, const planning::Plan& plan) {
  actions_ = plan.actions;
  const planning::PlanOrigin origin{Version(), seed_, scenario_.path};
  Text(kPlans, time,
       Value::Object()
           .Set("timestamp", TimeValue(time))
           .Set("plan", planning::WritePlan(plan, origin, scene_, scenario_.actions)));
}

void RunRecorder::AddPose(const math::Pose& X) {
  const Eigen::Quaterniond q = X.Quaternion();
  numbers_.insert(numbers_.end(), {X.p.x(), X.p.y(), X.p.z(), q.x(), q.y(), q.z(), q.w()});
}

/// Where the control frame is to go: the key pose of the present step, where its target now is; at the end,
/// and where any pose in a region serves, the hand or the region.
math::Pose RunRecorder::TargetPose(const RunMoment& moment) const {
  const planning::Plan& plan = moment.runner.plan();
  const int index = moment.runner.step();
  if (index < 0 || index >= static_cast<int>(plan.steps.size())) {
    for (const Arm& arm : arms_) {
      if (arm.robot->name == plan.robot) return arm.X_WB * arm.kinematics.X_BH();
    }
    return {};
  }
  const planning::PlanStep& step = plan.steps[index];
  math::Pose X_WT;
  if (const auto found = moment.truth.X_WO.find(step.target); found != moment.truth.X_WO.end()) {
    X_WT = found->second;
  } else if (const scene::Region* region = scene_.FindRegion(step.target)) {
    X_WT = scene::RegionPose(scene_, moment.truth.X_WO, *region);
  } else if (scene_.FindRobot(step.target) != nullptr) {
    X_WT = scene_.InitialPose(step.target);
  }
  return step.target_is_region ? X_WT : X_WT * step.X_TC;
}

void RunRecorder::WriteTransforms(const RunMoment& moment) {
  numbers_.clear();
  for (const scene::Object* object : moving_) AddPose(moment.truth.X_WO.at(object->name));
  for (Arm& arm : arms_) {
    arm.kinematics.Set(moment.observations.at(arm.robot->name).q);
    for (int link = 1; link <= arm.kinematics.dof(); ++link) AddPose(arm.kinematics.X_BL(link));
    AddPose(arm.kinematics.X_BH());
  }
  AddPose(TargetPose(moment));
  stream_->Write(transforms_, moment.time, numbers_);
}

void RunRecorder::WriteJoints(const RunMoment& moment) {
  numbers_.clear();
  for (const Arm& arm : arms_) {
    const robot::Observation& seen = moment.observations.at(arm.robot->name);
    for (int i = 0; i < arm.kinematics.dof(); ++i) {
      const double effort = i < seen.tau_external.size() ? seen.tau_external[i] : 0;
      numbers_.insert(numbers_.end(), {seen.q[i], seen.v[i], effort});
    }
    numbers_.push_back(seen.gripper_opening);
  }
  stream_->Write(joints_, moment.time, numbers_);
}

void RunRecorder::WriteCommands(const RunMoment& moment) {
  using Mode = robot::Command::Mode;
  using Gripper = robot::GripperCommand::Mode;
  std::string modes;
  numbers_.clear();
  for (const auto& [name, command] : *moment.commands) {
    const bool velocity = command.mode == Mode::kVelocity,
               opening = command.gripper.mode == Gripper::kOpening;
    const Eigen::VectorXd& values = velocity ? command.velocity : command.torque;
    modes += (velocity ? 'v' : 't');
    modes += (opening ? 'o' : 'f');
    numbers_.insert(numbers_.end(), values.data(), values.data() + values.size());
    numbers_.push_back(opening ? command.gripper.opening : command.gripper.force);
  }
  if (modes != modes_) {
    modes_ = modes;
    std::string text;
    for (const auto& [name, command] : *moment.commands) {
      const bool velocity = command.mode == Mode::kVelocity,
                 opening = command.gripper.mode == Gripper::kOpening;
      std::string values;
      for (Eigen::Index i = 0; i < (velocity ? command.velocity : command.torque).size(); ++i)
        values += (i == 0 ? "" : ",") + kNumber;
      text += (text.empty() ? "{\"name\":" : ",{\"name\":") + Quoted(name) +
              ",\"mode\":" + (velocity ? "\"velocity\"" : "\"torque\"") + ",\"values\":[" + values +
              "],\"gripper\":" + (opening ? "\"opening\"" : "\"force\"") + ",\"gripper_value\":" + kNumber +
              "}";
    }
    commands_ = stream_->AddTemplate(kCommands, "{\"timestamp\":" + kTime + ",\"robots\":[" + text + "]}");
  }
  stream_->Write(commands_, moment.time, numbers_);
}

const std::string& RunRecorder::NameText(const std::string& name) {
  std::string& text = name_texts_[name];
  if (text.empty()) text = Quoted(name);
  return text;
}

void RunRecorder::WriteContacts(double time) {
  std::string& text = text_;
  text = "{\"timestamp\":";
  AppendTime(static_cast<uint64_t>(std::llround(time * 1e9)), &text);
  text += ",\"contacts\":[";
  bool first = true;
  for (const sim::Contact& contact : world_.Contacts()) {
    text += first ? "{\"a\":" : ",{\"a\":";
    first = false;
    text += NameText(contact.a);
    text += ",\"b\":";
    text += NameText(contact.b);
    text += ",\"force\":";
    AppendNumber(contact.force, &text);
    text += '}';
  }
  text += "]}";
  stream_->WriteText(kContacts, time, text);
}

void RunRecorder::WriteMargins(double time, RunMargins& measured) {
  const std::vector<Margin>& margins = measured.margins();
  numbers_.clear();
  bool same = margins.size() == margin_names_.size();
  for (size_t i = 0; i < margins.size(); ++i) {
    same = same && margins[i].name == margin_names_[i];
    numbers_.push_back(std::isfinite(margins[i].last) ? margins[i].last : kNone);
  }
  if (!same) {  // Those of a verb begin with it.
    margin_names_.clear();
    std::string text;
    for (const Margin& margin : margins) {
      margin_names_.push_back(margin.name);
      text += (text.empty() ? "{\"name\":" : ",{\"name\":") + Quoted(margin.name) +
              ",\"unit\":" + Quoted(margin.unit) + ",\"group\":" + Quoted(margin.group) +
              ",\"least\":" + kNumber + "}";
    }
    margins_template_ =
        stream_->AddTemplate(kMargins, "{\"timestamp\":" + kTime + ",\"margins\":[" + text + "]}");
  }
  stream_->Write(margins_template_, time, numbers_);
  measured.ForgetLast();
  margins_seen_ = false;
}

void RunRecorder::Event(double time, const std::string& kind, int step, const std::string& text,
                        const planning::Plan& plan) {
  const Value stamp = TimeValue(time);
  Text(kEvents, time,
       Value::Object()
           .Set("timestamp", stamp)
           .Set("time_s", time)
           .Set("kind", kind)
           .Set("step", step)
           .Set("action", ActionOf(plan, step))
           .Set("text", text));
  Text(kMessages, time,
       Value::Object()
           .Set("timestamp", stamp)
           .Set("level", LevelOf(kind))
           .Set("message", kind + (text.empty() ? "" : ": " + text))
           .Set("name", "tether")
           .Set("file", "")
           .Set("line", 0));
  if (kind != "grasped" && kind != "released") return;
  Text(kMarks, time, Value::Object().Set("timestamp", stamp).Set("kind", kind).Set("text", text));
}

void RunRecorder::Picture(double time, const std::string& path) {
  Text(kCamera, time,
       Value::Object()
           .Set("timestamp", TimeValue(time))
           .Set("frame_id", scene::kWorld)
           .Set("data", Base64(ReadFile(path)))
           .Set("format", "png"));
}

std::string RunRecorder::Finish(double time, const Value& report) {
  Text(kResult, time, Value::Object().Set("timestamp", TimeValue(time)).Set("report", report));
  return stream_->Close();
}

}  // namespace tether::evaluation
