#include "tether/scenario/scenario_reading.h"

#include <algorithm>
#include <filesystem>

#include "tether/common/file.h"

namespace tether::scenario {

namespace fs = std::filesystem;

std::string ReadChoice(ObjectReader& reader, std::string_view key, const std::vector<std::string>& accepted,
                       const std::string& fallback) {
  const Value* value = reader.Optional(key);
  if (value == nullptr) return fallback;
  const std::string text =
      ReadText(*value, "'" + std::string(key) + "' of " + reader.what(), reader.diagnostics());
  if (std::find(accepted.begin(), accepted.end(), text) != accepted.end()) return text;
  reader.diagnostics().Add(value->where(),
                           "'" + std::string(key) + "' of " + reader.what() + " is '" + text + "'",
                           SuggestFrom(text, accepted));
  return fallback;
}

double ReadBound(ObjectReader& reader, std::string_view key, double fallback, const std::string& accepted,
                 double most) {
  const double number = reader.Number(key, fallback);
  if (number > most) {
    reader.diagnostics().Add(
        reader.value().Find(key)->where(),
        "'" + std::string(key) + "' of " + reader.what() + " is " + reader.value().Find(key)->AsText(),
        "at most " + Value(most).AsText());
    return fallback;
  }
  if (number >= 0) return number;
  reader.diagnostics().Add(reader.value().Find(key)->where(),
                           "'" + std::string(key) + "' of " + reader.what() + " is negative", accepted);
  return fallback;
}

int ReadCount(ObjectReader& reader, std::string_view key, int fallback, int least,
              const std::string& accepted) {
  const int number = reader.Integer(key, fallback);
  if (number >= least) return number;
  reader.diagnostics().Add(reader.value().Find(key)->where(),
                           "'" + std::string(key) + "' of " + reader.what() + " is " + std::to_string(number),
                           accepted);
  return fallback;
}

ScenarioFiles::ScenarioFiles(const std::string& scenario_path,
                             const std::map<std::string, std::string>& texts)
    : texts_(texts), folder_(fs::path(scenario_path).parent_path().string()) {}

std::string ScenarioFiles::Resolve(const std::string& path) const {
  return fs::path(path).is_absolute() ? path : (fs::path(folder_) / path).lexically_normal().string();
}

std::string ScenarioFiles::TextOf(const std::string& path) const {
  const auto found = texts_.find(path);
  return found == texts_.end() ? ReadFile(path) : found->second;
}

std::string ScenarioFiles::ExistingFile(const Value& value, const std::string& what,
                                        Diagnostics& diagnostics) const {
  const std::string name = ReadText(value, what, diagnostics);
  if (name.empty()) return "";
  const std::string path = Resolve(name);
  std::error_code ignored;
  if (texts_.contains(path) || fs::is_regular_file(path, ignored)) return path;
  diagnostics.Add(value.where(), what + ": there is no file '" + path + "'",
                  "a path relative to the scenario");
  return "";
}

}  // namespace tether::scenario
