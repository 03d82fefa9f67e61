#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tether::fuzz {

/// A reader under test. Any text is read or refused with an InputError: anything else is a finding.
struct Target {
  const char* name;
  const char* what;
  void (*read)(const std::string& input);
};

/// Every reader. Several files of one are one input, separated by lines of two percent signs.
const std::vector<Target>& Targets();

/// A law that what was read must keep, such as that writing and reading change nothing.
class BrokenLaw : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};
inline void Require(bool holds, const std::string& law) {
  if (!holds) throw BrokenLaw(law);
}

/// The parts of an input; as many as are asked for, the missing ones empty.
std::vector<std::string> Split(const std::string& input, size_t parts);

// The readers, by what they need.
void ReadPddlText(const std::string& input);
void ReadFormulaText(const std::string& input);
void ReadYamlText(const std::string& input);
void ReadObjMesh(const std::string& input);
void ReadStlMesh(const std::string& input);
void ReadScenarioText(const std::string& input);
void ReadActionText(const std::string& input);
void ReadRobotText(const std::string& input);
void ReadPlanText(const std::string& input);
void ReadEventText(const std::string& input);
void ReadLogText(const std::string& input);
void ReadCampaignLines(const std::string& input);

}  // namespace tether::fuzz
