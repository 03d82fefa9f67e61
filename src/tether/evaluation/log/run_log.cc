#include "tether/evaluation/log/run_log.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

#include "tether/common/error.h"
#include "tether/evaluation/log/log_channels.h"
#include "tether/scene/scene.h"

namespace tether::evaluation {
namespace {

constexpr const char* kHandSuffix = "/hand";
constexpr const char* kTarget = "target";

double NumberOf(const Value& map, const char* key) {
  const Value* value = map.Find(key);
  return value != nullptr && value->kind() == Value::Kind::kNumber ? value->number() : std::nan("");
}
std::string TextOf(const Value& map, const char* key) {
  const Value* value = map.Find(key);
  return value == nullptr ? "" : value->AsText();
}
int WholeOf(const Value& map, const char* key) {
  const Value* value = map.Find(key);
  return value != nullptr && value->is_integer() && std::abs(value->integer()) < 1'000'000'000
             ? static_cast<int>(value->integer())
             : -1;
}
const std::vector<Value>& ItemsOf(const Value& map, const char* key) {
  static const std::vector<Value> kNone;
  const Value* value = map.Find(key);
  return value == nullptr ? kNone : value->items();
}

/// The pose of a foxglove.FrameTransform; none if it has none.
std::optional<math::Pose> PoseOf(const Value& transform) {
  const Value *p = transform.Find("translation"), *q = transform.Find("rotation");
  if (p == nullptr || q == nullptr) return std::nullopt;
  const Eigen::Vector3d at(NumberOf(*p, "x"), NumberOf(*p, "y"), NumberOf(*p, "z"));
  const Eigen::Quaterniond turn(NumberOf(*q, "w"), NumberOf(*q, "x"), NumberOf(*q, "y"), NumberOf(*q, "z"));
  if (!at.allFinite() || !turn.coeffs().allFinite() || turn.norm() < 0.5 || turn.norm() > 2)
    return std::nullopt;
  return math::Pose(turn, at);
}

class LogReader : public McapHandler {
 public:
  LogReader(RunLog& log, bool with_samples) : log_(log), with_samples_(with_samples) {}

  void OnMetadata(const std::string& name, const std::map<std::string, std::string>& values,
                  uint64_t offset) override {
    if (name != kLogMetadata) return;
    const auto format = values.find("format");
    if (format == values.end() || format->second != kLogFormat) {
      throw InputError({{Location{log_.file, 0, 0},
                         "the log is in format '" + (format == values.end() ? "" : format->second) +
                             "' (metadata record at byte " + std::to_string(offset) + ")",
                         std::string(kLogFormat) + ", as this version of Tether writes it"}});
    }
    log_.metadata = values;
  }

  void OnAttachment(const std::string& name, std::string_view data, uint64_t) override {
    log_.files[name] = data;
  }

  void OnMessage(const McapChannel& channel, const McapSchema&, uint64_t time, std::string_view data,
                 uint64_t offset) override {
    if (log_.metadata.empty()) RequireMetadata();
    const double at = 1e-9 * static_cast<double>(time);
    log_.end = std::max(log_.end, at);
    const std::string& topic = channel.topic;
    if (!with_samples_ && (topic == "/tf" || topic == "/tf_static" || topic == "/contacts")) return;
    if (topic == "/scene" || topic == "/camera" || topic == "/commands" || topic == "/log") return;
    Value message;
    try {
      message = ParseYaml(data, "message");
    } catch (const InputError& error) {
      throw InputError({{Location{log_.file, 0, 0},
                         "a message of " + topic + " (in the chunk at byte " + std::to_string(offset) +
                             ") is no JSON: " + error.what(),
                         "a log as tether run --log writes it"}});
    }
    Take(topic, at, message);
  }

  void RequireMetadata() const {
    if (!log_.metadata.empty()) return;
    throw InputError({{Location{log_.file, 0, 0},
                       log_.problem ? "the file holds nothing of a run: " + log_.problem->text + " (byte " +
                                          std::to_string(log_.problem->offset) + ")"
                                    : "this MCAP file is not the log of a run: it has no metadata 'tether'",
                       "a log as tether run --log writes it"}});
  }

  /// What was begun and is not whole is left out.
  void Finish() {
    if (!log_.samples.empty() && !sample_complete_) log_.samples.pop_back();
    log_.series.insert(log_.series.end(), joints_.begin(), joints_.end());
  }

 private:
  void Take(const std::string& topic, double time, const Value& message) {
    if (topic == "/margins") TakeMargins(time, message);
    if (topic == "/joints") TakeJoints(time, message);
    if (topic == "/robots") TakeRobots(message);
    if (topic == "/state") TakeState(message);
    if (topic == "/tf_static") TakeStatic(message);
    if (topic == "/tf") TakeTransforms(time, message);
    if (topic == "/contacts") TakeContacts(message);
    if (topic == "/marks") log_.marks.emplace_back(time, TextOf(message, "text"));
    if (topic == "/events") {
      log_.events.push_back({time, TextOf(message, "kind"), WholeOf(message, "step"),
                             TextOf(message, "action"), TextOf(message, "text")});
    }
    if (const Value* plan = message.Find("plan"); topic == "/plan" && plan != nullptr)
      log_.plans.push_back(*plan);
    if (const Value* report = message.Find("report"); topic == "/result" && report != nullptr)
      log_.report = *report;
  }

  void TakeMargins(double time, const Value& message) {
    for (const Value& margin : ItemsOf(message, "margins")) {
      std::string name = TextOf(margin, "name"), group = TextOf(margin, "group");
      const auto [found, added] = margin_series_.try_emplace({group, name}, log_.series.size());
      if (added)
        log_.series.push_back({std::move(name), TextOf(margin, "unit"), "Room left: " + group, {}, {}, 0, 0});
      LogSeries& series = log_.series[found->second];
      series.times.push_back(time);
      series.values.push_back(NumberOf(margin, "least"));
    }
  }

  void TakeRobots(const Value& message) {
    const std::vector<Value>& robots = ItemsOf(message, "robots");
    for (const Value& robot : robots) {
      const std::string name = TextOf(robot, "name");
      for (const Value& joint : ItemsOf(robot, "joints")) {
        const std::string own = TextOf(joint, "name"), full = name + "/" + own;
        if (!joint_series_.try_emplace(full, joints_.size()).second) continue;
        joints_.push_back({robots.size() > 1 ? full : own, "share of the range", "Joints", {}, {}, -1, 1});
        ranges_.emplace_back(NumberOf(joint, "lower"), NumberOf(joint, "upper"));
      }
    }
  }

  void TakeJoints(double time, const Value& message) {
    for (const Value& joint : ItemsOf(message, "joints")) {
      const auto found = joint_series_.find(TextOf(joint, "name"));
      if (found == joint_series_.end()) continue;
      const auto [lower, upper] = ranges_[found->second];
      joints_[found->second].times.push_back(time);
      joints_[found->second].values.push_back(
          (NumberOf(joint, "position") - lower) / (0.5 * (upper - lower)) - 1);
    }
  }

  void TakeState(const Value& message) {
    actions_done_ = WholeOf(message, "actions_done");
    const Value* running = message.Find("running");
    running_ = running != nullptr && running->boolean();
  }

  void TakeStatic(const Value& message) {
    for (const Value& transform : ItemsOf(message, "transforms")) {
      const std::optional<math::Pose> X = PoseOf(transform);
      if (X && TextOf(transform, "parent_frame_id") == scene::kWorld)
        fixed_[TextOf(transform, "child_frame_id")] = *X;
    }
  }

  void TakeTransforms(double time, const Value& message) {
    if (!log_.samples.empty() && !sample_complete_) log_.samples.pop_back();
    LogSample sample;
    sample.time = time;
    sample.X_WO = fixed_;
    sample.actions_done = actions_done_;
    sample.running = running_;
    sample.plan = log_.plans.empty() ? 0 : log_.plans.size() - 1;
    for (const Value& transform : ItemsOf(message, "transforms")) {
      const std::string parent = TextOf(transform, "parent_frame_id"),
                        child = TextOf(transform, "child_frame_id");
      const std::optional<math::Pose> X = PoseOf(transform);
      if (!X) continue;
      if (parent == scene::kWorld && child != kTarget) sample.X_WO[child] = *X;
      const auto base = fixed_.find(parent);
      if (base != fixed_.end() && child == parent + kHandSuffix) sample.X_WHand[parent] = base->second * *X;
    }
    log_.samples.push_back(std::move(sample));
    sample_complete_ = false;
  }

  void TakeContacts(const Value& message) {
    if (log_.samples.empty()) return;
    for (const Value& contact : ItemsOf(message, "contacts")) {
      const double force = NumberOf(contact, "force");
      log_.samples.back().contacts.push_back(
          {TextOf(contact, "a"), TextOf(contact, "b"), std::isfinite(force) ? force : 0});
    }
    sample_complete_ = true;
  }

  RunLog& log_;
  bool with_samples_;
  std::map<std::pair<std::string, std::string>, size_t> margin_series_;
  std::map<std::string, size_t> joint_series_;
  std::vector<LogSeries> joints_;
  std::vector<std::pair<double, double>> ranges_;
  std::map<std::string, math::Pose> fixed_;
  int actions_done_ = 0;
  bool running_ = false, sample_complete_ = true;
};

[[noreturn]] void RefuseOld(const std::string& file, std::string_view begin) {
  const bool old = begin.find("tether.log/1") != std::string_view::npos;
  throw InputError(
      {{Location{file, 0, 0},
        old ? "the log is in format 'tether.log/1', in which Tether no longer writes and reads logs"
            : "this is not the log of a run: it does not begin as an MCAP file does",
        old ? "an MCAP file: run the scenario again with its seed, as in tether run SCENARIO --seed S --log "
              "FILE.mcap; what drew this log is the version that wrote it"
            : "an MCAP file as tether run --log writes it"}});
}

RunLog Read(const ByteSource& source, const std::string& file, bool with_samples) {
  RunLog log;
  log.file = file;
  // What the file begins with tells an old log, and is handed over again.
  std::string begin(256, '\0');
  begin.resize(source(begin.data(), begin.size()));
  if (!begin.empty() && !IsMcap(begin)) RefuseOld(file, begin);
  size_t used = 0;
  const ByteSource from_begin = [&](char* buffer, size_t size) {
    const size_t held = std::min(size, begin.size() - used);
    std::memcpy(buffer, begin.data() + used, held);
    used += held;
    return held == size ? held : held + source(buffer + held, size - held);
  };
  LogReader reader(log, with_samples);
  log.problem = ReadMcap(from_begin, file, reader);
  reader.RequireMetadata();
  reader.Finish();
  return log;
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

std::string RunLog::Metadata(const std::string& key) const {
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : found->second;
}

bool IsMcap(std::string_view first_bytes) {
  // Without the version, about which the reader has more to say.
  const size_t common = std::min<size_t>(first_bytes.size(), 5);
  return !first_bytes.empty() && first_bytes.substr(0, common) == kMcapMagic.substr(0, common);
}

RunLog ReadRunLog(const std::string& path, bool with_samples) {
  const auto fail = [&] {
    throw InputError({{Location{path, 0, 0},
                       std::string("cannot read this file: ") + std::strerror(errno),  // NOLINT: glibc's
                       "the log of a run"}});
  };
  const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "rbe"));
  if (file == nullptr) fail();
  const ByteSource source = [&](char* buffer, size_t size) {
    const size_t got = std::fread(buffer, 1, size, file.get());
    if (std::ferror(file.get()) != 0) fail();
    return got;
  };
  return Read(source, path, with_samples);
}

RunLog ParseRunLog(std::string_view bytes, const std::string& file, bool with_samples) {
  return Read(BytesOf(bytes), file, with_samples);
}

}  // namespace tether::evaluation
