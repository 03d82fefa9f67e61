#include "tether/robot/mujoco_setup.h"

#include <mutex>

#include <mujoco/mujoco.h>

#include "tether/common/log.h"

namespace tether::robot {

void PrepareMujoco() {
  static std::once_flag once;
  std::call_once(once, [] {
    mju_user_error = [](const char* message) { throw MujocoError(message); };
    mju_user_warning = [](const char* message) { LogDebug(std::string("MuJoCo: ") + message); };
  });
}

}  // namespace tether::robot
