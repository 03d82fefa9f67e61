// Fuzzes the readers: fuzz_readers --help.

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "engine.h"
#include "targets.h"

namespace {

using namespace tether::fuzz;

constexpr const char* kUsage =
    R"(Usage: fuzz_readers TARGET [--seconds S | --runs N] [--seed N] [--corpus DIR] [--findings DIR]
       fuzz_readers TARGET --replay FILE
       fuzz_readers --list

Feeds a reader with files that were changed at random. Whatever is neither read nor refused with an InputError
is a finding: a crash, another exception, more than 10 s or 2 GB. Exit code 1 if there was one.
)";

int Replay(const Target& target, const std::string& path) {
  int bad = 0;
  for (const Seed& seed : ReadCorpus(path)) {
    const Outcome outcome = RunHere(target.read, seed.text);
    if (outcome.ok) continue;
    std::printf("%s: %s\n", seed.path.c_str(), outcome.text.c_str());
    ++bad;
  }
  return bad == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  FuzzOptions options;
  std::string corpus, replay;
  const Target* target = nullptr;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto next = [&]() -> std::string { return i + 1 < argc ? argv[++i] : ""; };
    if (word == "--list") {
      for (const Target& known : Targets()) std::printf("%-10s %s\n", known.name, known.what);
      return 0;
    }
    if (word == "--seconds") {
      options.seconds = std::atof(next().c_str());
    } else if (word == "--runs") {
      options.runs = std::strtoull(next().c_str(), nullptr, 10);
    } else if (word == "--seed") {
      options.seed = std::strtoull(next().c_str(), nullptr, 10);
    } else if (word == "--corpus") {
      corpus = next();
    } else if (word == "--findings") {
      options.findings = next();
    } else if (word == "--replay") {
      replay = next();
    } else {
      for (const Target& known : Targets()) {
        if (word == known.name) target = &known;
      }
      if (target == nullptr) {
        std::fprintf(stderr, "%sThere is no target '%s'.\n", kUsage, word.c_str());
        return 2;
      }
    }
  }
  if (target == nullptr) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  if (!replay.empty()) return Replay(*target, replay);
  options.name = target->name;
  if (corpus.empty()) corpus = std::string(TETHER_SOURCE_DIR) + "/tests/fuzz/corpus/" + target->name;
  const std::vector<Seed> seeds = ReadCorpus(corpus);
  if (seeds.empty()) {
    std::fprintf(stderr, "%s holds no file to begin with\n", corpus.c_str());
    return 2;
  }
  return Fuzz(target->read, seeds, options) == 0 ? 0 : 1;
}
