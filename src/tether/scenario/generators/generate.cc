#include "tether/scenario/generators/generate.h"

#include <filesystem>
#include <functional>

#include "tether/common/document/value.h"
#include "tether/common/error.h"
#include "tether/common/file.h"
#include "tether/scenario/generators/generate_draft.h"

namespace tether::scenario {
namespace {

namespace fs = std::filesystem;

void RequireRange(const char* option, int value, int least, int most, const char* why,
                  Diagnostics& diagnostics) {
  if (value >= least && value <= most) return;
  diagnostics.Add({}, std::string(option) + " is " + std::to_string(value),
                  std::to_string(least) + " to " + std::to_string(most) + ": " + why);
}

/// The files of a scenario by name.
std::vector<std::pair<std::string, const std::string*>> Files(const GeneratedScenario& generated) {
  return {{"scenario.yaml", &generated.scenario},
          {"domain.pddl", &generated.domain},
          {"problem.pddl", &generated.problem}};
}

}  // namespace

std::vector<std::pair<std::string, std::string>> GeneratorKinds() {
  return {{"hanoi", "a tower of blocks of 3 to 7 cm on one of three plates"},
          {"reach", "a box out of reach (or, in a quarter of all scenes, within), a hook and a shelf"},
          {"stack", "random boxes to be stacked in a given order"},
          {"sort", "random boxes to be put onto the trays of their kinds"},
          {"bin", "cubes to be put into a bin with walls"},
          {"clutter", "a box to be taken from among obstacles"},
          {"crowd", "a box to be moved where many things stand around"},
          {"around", "blocks to be carried from one side of the arm to the other"},
          {"posts", "a box to be moved where thin posts stand beside the arm"},
          {"shelf", "a thing to be taken out of a compartment with a roof, from behind others"}};
}

GeneratedScenario Generate(const std::string& kind, const GeneratorParameters& parameters, uint64_t seed) {
  Diagnostics diagnostics;
  if (kind == "hanoi") {
    RequireRange("--blocks", parameters.blocks, 2, 8, "edges of 3 to 7 cm, in a tower that the arm reaches",
                 diagnostics);
    diagnostics.ThrowIfAny();
    return GenerateHanoi(parameters.blocks, seed);
  }
  if (kind == "reach") {
    diagnostics.ThrowIfAny();
    return GenerateReach(seed);
  }
  if (kind == "stack") {
    RequireRange("--blocks", parameters.blocks, 2, 8, "what the bench has room for", diagnostics);
    diagnostics.ThrowIfAny();
    return GenerateStack(parameters.blocks, seed);
  }
  if (kind == "sort") {
    RequireRange("--objects", parameters.objects, 1, 8, "what the bench has room for", diagnostics);
    RequireRange("--regions", parameters.regions, 1, 4, "what the bench has room for", diagnostics);
    diagnostics.ThrowIfAny();
    return GenerateSort(parameters.objects, parameters.regions, seed);
  }
  if (kind == "bin") {
    RequireRange("--objects", parameters.objects, 1, 8, "what the bin has room for", diagnostics);
    diagnostics.ThrowIfAny();
    return GenerateBin(parameters.objects, seed);
  }
  if (kind == "crowd") {
    RequireRange("--objects", parameters.objects, 0, 200, "what stands around", diagnostics);
    diagnostics.ThrowIfAny();
    return GenerateCrowd(parameters.objects, seed);
  }
  if (kind == "clutter") {
    RequireRange("--objects", parameters.objects, 0, 12, "what fits around the target", diagnostics);
    diagnostics.ThrowIfAny();
    return GenerateClutter(parameters.objects, seed);
  }
  if (kind == "around") {
    RequireRange("--blocks", parameters.blocks, 1, 4, "what the stands have room for", diagnostics);
    diagnostics.ThrowIfAny();
    return GenerateAround(parameters.blocks, seed);
  }
  if (kind == "posts") {
    RequireRange("--objects", parameters.objects, 0, 12, "posts, with room for the arm", diagnostics);
    diagnostics.ThrowIfAny();
    return GeneratePosts(parameters.objects, seed);
  }
  if (kind == "shelf") {
    RequireRange("--regions", parameters.regions, 1, 2, "compartments that the arm reaches", diagnostics);
    RequireRange("--objects", parameters.objects, 1, 6, "things in its compartments", diagnostics);
    diagnostics.ThrowIfAny();
    return GenerateShelf(parameters.objects, parameters.regions, seed);
  }
  std::vector<std::string> names;
  for (const auto& [name, text] : GeneratorKinds()) names.push_back(name);
  throw InputError("unknown kind of scene '" + kind + "'", SuggestFrom(kind, names));
}

Scenario LoadGenerated(const GeneratedScenario& generated) {
  std::map<std::string, std::string> files;
  for (const auto& [name, text] : Files(generated)) files[name] = *text;
  return LoadScenario("scenario.yaml", files);
}

std::string WriteGenerated(const GeneratedScenario& generated, const std::string& folder, bool overwrite) {
  std::error_code error;
  if (folder.empty()) throw InputError("--output is empty", "a folder");
  if (fs::exists(folder, error) && !fs::is_directory(folder, error)) {
    throw InputError("--output: '" + folder + "' is a file", "a folder, or where one can be made");
  }
  Diagnostics diagnostics;
  for (const auto& [name, text] : Files(generated)) {
    const std::string path = (fs::path(folder) / name).string();
    if (!overwrite && fs::exists(path, error)) {
      diagnostics.Add({}, "--output: '" + path + "' exists already",
                      "another folder, or --force to replace it");
    }
  }
  diagnostics.ThrowIfAny();
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder, error)) {
    throw InputError("--output: cannot make the folder '" + folder + "'",
                     "a folder, or where one can be made");
  }
  const WritingScope all_or_none;  // A scenario without its domain is of no use.
  for (const auto& [name, text] : Files(generated)) WriteFile((fs::path(folder) / name).string(), *text);
  return (fs::path(folder) / "scenario.yaml").string();
}

}  // namespace tether::scenario
