#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tether::evaluation {

/// The container MCAP, version 0: records in a file, one after another, each an opcode (one byte), the length
/// of its content (8 bytes) and the content; integers are little-endian. A reader needs no more than the
/// records so far, which is why a log that is cut off anywhere is still one.
inline constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);

enum class McapOpcode : uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0a,
  kStatistics = 0x0b,
  kMetadata = 0x0c,
  kMetadataIndex = 0x0d,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f,
};

/// What a channel's messages look like, by a JSON schema.
struct McapSchema {
  std::string name;      ///< "foxglove.Log"
  std::string encoding;  ///< "jsonschema"
  std::string data;
};

struct McapChannel {
  std::string topic;
  uint16_t schema = 0;   ///< Its number in the file.
  std::string encoding;  ///< "json"
};

}  // namespace tether::evaluation
