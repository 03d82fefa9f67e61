#include "tether/common/output/output_header.h"

#include "tether/common/version.h"

namespace tether {

Value OutputHeader(const std::string& format, uint64_t seed) {
  return Value::Object().Set("format", format).Set("tether", Version()).Set("seed", seed);
}

}  // namespace tether
