#include <chrono>
#include <mutex>
#include <string>

#include "tether/common/plugin.h"
#include "tether/common/stop.h"
#include "tether/nlp/backends.h"

namespace tether::nlp {
namespace {

/// IPOPT 3.11.9's linear solver keeps global state: two solves at once crash.
std::timed_mutex& IpoptMutex() {
  static std::timed_mutex mutex;
  return mutex;
}

std::string Remedy(Backend backend) {
  const std::string packages =
      backend == Backend::kIpopt ? "coinor-libipopt-dev" : "libnlopt-dev and libnlopt-cxx-dev";
  return "install " + packages + " (Debian's names) and build again, or use --solver native";
}

/// A backend of a plugin.
class PluginSolver : public Solver {
 public:
  explicit PluginSolver(Backend backend) : backend_(backend) {}

  bool available() const override { return HasPlugin(ToString(backend_)); }
  std::string WhyNot() const override {
    if (available()) return "";
    return "this build of Tether has no solver '" + ToString(backend_) + "': " + Remedy(backend_);
  }

 protected:
  Result DoSolve(const Program& program, const Point& guess, const Options& options,
                 const WarmStart&) const override {
    auto* const solve =
        reinterpret_cast<PluginSolve*>(LoadPlugin(ToString(backend_), "TetherSolve", Remedy(backend_)));
    std::unique_lock<std::timed_mutex> lock(IpoptMutex(), std::defer_lock);
    while (backend_ == Backend::kIpopt && !lock.try_lock_for(std::chrono::milliseconds(5))) {
      if (IsStopped(options.stop)) {
        Monitor monitor(program, options);
        monitor.End(Status::kInterrupted);
        return monitor.Finish(guess, Status::kInterrupted, "", 0, 0);
      }
    }
    Monitor monitor(program, options);
    VectorView view(program, guess);
    PluginOutcome outcome;
    solve(view, monitor, options, outcome);
    return monitor.Finish(view.PointAt(outcome.x), outcome.status, std::move(outcome.message),
                          outcome.iterations, view.evaluations());
  }

 private:
  const Backend backend_;
};

}  // namespace

std::unique_ptr<Solver> MakePluginSolver(Backend backend) { return std::make_unique<PluginSolver>(backend); }

}  // namespace tether::nlp
