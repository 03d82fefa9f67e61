#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tether::fuzz {

/// Inputs with the paths they came from.
struct Seed {
  std::string path, text;
};

/// The files below `folder`, in the order of their names.
std::vector<Seed> ReadCorpus(const std::string& folder);

struct Allowance {
  double cpu_s = 10;             ///< Of one input.
  uint64_t memory = 2ull << 30;  ///< Bytes, of a process.
};

/// The outcome of one input. `ok` also where it was refused as it should be.
struct Outcome {
  bool ok = true;
  std::string text;  ///< "signal 11 (Segmentation fault)", "std::bad_alloc", …
};

/// Sets the limits for this process, and what a sanitizer does when they are reached.
void SetLimits(const Allowance& allowance);

/// Runs `body` on an input in this process: InputError is fine, other exceptions are not.
Outcome RunHere(const std::function<void(const std::string&)>& body, const std::string& input);

/// Runs `body` in a process of its own and waits; `output` is where its standard output goes, empty: nowhere.
Outcome RunApart(const std::function<int()>& body, const Allowance& allowance);

struct FuzzOptions {
  std::string name;
  double seconds = 60;  ///< On the clock; 0: until `runs`.
  uint64_t runs = 0;    ///< Inputs; 0: until `seconds`.
  uint64_t seed = 1;
  std::string findings;  ///< Folder for inputs that are not read as they should be; empty: none is kept.
  Allowance allowance;
};

/// Mutates the corpus, and inputs that led to new places, until the time is over, in a process that is
/// restarted after each finding. Returns the number of findings; each is printed on standard output. With
/// `runs` in place of `seconds` the same seed tries the same inputs.
int Fuzz(const std::function<void(const std::string&)>& body, const std::vector<Seed>& corpus,
         const FuzzOptions& options);

}  // namespace tether::fuzz
