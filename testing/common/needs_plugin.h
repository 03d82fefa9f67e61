#pragma once

#include "tether/common/plugin.h"

/// In a source that includes GoogleTest: skips a test of what a build may lack: TETHER_NEEDS_PLUGIN("ipopt").
#define TETHER_NEEDS_PLUGIN(name) \
  if (!::tether::HasPlugin(name)) GTEST_SKIP() << "this build has no " << (name)
