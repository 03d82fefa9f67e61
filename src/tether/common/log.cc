#include "tether/common/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace tether {
namespace {

spdlog::logger& Logger() {
  static const auto logger = [] {
    auto made = spdlog::stderr_color_mt("tether");
    made->set_pattern("%^[%l]%$ %v");
    return made;
  }();
  return *logger;
}

}  // namespace

void SetVerbose(bool verbose) { Logger().set_level(verbose ? spdlog::level::debug : spdlog::level::info); }
void LogDebug(std::string_view message) { Logger().debug(message); }
void LogWarning(std::string_view message) { Logger().warn(message); }

}  // namespace tether
