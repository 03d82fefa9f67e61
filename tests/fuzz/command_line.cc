// Mutates files and runs the commands of the program on them: fuzz_command_line --help.

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <new>
#include <string>

#include <sys/time.h>
#include <unistd.h>

#include "apps/tether/commands.h"
#include "engine.h"
#include "mutate.h"
#include "targets.h"
#include "tether/common/error.h"
#include "tether/common/exit_code.h"
#include "tether/common/limits.h"

namespace {

using namespace tether;
using namespace tether::fuzz;
namespace fs = std::filesystem;

constexpr const char* kUsage =
    R"(Usage: fuzz_command_line COMMAND [--files N | --seconds S] [--seed N] [--findings DIR] [--input FILE]

COMMAND is check, plan or run. Each of N files (default 1000) is a scenario of the corpus that was changed at
random, with its PDDL files, and goes through the command in a process of its own. After 1 s of its time the
command is interrupted, as by a signal. A finding is a crash, an exit code that is none of the documented
ones, more than 10 s of processor time, or more than 2 GB. --input tries one file, without changes.
)";

std::atomic<bool> stop{false};

extern "C" void AskToStop(int) { stop = true; }

/// The scenario's parts as files in the folder; returns the scenario's path.
std::string WriteParts(const fs::path& folder, const std::string& input) {
  const std::vector<std::string> parts = Split(input, 3);
  const char* names[] = {"scenario.yaml", "domain.pddl", "problem.pddl"};
  for (size_t i = 0; i < parts.size(); ++i) std::ofstream(folder / names[i], std::ios::binary) << parts[i];
  return (folder / "scenario.yaml").string();
}

/// Runs the command as the program would, with main's handling of exceptions.
int RunCommandOn(const std::string& command, const std::string& scenario) {
  std::signal(SIGPROF, AskToStop);
  itimerval timer{};
  timer.it_value.tv_sec = 1;
  setitimer(ITIMER_PROF, &timer, nullptr);
  tether::Limits limits;
  limits.interrupted = &stop;
  limits.memory = tether::kDefaultMemoryLimit / 2;
  const tether::LimitsScope scope(limits);
  try {
    if (command == "check") return app::CheckCommand({{scenario}});
    if (command == "plan") {
      app::PlanArguments arguments;
      arguments.scenario = scenario;
      arguments.overrides.stop = &stop;
      return app::PlanCommand(arguments);
    }
    app::RunArguments arguments;
    arguments.scenario = scenario;
    arguments.overrides.stop = &stop;
    return app::RunCommand(arguments);
  } catch (const InputError&) {
    return kExitBadInput;
  } catch (const std::bad_alloc&) {
    return kExitGaveUp;
  } catch (const tether::LimitReached& reached) {
    return reached.limit() == tether::Limit::kInterrupted ? kExitInterrupted : kExitGaveUp;
  } catch (const std::exception&) {
    return kExitInternal;
  }
}

bool IsDocumented(const Outcome& outcome) {
  static const std::map<std::string, bool> good = {{"0", true}, {"2", true}, {"3", true},
                                                   {"4", true}, {"5", true}, {"130", true}};
  return outcome.ok && good.count(outcome.text) > 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::string command, findings, input;
  int files = 1000;
  double seconds = 0;
  uint64_t seed = 1;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto next = [&]() -> std::string { return i + 1 < argc ? argv[++i] : ""; };
    if (word == "--files") {
      files = std::atoi(next().c_str());
    } else if (word == "--seconds") {
      seconds = std::atof(next().c_str());
    } else if (word == "--seed") {
      seed = std::strtoull(next().c_str(), nullptr, 10);
    } else if (word == "--findings") {
      findings = next();
    } else if (word == "--input") {
      input = next();
    } else {
      command = word;
    }
  }
  if (command != "check" && command != "plan" && command != "run") {
    std::fputs(kUsage, stderr);
    return 2;
  }
  const fs::path folder = fs::temp_directory_path() / ("tether_fuzz_cli_" + std::to_string(getpid()));
  fs::create_directories(folder);
  Allowance allowance;
  if (!input.empty()) {
    const Outcome outcome = RunApart(
        [&] { return RunCommandOn(command, WriteParts(folder, ReadCorpus(input).at(0).text)); }, allowance);
    std::printf("%s: %s\n", input.c_str(), outcome.text.c_str());
    fs::remove_all(folder);
    return IsDocumented(outcome) ? 0 : 1;
  }
  std::vector<std::string> texts;
  for (const Seed& one : ReadCorpus(std::string(TETHER_SOURCE_DIR) + "/tests/fuzz/corpus/command_line"))
    texts.push_back(one.text);
  std::map<std::string, int> outcomes;
  Random random(seed);
  int found = 0, tried = 0;
  const auto begin = std::chrono::steady_clock::now();
  const auto over = [&] {
    if (seconds == 0) return tried >= files;
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() >= seconds;
  };
  for (; !over(); ++tried) {
    const int i = tried;
    const std::string text = Mutate(texts[static_cast<size_t>(i) % texts.size()], texts, random);
    const std::string scenario = WriteParts(folder, text);
    const Outcome outcome = RunApart([&] { return RunCommandOn(command, scenario); }, allowance);
    ++outcomes[outcome.text];
    if (IsDocumented(outcome)) continue;
    ++found;
    std::string kept;
    if (!findings.empty()) {
      fs::create_directories(findings);
      kept = (fs::path(findings) / (command + "-" + std::to_string(seed) + "-" + std::to_string(i))).string();
      std::ofstream(kept, std::ios::binary) << text;
    }
    std::printf("%s: FINDING at file %d: %s%s%s\n", command.c_str(), i, outcome.text.c_str(),
                kept.empty() ? "" : "; input: ", kept.c_str());
    std::fflush(stdout);
  }
  fs::remove_all(folder);
  std::printf("%s: %d files, seed %llu; exit codes:", command.c_str(), tried,
              static_cast<unsigned long long>(seed));
  for (const auto& [text, count] : outcomes) std::printf(" %s: %d;", text.c_str(), count);
  std::printf(" %d findings\n", found);
  return found == 0 ? 0 : 1;
}
