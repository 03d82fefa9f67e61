#include <cstdlib>

#include <gtest/gtest.h>

#include "tether/common/document/value.h"
#include "tether/common/file.h"
#include "tether/constraints/core/kind.h"

namespace tether::structure {
namespace {

constexpr const char* kPreface =
    R"(# Constraint kinds

What an action's step (see [action_format.md](action_format.md)) and a scenario's `constraints` may ask for, written
`- kind: {parameters}`. Frames are objects, regions, `hand`, `world` or, within an action, its parameters. A parameter
without a default is required. Sources are explained in [papers.md](papers.md). This page is made from the registry in `src/tether/constraints`; when that changes, run
the tests with `TETHER_UPDATE_DOCS=1` to write it again.

)";

TEST(Reference, PageOfConstraintKindsIsThatOfTheRegistry) {
  const std::string path = std::string(TETHER_SOURCE_DIR) + "/docs/constraint_kinds.md";
  std::string page = kPreface + constraints::RegistryReference();
  while (page.ends_with("\n\n")) page.pop_back();
  if (std::getenv("TETHER_UPDATE_DOCS") != nullptr) WriteFile(path, page);
  EXPECT_EQ(ReadFile(path), page) << "run this test with TETHER_UPDATE_DOCS=1";
}

}  // namespace
}  // namespace tether::structure
