#include "tether/common/plugin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tether/common/error.h"

namespace tether {
namespace {

TEST(PluginTest, WhatWasNotBuiltSaysWhatToDo) {
  EXPECT_FALSE(HasPlugin("snopt"));
  EXPECT_THAT([] { LoadPlugin("snopt", "TetherSolve", "install libsnopt-dev and build again"); },
              ::testing::ThrowsMessage<InputError>(::testing::StrEq(
                  "this build of Tether has no plugin 'snopt' (install libsnopt-dev and build again)")));
}

}  // namespace
}  // namespace tether
