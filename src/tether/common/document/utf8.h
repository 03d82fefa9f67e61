#pragma once

#include <cstddef>
#include <string_view>

namespace tether {

/// How many bytes the UTF-8 character at the beginning of `text`, which is not empty, has; 0 if there is
/// none.
size_t Utf8Length(std::string_view text);

}  // namespace tether
