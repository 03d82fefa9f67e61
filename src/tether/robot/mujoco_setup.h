#pragma once

#include <stdexcept>
#include <string>

namespace tether::robot {

/// Something that MuJoCo itself refused.
class MujocoError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Makes MuJoCo throw MujocoError on its errors, where by default it waits for a key and exits, and log its
/// warnings, where it would write a file into the current folder. Call it before any other use of MuJoCo;
/// repeated calls do nothing.
void PrepareMujoco();

}  // namespace tether::robot
