#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "tether/evaluation/mcap/mcap_format.h"

namespace tether::evaluation {

/// What a reader is told of, in the file's order. `offset` is where in the file the record stands, or the
/// chunk that holds it.
class McapHandler {
 public:
  virtual ~McapHandler() = default;
  virtual void OnMetadata(const std::string& name, const std::map<std::string, std::string>& values,
                          uint64_t offset) = 0;
  virtual void OnAttachment(const std::string& name, std::string_view data, uint64_t offset) = 0;
  virtual void OnMessage(const McapChannel& channel, const McapSchema& schema, uint64_t time,
                         std::string_view data, uint64_t offset) = 0;
};

/// Where and why reading ended before the file's regular end.
struct McapProblem {
  uint64_t offset = 0;
  std::string text;
};

/// Fills a buffer with the next bytes of a file; fewer than asked for only at its end.
using ByteSource = std::function<size_t(char* buffer, size_t size)>;

/// The bytes of a text, which must outlive the source.
ByteSource BytesOf(std::string_view text);

/// Reads an MCAP file from its beginning as far as it goes: to its end, or to where it was cut off, or where
/// a record is malformed or a checksum is wrong. Everything before is handed over. Throws InputError, naming
/// `file`, if it is no MCAP file or of another version.
std::optional<McapProblem> ReadMcap(const ByteSource& source, const std::string& file, McapHandler& handler);

}  // namespace tether::evaluation
