// A signal ends every command with exit code 130, whatever it is doing.

#include <fcntl.h>
#include <signal.h>  // NOLINT: kill() is POSIX
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/tether/cli_testing.h"

namespace tether {
namespace {

/// Starts the program and sends it a signal after so long; its exit code, or minus the signal that ended it.
int Interrupt(std::vector<std::string> arguments, int signal, std::chrono::milliseconds after) {
  arguments.insert(arguments.begin(), TETHER_BINARY);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    for (const int fd : {1, 2}) dup2(open("/dev/null", O_WRONLY), fd);
    execv(TETHER_BINARY, argv.data());
    _exit(99);
  }
  std::this_thread::sleep_for(after);
  kill(child, signal);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

/// Conjunctions of temporal tasks: 3^n states.
std::string LargeFormula() {
  std::string formula;
  for (int i = 0; i < 13; ++i) {
    const std::string n = std::to_string(i);
    formula += (i > 0 ? " & " : "") + std::string("F(a") + n + " & X[!] F b" + n + ")";
  }
  return formula;
}

TEST(SignalsTest, SignalsNotSeenInCompile) {
  for (const int signal : {SIGINT, SIGTERM})
    EXPECT_EQ(Interrupt({"automaton", LargeFormula()}, signal, std::chrono::milliseconds(300)), 130);
}

TEST(SignalsTest, AReaderThatWaitsIsEnded) {
  const ScratchFolder folder;
  const std::string fifo = folder.File("fifo");
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  // Nobody writes to it, nobody reads it.
  EXPECT_EQ(Interrupt({"check", fifo}, SIGTERM, std::chrono::milliseconds(300)), 130);
  EXPECT_EQ(Interrupt({"automaton", "F a", "--json", fifo}, SIGINT, std::chrono::milliseconds(300)), 130);
}

/// A world whose plans are many: n lamps, each of which can be switched on once, in any order.
std::string ManyPlans(const ScratchFolder& folder, int n) {
  std::string objects, goal;
  for (int i = 0; i < n; ++i) {
    objects += " l" + std::to_string(i);
    goal += " (lit l" + std::to_string(i) + ")";
  }
  WriteFile(folder.File("d.pddl"),
            "(define (domain lamps) (:requirements :strips) (:predicates (lit ?l) (dark ?l))\n"
            "(:action switch :parameters (?l) :precondition (dark ?l)\n"
            " :effect (and (lit ?l) (not (dark ?l)))))");
  std::string init;
  for (int i = 0; i < n; ++i) init += " (dark l" + std::to_string(i) + ")";
  WriteFile(folder.File("p.pddl"), "(define (problem p) (:domain lamps) (:objects" + objects + ") (:init" +
                                       init + ") (:goal (and" + goal + ")))");
  return "'" + folder.File("d.pddl") + "' '" + folder.File("p.pddl") + "'";
}

TEST(SignalsTest, MemoryLimitHoldsWhilePlansAreWritten) {
  const ScratchFolder folder;
  const std::string problem = ManyPlans(folder, 11);
  rusage before{}, after{};
  getrusage(RUSAGE_CHILDREN, &before);
  const std::string json = folder.File("o.json");
  // Its own shell, so that the peak memory of one child is known.
  const Outcome outcome =
      Tether("task " + problem + " --max-plans 0 --memory-limit 80M --json '" + json + "' > /dev/null");
  getrusage(RUSAGE_CHILDREN, &after);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_LT(std::max(before.ru_maxrss, after.ru_maxrss), std::max(before.ru_maxrss, 110L << 10)) << "KiB";
  const std::string text = ReadFile(json);
  EXPECT_GT(text.size(), size_t{30} << 20) << "more than the limit would hold as a document";
  EXPECT_THAT(text.substr(0, 600), ::testing::HasSubstr("\"complete\": false"));
  EXPECT_THAT(text.substr(0, 600), ::testing::HasSubstr("the memory limit was reached"));
  EXPECT_TRUE(text.ends_with("  }\n}\n"));
}

TEST(SignalsTest, ReportOfManyPlansIsWrittenWhenInterrupted) {
  const ScratchFolder folder;
  const std::string problem = ManyPlans(folder, 11), json = folder.File("o.json");
  const std::string arguments = "task " + problem + " --max-plans 0 --memory-limit 0 --json '" + json + "'";
  const Outcome file = Tether(arguments + " > /dev/null", "timeout -s INT 0.5");
  EXPECT_EQ(file.exit_code, 124) << file.err;
  EXPECT_EQ(file.err, "");
  std::string head(400, ' ');
  std::ifstream(json).read(head.data(), static_cast<std::streamsize>(head.size()));
  EXPECT_THAT(head, ::testing::HasSubstr("\"status\": \"interrupted\""));
  // Standard output is read slowly, but read.
  const Outcome slow = Tether(
      "task " + problem + " --max-plans 0 --memory-limit 0 --json - 2>/dev/null | (sleep 0.3; tail -c 400)",
      "timeout -s INT 0.5");
  EXPECT_THAT(slow.out, ::testing::HasSubstr("\"search_s\"")) << slow.err;
  EXPECT_TRUE(slow.out.ends_with("}\n")) << slow.out;
  // Nobody reads it.
  const std::string said = folder.File("said");
  Tether("task " + problem + " --max-plans 0 --memory-limit 0 2>'" + said + "' | sleep 3",
         "timeout -s INT 0.5");
  EXPECT_EQ(ReadFile(said), "interrupted: ended before a report could be written in time\n");
}

TEST(SignalsTest, BooleanGoalOutOfMemory) {
  // Pairs that share nothing: one form of the guard has 2^30 clauses, the other 30.
  std::string pairs, parity;
  for (int i = 0; i < 30; ++i) {
    const std::string n = std::to_string(i);
    pairs += (i > 0 ? " | " : "") + std::string("(a") + n + " & b" + n + ")";
    parity += (i > 0 ? " xor " : "") + std::string("a") + n;
  }
  const Outcome table = Tether("automaton '" + pairs + "'", "ulimit -v 4000000;");
  EXPECT_EQ(table.exit_code, 0) << table.err;
  EXPECT_THAT(table.out, ::testing::HasSubstr("3 states"));
  const Outcome json = Tether("automaton '" + pairs + "' --json -", "ulimit -v 4000000;");
  EXPECT_EQ(json.exit_code, 0) << json.err;
  EXPECT_THAT(json.out, ::testing::HasSubstr("\"clauses\""));
  // Neither form of a parity is short.
  const Outcome limit = Tether("automaton '" + parity + "' --memory-limit 200M");
  EXPECT_EQ(limit.exit_code, 4) << limit.err;
  EXPECT_THAT(limit.err, ::testing::HasSubstr("the memory limit was reached"));
}

}  // namespace
}  // namespace tether
