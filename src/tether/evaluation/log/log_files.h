#pragma once

#include <map>
#include <string>

namespace tether::evaluation {

/// What this process has read so far, by absolute path, to be kept in a log: a run is judged again from the
/// scenario, PDDL, actions, robots and meshes that it was made of. Left out: shipped models, pipes and
/// devices, and files above 16 MiB.
std::map<std::string, std::string> FilesOfThisRun();

/// The files of a log as they can be read now: where they are, if they are still the same, else in a
/// temporary folder, which this removes. They keep their places relative to each other.
class LogFiles {
 public:
  explicit LogFiles(const std::map<std::string, std::string>& files);
  ~LogFiles();
  LogFiles(const LogFiles&) = delete;
  LogFiles& operator=(const LogFiles&) = delete;

  /// Where the file of this absolute path can be read.
  std::string PathOf(const std::string& path) const;

 private:
  std::string folder_;  ///< Empty: they are where they were.
};

}  // namespace tether::evaluation
