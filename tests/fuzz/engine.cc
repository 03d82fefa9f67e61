#include "engine.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <typeinfo>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "coverage.h"
#include "mutate.h"
#include "tether/common/error.h"

#if defined(__SANITIZE_ADDRESS__)
// A finding ends the process, so that the one that waits for it sees it.
extern "C" const char* __asan_default_options() {
  return "abort_on_error=1:detect_leaks=0:hard_rss_limit_mb=2048:max_allocation_size_mb=2048:"
         "allocator_may_return_null=0:detect_stack_use_after_return=0";
}
extern "C" const char* __ubsan_default_options() { return "abort_on_error=1:print_stacktrace=1"; }
#endif

namespace tether::fuzz {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kMostFindings = 20;
constexpr int kFound = 77;  // exit code of a process whose last input is a finding
constexpr size_t kMostKept = 3000;

/// Messages of the fuzzing process to the one that watches it, in shared memory.
struct Board {
  uint64_t runs = 0;
  uint64_t accepted = 0;
  uint64_t places = 0, kept = 0;
  size_t size = 0;
  char text[400] = {};
  char input[kMostBytes] = {};
};

Board* ShareBoard() {
  void* memory = mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  return new (memory) Board;
}

void SetTimer(double seconds) {
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  timer.it_value.tv_usec =
      static_cast<suseconds_t>(1e6 * (seconds - static_cast<double>(timer.it_value.tv_sec)));
  setitimer(ITIMER_PROF, &timer, nullptr);
}

std::string Describe(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGPROF || signal == SIGXCPU) return "took too long";
    return "signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
  }
  return "exit code " + std::to_string(WEXITSTATUS(status));
}

/// The loop of a process that tries inputs; ends after a finding, or when enough were tried.
class Trier {
 public:
  Trier(const std::function<void(const std::string&)>& body, const std::vector<Seed>& corpus,
        const FuzzOptions& options, Board& board, uint64_t generation)
      : body_(body),
        options_(options),
        board_(board),
        random_(Random(options.seed).Split("generation " + std::to_string(generation))) {
    for (const Seed& seed : corpus) texts_.push_back(seed.text);
    seeds_ = texts_.size();
  }

  [[noreturn]] void Live(Clock::time_point end) {
    SetLimits(options_.allowance);
    if (board_.runs == 0) {
      for (size_t i = 0; i < seeds_; ++i) Try(texts_[i]);
    }
    const uint64_t most = options_.runs > 0 ? options_.runs : UINT64_MAX;
    while (board_.runs < most && (options_.runs > 0 || Clock::now() < end)) {
      // Half the time from the latest inputs: they reached the newest places.
      const size_t recent = std::min<size_t>(texts_.size(), 20);
      const size_t at = random_.Index(2) == 0
                            ? texts_.size() - 1 - static_cast<size_t>(random_.Index(static_cast<int>(recent)))
                            : static_cast<size_t>(random_.Index(static_cast<int>(texts_.size())));
      Try(Mutate(texts_[at], texts_, random_));
    }
    std::fflush(nullptr);
    _exit(0);
  }

 private:
  void Try(const std::string& text) {
    board_.size = std::min(text.size(), kMostBytes);
    std::memcpy(board_.input, text.data(), board_.size);
    ++board_.runs;
    ClearCoverage();
    SetTimer(options_.allowance.cpu_s);
    const Outcome outcome = RunHere(body_, text);
    SetTimer(0);
    if (!outcome.ok) {
      std::snprintf(board_.text, sizeof board_.text, "%s", outcome.text.c_str());
      _exit(kFound);
    }
    if (outcome.text.empty()) ++board_.accepted;
    const size_t fresh = AddCoverage(seen_);
    board_.places += fresh;
    if (fresh > 0 && texts_.size() < kMostKept + seeds_) {
      texts_.push_back(text);
      board_.kept = texts_.size() - seeds_;
    }
  }

  const std::function<void(const std::string&)>& body_;
  const FuzzOptions& options_;
  Board& board_;
  Random random_;
  std::vector<std::string> texts_;
  size_t seeds_ = 0;
  uint8_t seen_[kCoverageSize] = {};
};

std::string KeepFinding(const FuzzOptions& options, const Board& board) {
  if (options.findings.empty()) return "";
  fs::create_directories(options.findings);
  const std::string text(board.input, board.size);
  uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  char name[32];
  std::snprintf(name, sizeof name, "%016llx", static_cast<unsigned long long>(hash));
  const fs::path path = fs::path(options.findings) / (options.name + "-" + name);
  std::ofstream(path, std::ios::binary) << text;
  return path.string();
}

}  // namespace

std::vector<Seed> ReadCorpus(const std::string& folder) {
  std::vector<Seed> seeds;
  std::vector<fs::path> paths;
  if (fs::is_regular_file(folder)) {
    paths.emplace_back(folder);
  } else {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.is_regular_file()) paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  for (const fs::path& path : paths) {
    std::ifstream file(path, std::ios::binary);
    seeds.push_back({path.string(), {std::istreambuf_iterator<char>(file), {}}});
  }
  return seeds;
}

void SetLimits(const Allowance& allowance) {
  rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
#if !defined(__SANITIZE_ADDRESS__)
  rlimit memory{allowance.memory, allowance.memory};
  setrlimit(RLIMIT_AS, &memory);
#else
  (void)allowance;  // The sanitizer reserves terabytes of addresses; its own limit counts the memory in use.
#endif
}

Outcome RunHere(const std::function<void(const std::string&)>& body, const std::string& input) {
  try {
    body(input);
    return {};
  } catch (const InputError& error) {
    // The message of a mistake must not be empty.
    for (const Diagnostic& diagnostic : error.diagnostics()) {
      if (diagnostic.ToString().empty()) return {false, "an error without words"};
    }
    return {!error.diagnostics().empty(), "refused"};
  } catch (const std::exception& error) {
    return {false, std::string(typeid(error).name()) + ": " + error.what()};
  } catch (...) {
    return {false, "an exception of an unknown kind"};
  }
}

Outcome RunApart(const std::function<int()>& body, const Allowance& allowance) {
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    SetLimits(allowance);
    const int nowhere = open("/dev/null", O_WRONLY);
    if (nowhere >= 0) {
      dup2(nowhere, 1);
      dup2(nowhere, 2);
    }
    const auto seconds = static_cast<rlim_t>(allowance.cpu_s + 1);
    rlimit cpu{seconds, seconds + 1};
    setrlimit(RLIMIT_CPU, &cpu);
    const int code = body();
    std::fflush(nullptr);
    _exit(code);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  const bool ended = WIFEXITED(status);
  return {ended, ended ? std::to_string(WEXITSTATUS(status)) : Describe(status)};
}

int Fuzz(const std::function<void(const std::string&)>& body, const std::vector<Seed>& corpus,
         const FuzzOptions& options) {
  Board* board = ShareBoard();
  const Clock::time_point begin = Clock::now();
  const auto end =
      begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.seconds));
  int findings = 0;
  for (uint64_t generation = 0; findings < kMostFindings; ++generation) {
    std::fflush(nullptr);
    const pid_t child = fork();
    if (child == 0) (new Trier(body, corpus, options, *board, generation))->Live(end);
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) break;
    ++findings;
    const bool told = WIFEXITED(status) && WEXITSTATUS(status) == kFound;
    const std::string kept = KeepFinding(options, *board);
    std::printf("%s: FINDING after %llu inputs: %s%s%s\n", options.name.c_str(),
                static_cast<unsigned long long>(board->runs), told ? board->text : Describe(status).c_str(),
                kept.empty() ? "" : "; input: ", kept.c_str());
    std::fflush(stdout);
  }
  std::printf("%s: %llu inputs in %.0f s, %llu accepted, %llu places, %llu kept, %d findings\n",
              options.name.c_str(), static_cast<unsigned long long>(board->runs),
              std::chrono::duration<double>(Clock::now() - begin).count(),
              static_cast<unsigned long long>(board->accepted),
              static_cast<unsigned long long>(board->places), static_cast<unsigned long long>(board->kept),
              findings);
  munmap(board, sizeof(Board));
  return findings;
}

}  // namespace tether::fuzz
