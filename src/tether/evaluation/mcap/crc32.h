#pragma once

#include <cstdint>
#include <string_view>

namespace tether::evaluation {

/// The CRC-32 of zip, PNG and MCAP (reflected polynomial 0xEDB88320), of a text that comes in pieces:
/// Crc32(Crc32(0, a), b) is that of a followed by b.
uint32_t Crc32(uint32_t before, std::string_view bytes);

}  // namespace tether::evaluation
