#include "targets.h"

namespace tether::fuzz {

const std::vector<Target>& Targets() {
  static const std::vector<Target> targets = {
      {"pddl", "a domain and a problem", ReadPddlText},
      {"formula", "a temporal formula, and its automaton where that is small", ReadFormulaText},
      {"yaml", "YAML documents", ReadYamlText},
      {"json", "JSON documents", ReadYamlText},
      {"mesh_obj", "Wavefront OBJ files", ReadObjMesh},
      {"mesh_stl", "STL files, text and binary", ReadStlMesh},
      {"scenario", "a scenario with its PDDL files", ReadScenarioText},
      {"actions", "action libraries", ReadActionText},
      {"robot", "robot descriptions", ReadRobotText},
      {"plan", "plan files", ReadPlanText},
      {"events", "event files", ReadEventText},
      {"log", "logs of runs, and their figures", ReadLogText},
      {"campaign", "the lines of a campaign that is continued", ReadCampaignLines},
  };
  return targets;
}

std::vector<std::string> Split(const std::string& input, size_t parts) {
  static const std::string kMark = "%%\n";
  std::vector<std::string> all(parts);
  size_t begin = 0;
  for (size_t i = 0; i < parts; ++i) {
    size_t end = begin;
    for (end = input.find(kMark, begin); end != std::string::npos && end > 0 && input[end - 1] != '\n';)
      end = input.find(kMark, end + 1);
    if (end == std::string::npos || i + 1 == parts) {
      all[i] = input.substr(begin);
      break;
    }
    all[i] = input.substr(begin, end - begin);
    begin = end + kMark.size();
  }
  return all;
}

}  // namespace tether::fuzz
