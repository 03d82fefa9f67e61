#include "tether/experiment/campaign.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>

#include "tether/common/error.h"
#include "tether/experiment/campaign_control.h"
#include "tether/experiment/campaign_execution.h"
#include "tether/experiment/campaign_scene.h"
#include "tether/experiment/plan_output.h"
#include "tether/robot/model.h"

namespace tether::experiment {
namespace {

constexpr int kIpoptScenes = 50;
constexpr int kExecutedScenes = 67;  // of each of three kinds: 200 and one
constexpr int kSeededRuns = 30;
constexpr int kFewestBlocks = 3, kMostBlocks = 7;

bool Stopped(const CampaignOptions& options) { return options.stop != nullptr && options.stop->load(); }

int ScenesOf(const CampaignOptions& options, const std::string& kind) {
  if (options.scenes) return *options.scenes;
  if (kind == "seeds") return kSeededRuns;
  if (options.name == "execution") return kExecutedScenes;
  return options.name == "robustness" ? 1000 : options.name == "growth" ? 1 : 100;
}

std::vector<std::string> KindsOf(const std::string& campaign) {
  if (campaign == "execution") return {"reach", "stack", "clutter"};
  if (campaign == "control") return {"seeds", "moved", "crossing"};
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
    if (!kinds.empty() && std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) continue;
    const auto count = static_cast<uint64_t>(ScenesOf(options, kind));
    for (uint64_t i = 0; i < count; ++i) {
      const uint64_t seed = options.seed + i;
      const bool stack = kind == "stack";
      scenes.push_back({kind, stack ? 3 + static_cast<int>(seed % 3) : 0, seed});
    }
  }
  return scenes;
}

std::optional<Value> Measure(const CampaignOptions& options, const CampaignScene& scene) {
  SceneMeasurementOptions measurement;
  measurement.restarts = options.restarts;
  measurement.stop = options.stop;
  if (options.name == "quality") return MeasureQuality(scene, measurement);
  if (options.name == "warm") return MeasureWarmStart(scene, measurement);
  if (options.name == "growth") return MeasureGrowth(scene, measurement);
  if (options.name == "execution") return MeasureExecution(scene, options.no_robot, options.stop);
  if (options.name == "control") return MeasureControl(scene, ScenarioOf(options), options.stop);
  measurement.ipopt = scene.seed < options.seed + kIpoptScenes;
  return MeasureRobustness(scene, measurement);
}

std::string LabelOf(const Value& record) {
  const auto integer = [&](const char* key) {
    const Value* value = record.Find(key);
    return value == nullptr ? 0 : value->integer();
  };
  const Value* kind = record.Find("kind");
  return CampaignScene{kind == nullptr ? "" : kind->AsText(), static_cast<int>(integer("blocks")),
                       static_cast<uint64_t>(integer("seed"))}
      .Label();
}

/// The file with a line per scene: a header first, then one record each.
class RecordFile {
 public:
  explicit RecordFile(const CampaignOptions& options) : path_(options.output) {
    if (path_.empty()) return;
    Value header = OutputHeader("tether.campaign_records/1", options.seed)
                       .Set("name", options.name)
                       .Set("restarts", options.restarts);
    if (options.name == "execution") header.Set("no_robot", options.no_robot);
    if (options.name == "control" && !options.scenario.empty()) header.Set("scenario", options.scenario);
    std::error_code error;
    if (std::filesystem::is_directory(path_, error)) {
      throw InputError("--output: '" + path_ + "' is a folder", "a file");
    }
    bool begun = std::filesystem::exists(path_, error) && std::filesystem::file_size(path_, error) > 0;
    if (begun) begun = ReadRecords(header);
    file_.reset(std::fopen(path_.c_str(), "a"));
    if (file_ == nullptr)
      throw InputError("--output: cannot write '" + path_ + "'", "a path in a writable folder");
    if (!begun) Append(header);
  }

  /// The record of a scene that was finished earlier, or null.
  const Value* Find(const std::string& label) const {
    const auto found = records_.find(label);
    return found == records_.end() ? nullptr : &found->second;
  }
  void Append(const Value& record) {
    if (file_ == nullptr) return;
    const std::string line = WriteJson(record, 0) + "\n";
    if (std::fwrite(line.data(), 1, line.size(), file_.get()) != line.size() ||
        std::fflush(file_.get()) != 0) {
      throw InputError("--output: cannot write '" + path_ + "'", "a disk with room");
    }
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  /// False if not even the header is whole.
  bool ReadRecords(const Value& header) {
    std::string text = ReadFile(path_);
    // A line that was being written when the program was killed is measured again.
    const size_t end = text.rfind('\n') + 1;
    if (end < text.size()) {
      std::filesystem::resize_file(path_, end);
      text.resize(end);
    }
    int number = 0;
    for (size_t begin = 0; begin < text.size();) {
      const size_t line_end = text.find('\n', begin);
      ++number;
      const Value line = ParseLine(text.substr(begin, line_end - begin), number);
      begin = line_end + 1;
      if (number == 1) {
        CheckHeader(line, header);
      } else {
        records_[LabelOf(line)] = line;
      }
    }
    return number > 0;
  }

  Value ParseLine(const std::string& text, int number) const {
    const Location where{path_, number, 0};
    try {
      Value line = ParseYaml(text, path_);
      if (line.is_object()) return line;
    } catch (const InputError&) {  // said below, with the right line
    }
    throw InputError({{where, "this is no line of a campaign", "the file of a campaign, or a new one"}});
  }

  void CheckHeader(const Value& line, const Value& header) const {
    Diagnostics diagnostics;
    for (const Value::Member& member : header.members()) {
      const Value* found = line.Find(member.key);
      const std::string before = found == nullptr ? "nothing" : found->AsText();
      if (before == member.value.AsText()) continue;
      diagnostics.Add({path_, 1, 0}, "this campaign has " + member.key + " '" + before + "'",
                      "'" + member.value.AsText() + "', as asked for now; or another file");
    }
    diagnostics.ThrowIfAny();
  }

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::map<std::string, Value> records_;
};

}  // namespace

std::vector<std::pair<std::string, std::string>> CampaignNames() {
  return {
      {"robustness", "how many random scenes are solved, of those that can be; 1000 of each kind"},
      {"quality", "the cost against the best of random restarts; 100 of each kind"},
      {"warm", "solving again after an object was moved, from what was found before; 100 of each kind"},
      {"growth", "time per step and live object, for Hanoi with 3 to 7 blocks; 1 of each size"},
      {"execution", "plans with the arm, executed in the simulation; 67 each of reach, stack and clutter"},
      {"control",
       "the velocity controller: runs from 30 seeds, 100 with an obstacle moved, 100 with one crossing"}};
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
      diagnostics.Add({}, "--kind says nothing to campaign 'growth'", "its scenes are towers of Hanoi");
      continue;
    }
    const std::vector<std::string> kinds_of = KindsOf(name);
    if (std::find(kinds_of.begin(), kinds_of.end(), kind) == kinds_of.end())
      diagnostics.Add({}, "--kind is '" + kind + "'",
                      kinds_of.size() == 2 ? "reach or stack" : JoinAlternatives(kinds_of));
  }
  if (!scenario.empty() && name != "control")
    diagnostics.Add({}, "--scenario says nothing to campaign '" + name + "'", "with campaign 'control'");
  if (no_robot && name == "control")
    diagnostics.Add({}, "--no-robot says nothing to campaign 'control'", "its plans are executed by an arm");
  else if (no_robot && name != "execution")
    diagnostics.Add({}, "--no-robot says nothing to campaign '" + name + "'",
                    "it plans without the arm anyway");
  if (scenes && *scenes < 1) diagnostics.Add({}, "--scenes is " + std::to_string(*scenes), "1 or more");
  if (restarts < 1) diagnostics.Add({}, "--restarts is " + std::to_string(restarts), "1 or more");
  if (seed > static_cast<uint64_t>(INT64_MAX) / 2)
    diagnostics.Add({}, "--seed is " + std::to_string(seed), "up to 2^62");
  diagnostics.ThrowIfAny();
}

CampaignResult RunCampaign(const CampaignOptions& options, const RecordCallback& on_record) {
  options.Validate();
  RecordFile file(options);
  CampaignResult result;
  const std::vector<CampaignScene> scenes = Scenes(options);
  for (size_t i = 0; i < scenes.size(); ++i) {
    const Value* earlier = file.Find(scenes[i].Label());
    if (earlier != nullptr) {
      result.records.push_back(*earlier);
    } else {
      std::optional<Value> record;
      if (!Stopped(options)) record = Measure(options, scenes[i]);
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

}  // namespace tether::experiment
