#pragma once

#include <cstdint>
#include <string>

#include "tether/common/document/value.h"

namespace tether {

/// {format, tether, seed}: how every output begins.
Value OutputHeader(const std::string& format, uint64_t seed);

}  // namespace tether
