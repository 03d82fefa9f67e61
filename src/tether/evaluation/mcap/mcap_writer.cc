#include "tether/evaluation/mcap/mcap_writer.h"

#include <algorithm>

#include "tether/evaluation/mcap/crc32.h"

namespace tether::evaluation {
namespace {

constexpr const char* kCompression = "zstd";

template <typename Integer>
void Put(std::string* out, Integer value) {
  for (size_t i = 0; i < sizeof(Integer); ++i)
    *out += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i) & 0xff);
}

void PutText(std::string* out, std::string_view text) {
  Put(out, static_cast<uint32_t>(text.size()));
  *out += text;
}

void PutRecord(std::string* out, McapOpcode opcode, std::string_view content) {
  Put(out, static_cast<uint8_t>(opcode));
  Put(out, static_cast<uint64_t>(content.size()));
  *out += content;
}

}  // namespace

McapWriter::McapWriter(std::string_view library) {
  bytes_ = kMcapMagic;
  offset_ = bytes_.size();
  data_crc_ = Crc32(0, bytes_);
  std::string header;
  PutText(&header, "");  // No profile.
  PutText(&header, library);
  Emit(McapOpcode::kHeader, header);
}

void McapWriter::Emit(McapOpcode opcode, std::string_view content) {
  const size_t before = bytes_.size();
  PutRecord(&bytes_, opcode, content);
  offset_ += bytes_.size() - before;
  data_crc_ = Crc32(data_crc_, std::string_view(bytes_).substr(before));
}

uint16_t McapWriter::AddSchema(McapSchema schema) {
  schemas_.push_back(std::move(schema));
  schema_written_.push_back(false);
  return static_cast<uint16_t>(schemas_.size());
}

uint16_t McapWriter::AddChannel(McapChannel channel) {
  channels_.push_back(std::move(channel));
  channel_written_.push_back(false);
  counts_.push_back(0);
  chunk_offsets_.emplace_back();
  return static_cast<uint16_t>(channels_.size());
}

std::string McapWriter::SchemaContent(uint16_t id) const {
  const McapSchema& schema = schemas_[id - 1U];
  std::string content;
  Put(&content, id);
  PutText(&content, schema.name);
  PutText(&content, schema.encoding);
  PutText(&content, schema.data);
  return content;
}

std::string McapWriter::ChannelContent(uint16_t id) const {
  const McapChannel& channel = channels_[id - 1U];
  std::string content;
  Put(&content, id);
  Put(&content, channel.schema);
  PutText(&content, channel.topic);
  PutText(&content, channel.encoding);
  Put(&content, uint32_t{0});  // No metadata.
  return content;
}

void McapWriter::AddMessage(uint16_t channel, uint64_t time, std::string_view data) {
  const size_t i = channel - 1U;
  if (!channel_written_[i]) {
    const uint16_t schema = channels_[i].schema;
    if (!schema_written_[schema - 1U]) PutRecord(&chunk_, McapOpcode::kSchema, SchemaContent(schema));
    PutRecord(&chunk_, McapOpcode::kChannel, ChannelContent(channel));
    schema_written_[schema - 1U] = channel_written_[i] = true;
  }
  const bool first =
      std::all_of(chunk_offsets_.begin(), chunk_offsets_.end(), [](const Offsets& o) { return o.empty(); });
  chunk_start_ = first ? time : std::min(chunk_start_, time);
  chunk_end_ = first ? time : std::max(chunk_end_, time);
  chunk_offsets_[i].emplace_back(time, chunk_.size());
  Put(&chunk_, static_cast<uint8_t>(McapOpcode::kMessage));
  Put(&chunk_, static_cast<uint64_t>(2 + 4 + 8 + 8 + data.size()));
  Put(&chunk_, channel);
  Put(&chunk_, static_cast<uint32_t>(counts_[i]++));
  Put(&chunk_, time);
  Put(&chunk_, time);  // Published when it was logged.
  chunk_ += data;
}

void McapWriter::CloseChunk() {
  if (chunk_.empty()) return;
  ChunkIndex index{chunk_start_, chunk_end_, offset_, 0, 0, 0, chunk_.size(), {}};
  std::string content;
  Put(&content, chunk_start_);
  Put(&content, chunk_end_);
  Put(&content, static_cast<uint64_t>(chunk_.size()));
  Put(&content, Crc32(0, chunk_));
  PutText(&content, kCompression);
  const size_t length_at = content.size();
  Put(&content, uint64_t{0});
  compressor_.Append(chunk_, &content);
  index.compressed = content.size() - length_at - 8;
  std::string length;
  Put(&length, index.compressed);
  content.replace(length_at, 8, length);
  Emit(McapOpcode::kChunk, content);
  index.length = offset_ - index.offset;
  const uint64_t indices_at = offset_;
  for (size_t i = 0; i < chunk_offsets_.size(); ++i) {
    if (chunk_offsets_[i].empty()) continue;
    const auto id = static_cast<uint16_t>(i + 1);
    index.message_index.emplace_back(id, offset_);
    std::string record;
    Put(&record, id);
    Put(&record, static_cast<uint32_t>(16 * chunk_offsets_[i].size()));
    for (const auto& [time, offset] : chunk_offsets_[i]) {
      Put(&record, time);
      Put(&record, offset);
    }
    Emit(McapOpcode::kMessageIndex, record);
    chunk_offsets_[i].clear();
  }
  index.index_length = offset_ - indices_at;
  chunks_.push_back(std::move(index));
  chunk_.clear();
}

void McapWriter::AddMetadata(const std::string& name, const std::map<std::string, std::string>& values) {
  CloseChunk();
  std::string map, content, index;
  for (const auto& [key, value] : values) {
    PutText(&map, key);
    PutText(&map, value);
  }
  PutText(&content, name);
  PutText(&content, map);
  PutText(&index, name);
  const uint64_t before = offset_;
  Emit(McapOpcode::kMetadata, content);
  metadata_.push_back({before, offset_ - before, index});
}

void McapWriter::AddAttachment(const std::string& name, const std::string& media_type,
                               std::string_view data) {
  CloseChunk();
  std::string content, index;
  Put(&content, uint64_t{0});  // Logged at the start of the run,
  Put(&content, uint64_t{0});  // made at a time that is not known.
  PutText(&content, name);
  PutText(&content, media_type);
  Put(&content, static_cast<uint64_t>(data.size()));
  content += data;
  Put(&content, Crc32(0, content));
  Put(&index, uint64_t{0});
  Put(&index, uint64_t{0});
  Put(&index, static_cast<uint64_t>(data.size()));
  PutText(&index, name);
  PutText(&index, media_type);
  const uint64_t before = offset_;
  Emit(McapOpcode::kAttachment, content);
  attachments_.push_back({before, offset_ - before, index});
}

void McapWriter::EndGroup(McapOpcode opcode, uint64_t begin, std::string* offsets) {
  const uint64_t length = bytes_.size() - begin;
  if (length == 0) return;
  std::string content;
  Put(&content, static_cast<uint8_t>(opcode));
  Put(&content, offset_ - length);
  Put(&content, length);
  PutRecord(offsets, McapOpcode::kSummaryOffset, content);
}

void McapWriter::WriteSummary(std::string* offsets) {
  uint64_t begin = BeginGroup();
  uint32_t schemas = 0, channels = 0;
  for (uint16_t id = 1; id <= schemas_.size(); ++id) {
    if (!schema_written_[id - 1U]) continue;
    ++schemas;
    Emit(McapOpcode::kSchema, SchemaContent(id));
  }
  EndGroup(McapOpcode::kSchema, begin, offsets);
  begin = BeginGroup();
  std::string counts;
  uint64_t messages = 0;
  for (uint16_t id = 1; id <= channels_.size(); ++id) {
    if (!channel_written_[id - 1U]) continue;
    ++channels;
    messages += counts_[id - 1U];
    Put(&counts, id);
    Put(&counts, counts_[id - 1U]);
    Emit(McapOpcode::kChannel, ChannelContent(id));
  }
  EndGroup(McapOpcode::kChannel, begin, offsets);
  begin = BeginGroup();
  uint64_t start = 0, end = 0;
  for (const ChunkIndex& chunk : chunks_) {
    start = &chunk == &chunks_.front() ? chunk.start : std::min(start, chunk.start);
    end = std::max(end, chunk.end);
    std::string content, map;
    for (const uint64_t value : {chunk.start, chunk.end, chunk.offset, chunk.length}) Put(&content, value);
    for (const auto& [id, offset] : chunk.message_index) {
      Put(&map, id);
      Put(&map, offset);
    }
    PutText(&content, map);
    Put(&content, chunk.index_length);
    PutText(&content, kCompression);
    Put(&content, chunk.compressed);
    Put(&content, chunk.uncompressed);
    Emit(McapOpcode::kChunkIndex, content);
  }
  EndGroup(McapOpcode::kChunkIndex, begin, offsets);
  for (const auto& [opcode, placed] : {std::pair(McapOpcode::kAttachmentIndex, &attachments_),
                                       std::pair(McapOpcode::kMetadataIndex, &metadata_)}) {
    begin = BeginGroup();
    for (const Placed& one : *placed) {
      std::string content;
      Put(&content, one.offset);
      Put(&content, one.length);
      Emit(opcode, content + one.content);
    }
    EndGroup(opcode, begin, offsets);
  }
  begin = BeginGroup();
  std::string statistics;
  Put(&statistics, messages);
  Put(&statistics, static_cast<uint16_t>(schemas));
  for (const size_t count : {size_t{channels}, attachments_.size(), metadata_.size(), chunks_.size()})
    Put(&statistics, static_cast<uint32_t>(count));
  Put(&statistics, start);
  Put(&statistics, end);
  PutText(&statistics, counts);
  Emit(McapOpcode::kStatistics, statistics);
  EndGroup(McapOpcode::kStatistics, begin, offsets);
}

void McapWriter::Finish() {
  CloseChunk();
  std::string content;
  Put(&content, data_crc_);
  Emit(McapOpcode::kDataEnd, content);
  const size_t summary_at = bytes_.size();
  const uint64_t summary_start = offset_;
  std::string offsets;
  WriteSummary(&offsets);
  const uint64_t offsets_start = offset_;
  bytes_ += offsets;
  offset_ += offsets.size();
  std::string footer;
  Put(&footer, summary_start);
  Put(&footer, offsets_start);
  // The checksum covers the footer too, up to itself.
  Put(&bytes_, static_cast<uint8_t>(McapOpcode::kFooter));
  Put(&bytes_, static_cast<uint64_t>(footer.size() + 4));
  bytes_ += footer;
  Put(&bytes_, Crc32(0, std::string_view(bytes_).substr(summary_at)));
  bytes_ += kMcapMagic;
}

}  // namespace tether::evaluation
