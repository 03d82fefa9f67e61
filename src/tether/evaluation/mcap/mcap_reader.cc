#include "tether/evaluation/mcap/mcap_reader.h"

#include <algorithm>
#include <utility>

#include "tether/common/error.h"
#include "tether/evaluation/mcap/crc32.h"
#include "tether/evaluation/mcap/zstd.h"

namespace tether::evaluation {
namespace {

constexpr size_t kPiece = size_t{1} << 20;
constexpr uint64_t kMostRecord = uint64_t{1} << 30;  // Bytes of a record, or of a chunk's content.
constexpr size_t kHead = 9;                          // Opcode and length.
constexpr size_t kVersionAt = 5;

/// The fields of a record, one after another. After one that is not there, ok() is false.
class Fields {
 public:
  explicit Fields(std::string_view content) : rest_(content) {}

  template <typename Integer>
  Integer Get() {
    const std::string_view bytes = Bytes(sizeof(Integer));
    uint64_t value = 0;
    for (size_t i = 0; i < bytes.size(); ++i)
      value |= static_cast<uint64_t>(static_cast<unsigned char>(bytes[i])) << (8 * i);
    return static_cast<Integer>(value);
  }
  std::string_view Bytes(uint64_t size) {
    ok_ = ok_ && size <= rest_.size();
    if (!ok_) return {};
    const std::string_view bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return bytes;
  }
  std::string Text() { return std::string(Bytes(Get<uint32_t>())); }
  std::string_view rest() const { return rest_; }
  bool ok() const { return ok_; }
  bool done() const { return rest_.empty(); }

 private:
  std::string_view rest_;
  bool ok_ = true;
};

std::string NameOf(McapOpcode opcode) {
  static const std::map<McapOpcode, std::string> kNames = {
      {McapOpcode::kHeader, "header"},         {McapOpcode::kFooter, "footer"},
      {McapOpcode::kSchema, "schema"},         {McapOpcode::kChannel, "channel"},
      {McapOpcode::kMessage, "message"},       {McapOpcode::kChunk, "chunk"},
      {McapOpcode::kAttachment, "attachment"}, {McapOpcode::kMetadata, "metadata"},
      {McapOpcode::kDataEnd, "data end"},
  };
  const auto found = kNames.find(opcode);
  return found == kNames.end() ? "record" : found->second + " record";
}

/// Reading ends here.
struct Stop {
  McapProblem problem;
};

class McapReader {
 public:
  McapReader(const ByteSource& source, const std::string& file, McapHandler& handler)
      : source_(source), file_(file), handler_(handler) {}

  std::optional<McapProblem> Read() {
    try {
      ReadMagic();
      while (ReadRecord()) {
      }
    } catch (Stop& stop) {
      return std::move(stop.problem);
    }
    return std::nullopt;
  }

 private:
  [[noreturn]] void End(const std::string& text) const { throw Stop{{record_at_, text}}; }

  /// Appends up to `size` bytes to `content_`, in pieces: a wrong length asks for no more memory than the
  /// file has bytes.
  size_t Fetch(uint64_t size) {
    size_t got = 0;
    while (got < size) {
      const size_t piece = static_cast<size_t>(std::min<uint64_t>(kPiece, size - got)),
                   before = content_.size();
      content_.resize(before + piece);
      const size_t read = source_(content_.data() + before, piece);
      content_.resize(before + read);
      got += read;
      if (read < piece) break;
    }
    offset_ += got;
    return got;
  }

  void ReadMagic() {
    Fetch(kMcapMagic.size());
    const size_t common = std::min(content_.size(), kVersionAt);
    if (std::string_view(content_).substr(0, common) != kMcapMagic.substr(0, common)) {
      throw InputError(
          {{Location{file_, 0, 0}, "this is not an MCAP file", "a log as tether run --log writes it"}});
    }
    if (content_.size() > kVersionAt && content_[kVersionAt] != kMcapMagic[kVersionAt]) {
      throw InputError({{Location{file_, 0, 0},
                         "this is an MCAP file of version '" + content_.substr(kVersionAt, 1) + "' (byte 5)",
                         "version '0'"}});
    }
    if (content_.size() < kMcapMagic.size()) End("the file ends within its first bytes");
    if (content_ != kMcapMagic) End("the bytes after the version are not those of an MCAP file");
    crc_ = Crc32(0, content_);
  }

  /// False after the footer.
  bool ReadRecord() {
    record_at_ = offset_;
    content_.clear();
    const size_t head_size = Fetch(kHead);
    if (head_size == 0) End("the file ends without its index: it was cut off");
    if (head_size < kHead) End("the file ends within a record: it was cut off");
    const std::string head = content_;
    const auto opcode = static_cast<McapOpcode>(head[0]);
    const auto length = Fields(std::string_view(head).substr(1)).Get<uint64_t>();
    if (opcode == McapOpcode{0} || length > kMostRecord) End("there is no record here, but other bytes");
    content_.clear();
    if (Fetch(length) < length) End("the file ends within a " + NameOf(opcode) + ": it was cut off");
    if (opcode == McapOpcode::kDataEnd) {
      Fields fields(content_);
      Expect(fields.Get<uint32_t>(), crc_, "the data section");
      summary_ = true;
      crc_ = 0;
      return true;
    }
    if (opcode == McapOpcode::kFooter) {
      ReadFooter(head);
      return false;
    }
    crc_ = Crc32(Crc32(crc_, head), content_);
    if (!summary_) Take(opcode, content_);
    return true;
  }

  void ReadFooter(const std::string& head) {
    Fields fields(content_);
    fields.Get<uint64_t>();
    fields.Get<uint64_t>();
    const auto crc = fields.Get<uint32_t>();
    if (!fields.ok()) End("the footer record is too short");
    if (!summary_) End("the record that ends the data is missing: the file was changed");
    Expect(crc, Crc32(Crc32(crc_, head), std::string_view(content_).substr(0, 16)), "the index");
    record_at_ = offset_;
    content_.clear();
    Fetch(kMcapMagic.size() + 1);
    if (content_.size() < kMcapMagic.size()) End("the file ends within its last bytes: it was cut off");
    if (content_ != kMcapMagic) End("other bytes stand at the file's end");
  }

  void Expect(uint32_t stored, uint32_t found, const std::string& what) const {
    if (stored != 0 && stored != found) End("the checksum of " + what + " is wrong: the file was changed");
  }

  void Take(McapOpcode opcode, std::string_view content) {
    Fields fields(content);
    switch (opcode) {
      case McapOpcode::kSchema: {
        const auto id = fields.Get<uint16_t>();
        McapSchema schema;
        schema.name = fields.Text();
        schema.encoding = fields.Text();
        schema.data = fields.Text();
        if (fields.ok()) schemas_[id] = std::move(schema);
        break;
      }
      case McapOpcode::kChannel: {
        const auto id = fields.Get<uint16_t>();
        McapChannel channel;
        channel.schema = fields.Get<uint16_t>();
        channel.topic = fields.Text();
        channel.encoding = fields.Text();
        if (fields.ok()) channels_[id] = std::move(channel);
        break;
      }
      case McapOpcode::kMessage:
        TakeMessage(fields);
        break;
      case McapOpcode::kChunk:
        TakeChunk(fields);
        break;
      case McapOpcode::kMetadata:
        TakeMetadata(fields);
        break;
      case McapOpcode::kAttachment:
        TakeAttachment(fields, content);
        break;
      default:
        break;  // Indices are not needed to read from the beginning; what is not known is passed over.
    }
    if (!fields.ok()) End("the " + NameOf(opcode) + " is too short for its fields");
  }

  void TakeMessage(Fields& fields) {
    const auto id = fields.Get<uint16_t>();
    fields.Get<uint32_t>();
    const auto time = fields.Get<uint64_t>();
    fields.Get<uint64_t>();
    if (!fields.ok()) return;
    const auto channel = channels_.find(id);
    if (channel == channels_.end())
      End("a message is of channel " + std::to_string(id) + ", which there is not");
    static const McapSchema kNoSchema;
    const auto schema = schemas_.find(channel->second.schema);
    handler_.OnMessage(channel->second, schema == schemas_.end() ? kNoSchema : schema->second, time,
                       fields.rest(), record_at_);
  }

  void TakeChunk(Fields& fields) {
    fields.Get<uint64_t>();
    fields.Get<uint64_t>();
    const auto size = fields.Get<uint64_t>();
    const auto crc = fields.Get<uint32_t>();
    const std::string compression = fields.Text();
    const std::string_view records = fields.Bytes(fields.Get<uint64_t>());
    if (!fields.ok()) return;
    if (size > kMostRecord) End("a chunk says that it holds " + std::to_string(size) + " bytes");
    std::string text;
    if (compression == "zstd") {
      if (!DecompressZstd(records, size, &text)) End("the chunk can't be decompressed: the file was changed");
    } else if (compression.empty()) {
      text = records;
    } else {
      End("the chunk is compressed by '" + compression + "'; zstd is read, and none");
    }
    Expect(crc, Crc32(0, text), "the chunk");
    Fields inside(text);
    while (!inside.done()) {
      const auto opcode = static_cast<McapOpcode>(inside.Get<uint8_t>());
      const std::string_view content = inside.Bytes(inside.Get<uint64_t>());
      if (!inside.ok()) End("a record in the chunk is too short");
      const bool allowed =
          opcode == McapOpcode::kSchema || opcode == McapOpcode::kChannel || opcode == McapOpcode::kMessage;
      if (allowed) Take(opcode, content);
    }
  }

  void TakeMetadata(Fields& fields) {
    const std::string name = fields.Text();
    Fields map(fields.Bytes(fields.Get<uint32_t>()));
    std::map<std::string, std::string> values;
    while (fields.ok() && map.ok() && !map.done()) {
      std::string key = map.Text();
      values[std::move(key)] = map.Text();
    }
    if (!map.ok()) End("the metadata record is too short for its fields");
    if (fields.ok()) handler_.OnMetadata(name, values, record_at_);
  }

  void TakeAttachment(Fields& fields, std::string_view content) {
    fields.Get<uint64_t>();
    fields.Get<uint64_t>();
    const std::string name = fields.Text();
    fields.Text();
    const std::string_view data = fields.Bytes(fields.Get<uint64_t>());
    const size_t covered = content.size() - fields.rest().size();
    const auto crc = fields.Get<uint32_t>();
    if (!fields.ok()) return;
    Expect(crc, Crc32(0, content.substr(0, covered)), "an attachment");
    handler_.OnAttachment(name, data, record_at_);
  }

  const ByteSource& source_;
  const std::string& file_;
  McapHandler& handler_;
  std::string content_;
  uint64_t offset_ = 0, record_at_ = 0;
  uint32_t crc_ = 0;
  bool summary_ = false;
  std::map<uint16_t, McapSchema> schemas_;
  std::map<uint16_t, McapChannel> channels_;
};

}  // namespace

ByteSource BytesOf(std::string_view text) {
  return [text](char* buffer, size_t size) mutable {
    const size_t got = text.copy(buffer, size);
    text.remove_prefix(got);
    return got;
  };
}

std::optional<McapProblem> ReadMcap(const ByteSource& source, const std::string& file, McapHandler& handler) {
  return McapReader(source, file, handler).Read();
}

}  // namespace tether::evaluation
