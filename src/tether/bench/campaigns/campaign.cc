#include "tether/bench/campaigns/campaign.h"

#include <algorithm>
#include <map>

#include "tether/bench/campaigns/campaign_control.h"
#include "tether/bench/campaigns/campaign_disturbed.h"
#include "tether/bench/campaigns/campaign_execution.h"
#include "tether/bench/campaigns/campaign_scene.h"
#include "tether/common/error.h"
#include "tether/common/limits.h"
#include "tether/common/output/output_header.h"
#include "tether/common/output/record_file.h"
#include "tether/common/stop.h"
#include "tether/robot/model.h"

namespace tether::bench {
namespace {

constexpr int kIpoptScenes = 50;
constexpr int kMostScenes = 1000000;
constexpr int kExecutedScenes = 67;  // of each of three kinds: 200 and one
constexpr int kMotionScenes = 100;   // of each of those
constexpr int kSeededRuns = 30;
constexpr int kFewestBlocks = 3, kMostBlocks = 7;

/// Kinds that ask for the motion of the whole arm: only where they are named.
bool IsAboutMotion(const std::string& kind) { return kind == "around" || kind == "posts" || kind == "shelf"; }

int ScenesOf(const CampaignOptions& options, const std::string& kind) {
  if (options.scenes) return *options.scenes;
  if (kind == "seeds") return kSeededRuns;
  if (options.name == "execution") return IsAboutMotion(kind) ? kMotionScenes : kExecutedScenes;
  return options.name == "robustness" ? 1000 : options.name == "growth" ? 1 : 100;
}

std::vector<std::string> KindsOf(const std::string& campaign) {
  if (campaign == "execution") return {"reach", "stack", "clutter", "around", "posts", "shelf"};
  if (campaign == "control") return {"seeds", "moved", "crossing"};
  if (campaign == "disturbed")
    return {"workspace_reach", "stacking", "tool_use", "hanoi", "parts", "cups", "assistive"};
  return {"reach", "stack"};
}

std::string ScenarioOf(const CampaignOptions& options) {
  return options.scenario.empty() ? robot::DataDirectory() + "/scenarios/assistive.yaml" : options.scenario;
}

std::vector<CampaignScene> Scenes(const CampaignOptions& options) {
  std::vector<CampaignScene> scenes;
  if (options.name == "growth") {
    const auto count = static_cast<uint64_t>(ScenesOf(options, "hanoi"));
    for (int blocks = kFewestBlocks; blocks <= kMostBlocks; ++blocks) {
      for (uint64_t i = 0; i < count; ++i) scenes.push_back({"hanoi", blocks, options.seed + i});
    }
    return scenes;
  }
  for (const std::string& kind : KindsOf(options.name)) {
    const auto& kinds = options.kinds;
    if (kinds.empty() ? IsAboutMotion(kind) : std::find(kinds.begin(), kinds.end(), kind) == kinds.end())
      continue;
    const auto count = static_cast<uint64_t>(ScenesOf(options, kind));
    for (uint64_t i = 0; i < count; ++i) {
      const uint64_t seed = options.seed + i;
      const bool stack = kind == "stack";
      scenes.push_back({kind, stack ? 3 + static_cast<int>(seed % 3) : 0, seed});
    }
  }
  return scenes;
}

std::optional<Value> MeasureScene(const CampaignOptions& options, const CampaignScene& scene) {
  SceneMeasurementOptions measurement;
  measurement.restarts = options.restarts;
  measurement.stop = options.stop;
  if (options.name == "quality") return MeasureQuality(scene, measurement);
  if (options.name == "warm") return MeasureWarmStart(scene, measurement);
  if (options.name == "growth") return MeasureGrowth(scene, measurement);
  if (options.name == "execution") return MeasureExecution(scene, options.no_robot, options.stop);
  if (options.name == "disturbed") return MeasureDisturbed(scene, options.stop);
  if (options.name == "control")
    return MeasureControl(scene, ScenarioOf(options), options.command, options.stop);
  measurement.ipopt = scene.seed < options.seed + kIpoptScenes;
  return MeasureRobustness(scene, measurement);
}

/// None if it was interrupted.
std::optional<Value> Measure(const CampaignOptions& options, const CampaignScene& scene) {
  try {
    return MeasureScene(options, scene);
  } catch (const LimitReached& reached) {
    if (reached.limit() == Limit::kInterrupted) return std::nullopt;
    throw;
  }
}

std::string LabelOf(const Value& record) {
  const auto integer = [&](const char* key) {
    const Value* value = record.Find(key);
    return value == nullptr ? 0 : value->natural().value_or(0);
  };
  const Value* kind = record.Find("kind");
  return CampaignScene{kind == nullptr ? "" : kind->AsText(), static_cast<int>(integer("blocks")),
                       integer("seed")}
      .Label();
}

Value HeaderOf(const CampaignOptions& options) {
  Value header = OutputHeader("tether.campaign_records/1", options.seed)
                     .Set("name", options.name)
                     .Set("restarts", options.restarts);
  if (options.name == "execution") header.Set("no_robot", options.no_robot);
  if (options.name == "control" && !options.scenario.empty()) header.Set("scenario", options.scenario);
  if (!options.command.empty()) header.Set("command", options.command);
  return header;
}

/// The finished scenes by their labels, after the header.
std::map<std::string, Value> RecordsOf(const RecordFile& file) {
  std::map<std::string, Value> records;
  for (const Value& record : file.earlier()) records[LabelOf(record)] = record;
  return records;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> CampaignNames() {
  return {
      {"robustness", "how many random scenes are solved, of those that can be; 1000 of each kind"},
      {"quality", "the cost against the best of random restarts; 100 of each kind"},
      {"warm", "solving again after an object was moved, from what was found before; 100 of each kind"},
      {"growth", "time per step and live object, for Hanoi with 3 to 7 blocks; 1 of each size"},
      {"execution",
       "plans with the arm, executed in the simulation; 67 each of reach, stack and clutter, or 100 each of "
       "around, posts and shelf"},
      {"control",
       "one scenario, with velocities or torques: 30 seeds, 100 with an obstacle moved, 100 with one "
       "crossing"},
      {"disturbed",
       "the shipped scenes under random disturbances, and which limits were passed; 100 of each"}};
}

void CampaignOptions::Validate() const {
  Diagnostics diagnostics;
  std::vector<std::string> names;
  for (const auto& [known, text] : CampaignNames()) names.push_back(known);
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    diagnostics.Add({}, "unknown campaign '" + name + "'", SuggestFrom(name, names));
  }
  for (const std::string& kind : kinds) {
    if (name == "growth") {
      diagnostics.Add({}, "--kind has no effect on campaign 'growth'", "its scenes are towers of Hanoi");
      continue;
    }
    const std::vector<std::string> kinds_of = KindsOf(name);
    if (std::find(kinds_of.begin(), kinds_of.end(), kind) == kinds_of.end())
      diagnostics.Add({}, "--kind is '" + kind + "'",
                      kinds_of.size() == 2 ? "reach or stack" : JoinAlternatives(kinds_of));
  }
  if (!scenario.empty() && name != "control")
    diagnostics.Add({}, "--scenario has no effect on campaign '" + name + "'", "with campaign 'control'");
  if (!command.empty() && name != "control") {
    diagnostics.Add({}, "--command has no effect on campaign '" + name + "'", "with campaign 'control'");
  } else if (!command.empty() && command != "velocity" && command != "torque") {
    diagnostics.Add({}, "--command is '" + command + "'", "velocity or torque");
  }
  if (no_robot && (name == "control" || name == "disturbed"))
    diagnostics.Add({}, "--no-robot has no effect on campaign '" + name + "'",
                    "its plans are executed by an arm");
  else if (no_robot && name != "execution")
    diagnostics.Add({}, "--no-robot has no effect on campaign '" + name + "'",
                    "it plans without the arm anyway");
  if (scenes && (*scenes < 1 || *scenes > kMostScenes))
    diagnostics.Add({}, "--scenes is " + std::to_string(*scenes),
                    *scenes < 1 ? "1 or more" : "up to 1000000");
  if (restarts < 1) diagnostics.Add({}, "--restarts is " + std::to_string(restarts), "1 or more");
  if (seed > static_cast<uint64_t>(INT64_MAX) / 2)
    diagnostics.Add({}, "--seed is " + std::to_string(seed), "up to 2^62");
  diagnostics.ThrowIfAny();
}

CampaignResult RunCampaign(const CampaignOptions& options, const RecordCallback& on_record) {
  options.Validate();
  RecordFile file(options.output, HeaderOf(options));
  const std::map<std::string, Value> earlier_records = RecordsOf(file);
  CampaignResult result;
  const std::vector<CampaignScene> scenes = Scenes(options);
  for (size_t i = 0; i < scenes.size(); ++i) {
    const auto earlier = earlier_records.find(scenes[i].Label());
    if (earlier != earlier_records.end()) {
      result.records.push_back(earlier->second);
    } else {
      std::optional<Value> record;
      if (!IsStopped(options.stop)) record = Measure(options, scenes[i]);
      if (!record) {
        result.interrupted = true;
        return result;
      }
      file.Append(*record);
      result.records.push_back(std::move(*record));
    }
    if (on_record) on_record(static_cast<int>(i) + 1, static_cast<int>(scenes.size()), result.records.back());
  }
  return result;
}

}  // namespace tether::bench
