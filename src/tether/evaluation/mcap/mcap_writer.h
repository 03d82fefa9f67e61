#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tether/evaluation/mcap/mcap_format.h"
#include "tether/evaluation/mcap/zstd.h"

namespace tether::evaluation {

/// Composes an MCAP file piece by piece: Take() gives the bytes that follow those it gave before, always
/// whole records. Messages are gathered into chunks, which are compressed and indexed. Nothing is ever
/// changed afterwards, so the file may be a pipe.
class McapWriter {
 public:
  /// `library` names the program that writes.
  explicit McapWriter(std::string_view library);

  uint16_t AddSchema(McapSchema schema);
  uint16_t AddChannel(McapChannel channel);
  /// A message at a time (ns). Schema and channel are written when the first message needs them.
  void AddMessage(uint16_t channel, uint64_t time, std::string_view data);
  /// These two close the chunk.
  void AddMetadata(const std::string& name, const std::map<std::string, std::string>& values);
  void AddAttachment(const std::string& name, const std::string& media_type, std::string_view data);

  /// Bytes of messages that no chunk holds yet.
  size_t open_bytes() const { return chunk_.size(); }
  void CloseChunk();
  /// Ends the file: the index, statistics and the footer. Nothing may be added then.
  void Finish();
  std::string Take() { return std::exchange(bytes_, {}); }

 private:
  using Offsets = std::vector<std::pair<uint64_t, uint64_t>>;  // Time, offset in the chunk.
  struct ChunkIndex {
    uint64_t start, end, offset, length, index_length, compressed, uncompressed;
    std::vector<std::pair<uint16_t, uint64_t>> message_index;
  };
  struct Placed {
    uint64_t offset, length;
    std::string content;  ///< Of the index record, after offset and length.
  };

  void Emit(McapOpcode opcode, std::string_view content);
  uint64_t BeginGroup() const { return bytes_.size(); }
  void EndGroup(McapOpcode opcode, uint64_t begin, std::string* offsets);
  std::string SchemaContent(uint16_t id) const;
  std::string ChannelContent(uint16_t id) const;
  void WriteSummary(std::string* offsets);

  std::string bytes_;      // Composed and not taken yet.
  uint64_t offset_ = 0;    // Of the end of bytes_ in the file.
  uint32_t data_crc_ = 0;  // Of all bytes so far.
  ZstdCompressor compressor_;
  std::vector<McapSchema> schemas_;    // Numbers from 1.
  std::vector<McapChannel> channels_;  // Numbers from 1.
  std::vector<bool> schema_written_, channel_written_;
  std::vector<uint64_t> counts_;  // Messages by channel.
  std::string chunk_;
  std::vector<Offsets> chunk_offsets_;  // By channel.
  uint64_t chunk_start_ = 0, chunk_end_ = 0;
  std::vector<ChunkIndex> chunks_;
  std::vector<Placed> metadata_, attachments_;
};

}  // namespace tether::evaluation
