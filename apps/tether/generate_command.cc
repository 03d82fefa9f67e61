#include "apps/tether/commands.h"
#include "apps/tether/terminal.h"
#include "tether/common/exit_code.h"

namespace tether::app {

int GenerateCommand(const GenerateArguments& arguments) {
  const scenario::GeneratedScenario generated =
      scenario::Generate(arguments.kind, arguments.parameters, arguments.seed);
  const std::string path = scenario::WriteGenerated(generated, arguments.output, arguments.force);
  Terminal().Print("the scenario is in " + path);
  return kExitSuccess;
}

}  // namespace tether::app
