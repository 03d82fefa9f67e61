#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "targets.h"
#include "tether/bench/campaigns/campaign.h"
#include "tether/constraints/core/kind.h"
#include "tether/evaluation/check.h"
#include "tether/evaluation/log/log_channels.h"
#include "tether/evaluation/log/run_log.h"
#include "tether/evaluation/mcap/mcap_writer.h"
#include "tether/evaluation/report/figure.h"
#include "tether/evaluation/report/run_page.h"
#include "tether/geometry/hull/mesh_file.h"
#include "tether/geometry/hull/polytope.h"
#include "tether/planning/plan/plan_file.h"
#include "tether/planning/skeleton/action_reader.h"
#include "tether/robot/model.h"
#include "tether/scenario/events.h"
#include "tether/scenario/scenario.h"

namespace tether::fuzz {
namespace {

/// A folder of this process, for readers of paths. Left behind by a process that crashes.
class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / ("tether_fuzz_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::string Write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream(file, std::ios::binary) << text;
    return file.string();
  }

 private:
  std::filesystem::path path_;
};

void ReadMeshAs(const std::string& name, const std::string& input) {
  const Folder folder;
  const geometry::Mesh mesh = geometry::ReadMesh(folder.Write(name, input));
  geometry::EnclosedVolume(mesh);
  if (mesh.points.size() < 300) geometry::MakeHull(mesh.points);
}

constexpr const char* kScenarioFile = "/fuzz/scenario.yaml";

/// The scene that plans and events are read for; parsed once.
const scenario::Scenario& Stage() {
  static const scenario::Scenario scenario =
      scenario::LoadScenario(kScenarioFile, {{kScenarioFile,
                                              R"(format: tether.scenario/1
title: stage
objects:
  table: {shape: {box: [1, 1, 0.1]}, pose: {position: [0.5, 0, -0.05]}}
  shelf: {shape: {box: [0.3, 0.3, 0.1]}, pose: {position: [0.35, -0.3, 0.05]}}
  box: {shape: {box: [0.05, 0.05, 0.05]}, mass: 0.1, pose: {parent: table, position: [0, 0.1, 0.075]}}
  ball: {shape: {sphere: 0.03}, mass: 0.1, pose: {parent: shelf, position: [0, 0, 0.08]}}
regions:
  tray: {disc: 0.1, pose: {parent: table, position: [0, -0.1, 0.05]}}
actions: [manipulation]
)"}});
  return scenario;
}

constexpr const char* kArm = R"(<mujoco model="arm"><compiler angle="radian"/><worldbody>
<body name="upper"><inertial pos="0 0 0.1" mass="1" diaginertia="0.1 0.1 0.1"/>
<joint name="yaw" axis="0 0 1" range="-2 2" limited="true"/><geom type="capsule" size="0.03 0.1"/>
<body name="lower" pos="0 0 0.3"><inertial pos="0 0 0.1" mass="1" diaginertia="0.1 0.1 0.1"/>
<joint name="pitch" axis="0 1 0" range="-2 2" limited="true"/><geom type="box" size="0.03 0.03 0.1"/>
<site name="grasp" pos="0 0 0.2"/>
<body name="left" pos="0 0.02 0.15"><inertial pos="0 0 0" mass="0.1" diaginertia="0.1 0.1 0.1"/>
<joint name="left" type="slide" axis="0 1 0" range="0 0.05" limited="true"/><geom type="box" size="0.01 0.01 0.02"/></body>
</body></body></worldbody></mujoco>)";

}  // namespace

void ReadObjMesh(const std::string& input) { ReadMeshAs("mesh.obj", input); }
void ReadStlMesh(const std::string& input) { ReadMeshAs("mesh.stl", input); }

void ReadScenarioText(const std::string& input) {
  const std::vector<std::string> parts = Split(input, 3);
  const scenario::Scenario scenario = scenario::LoadScenario(
      kScenarioFile,
      {{kScenarioFile, parts[0]}, {"/fuzz/domain.pddl", parts[1]}, {"/fuzz/problem.pddl", parts[2]}});
  evaluation::CheckGeometry(scenario);
}

void ReadActionText(const std::string& input) {
  const Value document = ParseYaml(input, "actions");
  Diagnostics diagnostics;
  const auto actions =
      planning::ParseActions(document, {constraints::KindNames(), std::nullopt}, diagnostics);
  for (const planning::ActionSchema& action : actions) {
    for (const planning::StepSchema& step : action.steps) {
      for (const planning::Verb& verb : step.execute) planning::WriteVerb(verb);
      for (const planning::ConstraintSpec& spec : step.constraints) {
        if (const auto* kind = constraints::FindKind(spec.kind))
          constraints::ReadParameters(*kind, spec.parameters, diagnostics);
      }
    }
  }
  diagnostics.ThrowIfAny();
  for (const planning::ActionSchema& action : actions) planning::BindAction(action, action.parameters);
}

void ReadRobotText(const std::string& input) {
  const Folder folder;
  folder.Write("arm.xml", kArm);
  robot::Model::Load(folder.Write("robot.yaml", input));
}

void ReadPlanText(const std::string& input) {
  const scenario::Scenario& stage = Stage();
  Diagnostics diagnostics;
  const Value document = ParseYaml(input, "plan");
  planning::ReadPlanOrigin(document);
  const planning::Plan plan = planning::ParsePlan(document, stage.scene, stage.actions, diagnostics);
  diagnostics.ThrowIfAny();
  const Value written = planning::WritePlan(plan, {}, stage.scene, stage.actions);
  const planning::Plan again =
      planning::ParsePlan(ParseYaml(WriteJson(written), "written"), stage.scene, stage.actions, diagnostics);
  diagnostics.ThrowIfAny();
  // But for the last digits of quaternions.
  Require(again.actions == plan.actions && again.steps.size() == plan.steps.size() && again.cost == plan.cost,
          "a plan is read as it was written");
}

void ReadEventText(const std::string& input) {
  const scenario::Scenario& stage = Stage();
  Diagnostics diagnostics;
  for (const scenario::Event& event :
       scenario::ParseEvents(ParseYaml(input, "events"), {&stage.scene, &stage.actions}, diagnostics))
    event.Describe();
  diagnostics.ThrowIfAny();
}

namespace {

/// A log with a message per line of "topic text", so that what is in messages is reached beyond checksums.
std::string ComposeLog(const std::string& lines) {
  evaluation::McapWriter writer("fuzz");
  writer.AddMetadata(evaluation::kLogMetadata, {{"format", evaluation::kLogFormat}, {"seed", "1"}});
  std::map<std::string, uint16_t> channels;
  for (const evaluation::LogChannel& channel : evaluation::LogChannels()) {
    const uint16_t schema = writer.AddSchema({channel.schema_name, "jsonschema", channel.schema});
    channels[channel.topic] = writer.AddChannel({channel.topic, schema, "json"});
  }
  std::istringstream stream(lines);
  uint64_t time = 0;
  for (std::string line; std::getline(stream, line); time += 50'000'000) {
    const size_t space = std::min(line.find(' '), line.size());
    const auto channel = channels.find(line.substr(0, space));
    if (channel != channels.end()) writer.AddMessage(channel->second, time, line.substr(space));
    if (line.size() % 7 == 0) writer.CloseChunk();
  }
  writer.Finish();
  return writer.Take();
}

}  // namespace

void ReadLogText(const std::string& input) {
  const bool whole = evaluation::IsMcap(input);
  const std::string bytes = whole ? input : ComposeLog(input);
  const evaluation::RunLog log = evaluation::ParseRunLog(bytes, "log", true);
  evaluation::DrawRunLog(log);
  evaluation::WriteRunPage(log);
  if (whole) return;
  Require(!log.problem, "what the writer wrote is read to its end");
  // Cut off anywhere, what is left of it says so.
  try {
    const std::string_view part =
        std::string_view(bytes).substr(0, bytes.size() * (input.size() % 97 + 1) / 98);
    const evaluation::RunLog cut = evaluation::ParseRunLog(part, "log", true);
    Require(cut.problem.has_value(), "a log that was cut off says where");
    Require(cut.events.size() <= log.events.size(), "a part holds no more than the whole");
  } catch (const InputError&) {
    // It was cut off within its first records.
  }
}

void ReadCampaignLines(const std::string& input) {
  const Folder folder;
  const std::atomic<bool> stop = true;  // Lines are read, nothing is measured.
  for (const char* name : {"robustness", "quality", "growth", "warm", "execution", "control"}) {
    bench::CampaignOptions options;
    options.name = name;
    options.output = folder.Write(std::string(name) + ".jsonl", input);
    options.stop = &stop;
    try {
      const Value summary = bench::SummarizeCampaign(options, bench::RunCampaign(options));
      WriteJson(summary);
      bench::CampaignTable(summary);
    } catch (const InputError&) {
      // Of another campaign, or none.
    }
  }
}

}  // namespace tether::fuzz
