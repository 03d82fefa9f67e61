#pragma once

#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tether/common/bounds.h"
#include "tether/common/document/reader.h"

/// What the readers of a scenario's parts share; not for users of the room.
namespace tether::scenario {

/// The text under `key`, one of `accepted`; the fallback if it is absent, or after a diagnostic.
std::string ReadChoice(ObjectReader& reader, std::string_view key, const std::vector<std::string>& accepted,
                       const std::string& fallback);

/// The same as a value: what `accepted` has beside the text.
template <typename T>
T ReadChoice(ObjectReader& reader, std::string_view key,
             const std::vector<std::pair<std::string, T>>& accepted, T fallback) {
  std::vector<std::string> names;
  for (const auto& [name, value] : accepted) names.push_back(name);
  const std::string text = ReadChoice(reader, key, names, std::string());
  for (const auto& [name, value] : accepted) {
    if (name == text) return value;
  }
  return fallback;
}

/// Values with their names, as ToString() has them.
template <typename T>
std::vector<std::pair<std::string, T>> Named(std::initializer_list<T> values) {
  std::vector<std::pair<std::string, T>> named;
  for (const T value : values) named.emplace_back(ToString(value), value);
  return named;
}

/// A finite number from zero to `most`; the fallback if it is absent, or after a diagnostic.
double ReadBound(ObjectReader& reader, std::string_view key, double fallback, const std::string& accepted,
                 double most = kGreatestNumber);

/// A whole number of at least `least`; the fallback if it is absent, or after a diagnostic.
int ReadCount(ObjectReader& reader, std::string_view key, int fallback, int least,
              const std::string& accepted);

/// The files that a scenario names: on disk, or texts in their place.
class ScenarioFiles {
 public:
  /// `texts`, by path, must outlive this.
  ScenarioFiles(const std::string& scenario_path, const std::map<std::string, std::string>& texts);

  /// A path relative to the scenario's folder, or an absolute one, as one that can be opened.
  std::string Resolve(const std::string& path) const;
  /// The text of a file. Throws InputError if it can't be read.
  std::string TextOf(const std::string& path) const;
  /// The file's path if it is there; else empty, after a diagnostic at the place that names it.
  std::string ExistingFile(const Value& value, const std::string& what, Diagnostics& diagnostics) const;
  /// There is a text in place of this file.
  bool IsReplaced(const std::string& path) const { return texts_.contains(path); }
  const std::string& folder() const { return folder_; }

 private:
  const std::map<std::string, std::string>& texts_;
  std::string folder_;
};

}  // namespace tether::scenario
