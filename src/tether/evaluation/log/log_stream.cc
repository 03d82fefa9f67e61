#include "tether/evaluation/log/log_stream.h"

#include <pthread.h>

#include <cassert>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <csignal>
#include <cstring>
#include <mutex>
#include <thread>

#include "tether/common/log.h"
#include "tether/common/text.h"
#include "tether/evaluation/log/byte_queue.h"
#include "tether/evaluation/log/log_sink.h"
#include "tether/evaluation/log/message_template.h"
#include "tether/evaluation/mcap/mcap_writer.h"

namespace tether::evaluation {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kLook = std::chrono::milliseconds(30);    // Between looks at the queue: a chunk each.
constexpr auto kRetry = std::chrono::milliseconds(500);  // After writing failed.
constexpr size_t kChunkBytes = size_t{1} << 19;          // A chunk is closed when it is larger.
constexpr size_t kMostUnwritten = size_t{64} << 20;      // Bytes kept for a disk that has no room.
constexpr size_t kMostBacklog = size_t{256} << 20;       // Bytes kept for a disk that does not answer.

enum class Kind : uint32_t { kTemplate, kNumbers, kText };

/// How an entry of the queue begins.
struct Head {
  Kind kind;
  int32_t target;  ///< The channel, or the template for kNumbers.
  uint64_t time;   ///< ns
};

std::string_view Bytes(const Head& head) { return {reinterpret_cast<const char*>(&head), sizeof head}; }

uint64_t Nanoseconds(double time) { return static_cast<uint64_t>(std::llround(std::max(time, 0.0) * 1e9)); }

}  // namespace

struct LogStream::Impl {
  Impl(const std::string& path, const LogPreamble& preamble) : sink(path), writer(preamble.library) {
    std::map<std::string, uint16_t> schemas;
    for (const LogChannel& channel : preamble.channels) {
      if (!schemas.contains(channel.schema_name)) {
        schemas[channel.schema_name] = writer.AddSchema({channel.schema_name, "jsonschema", channel.schema});
      }
      channels.push_back(writer.AddChannel({channel.topic, schemas[channel.schema_name], "json"}));
    }
    writer.AddMetadata(preamble.metadata_name, preamble.metadata);
    for (const auto& [name, text] : preamble.files) writer.AddAttachment(name, "text/plain", text);
    unwritten = writer.Take();
    Flush();
    thread = std::thread([this] { Run(); });
  }

  /// The writing thread. Signals are for the main one, and a size limit is an error of write().
  void Run() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);
    for (bool last = false; !last;) {
      {
        std::unique_lock lock(mutex);
        wake.wait_for(lock, kLook, [&] { return closing; });
        last = closing;
      }
      Drain();
      writer.CloseChunk();
      if (last) writer.Finish();
      Collect();
      if (failure == 0 || last || Clock::now() >= retry_at) Flush();
    }
  }

  void Drain() {
    while (queue.Pop(&entry)) {
      Head head{};
      std::memcpy(&head, entry.data(), sizeof head);
      const std::string_view body = std::string_view(entry).substr(sizeof head);
      if (head.kind == Kind::kTemplate) {
        templates.emplace_back(head.target, MessageTemplate(body));
        continue;
      }
      size_t channel = static_cast<size_t>(head.target);
      if (head.kind == Kind::kNumbers) {
        numbers.resize(body.size() / sizeof(double));
        std::memcpy(numbers.data(), body.data(), body.size());
        message.clear();
        const auto& [target, filled] = templates[channel];
        filled.Fill(head.time, numbers, &message);
        channel = static_cast<size_t>(target);
      } else {
        message.assign(body);
      }
      writer.AddMessage(channels[channel], head.time, message);
      newest = head.time;
      if (writer.open_bytes() >= kChunkBytes) {
        writer.CloseChunk();
        Collect();
        if (failure == 0) Flush();
      }
    }
  }

  /// Takes what was composed. While nothing can be written, only so much is kept: the rest is lost.
  void Collect() {
    std::string more = writer.Take();
    if (unwritten.size() + more.size() > kMostUnwritten) lost = true;
    if (!lost) unwritten += more;
  }

  void Flush() {
    if (unwritten.empty()) return;
    const int error = sink.Append(unwritten);
    if (error == 0) {
      unwritten.clear();
      failure = lost ? failure : 0;
      written_until = newest;
      return;
    }
    if (!said) {
      LogWarning("--log: cannot write " + sink.path() + ": " + std::strerror(error) +  // NOLINT: glibc's
                 "; the run goes on, and the log has it up to " + Until());
    }
    said = true;
    failure = error;
    retry_at = Clock::now() + kRetry;
  }

  std::string Until() const { return Fixed(1e-9 * static_cast<double>(written_until), 2) + " s"; }

  LogSink sink;
  McapWriter writer;
  std::vector<uint16_t> channels;  // In the file, by place in the preamble.
  ByteQueue queue;
  int num_templates = 0;  // Of the thread of the run.
  bool overrun = false;   // Of the thread of the run: messages were dropped.

  // Of the writing thread.
  std::vector<std::pair<int, MessageTemplate>> templates;
  std::string entry, message, unwritten;
  std::vector<double> numbers;
  Clock::time_point retry_at;
  uint64_t newest = 0, written_until = 0;  // ns
  int failure = 0;                         // Of the last attempt to write.
  bool said = false, lost = false;

  std::mutex mutex;
  std::condition_variable wake;
  bool closing = false;
  std::thread thread;
};

LogStream::LogStream(const std::string& path, const LogPreamble& preamble)
    : impl_(std::make_unique<Impl>(path, preamble)) {}

LogStream::~LogStream() { Close(); }

int LogStream::AddTemplate(int channel, std::string_view text) {
  impl_->queue.Push(Bytes({Kind::kTemplate, channel, 0}), text);
  return impl_->num_templates++;
}

void LogStream::Write(int message_template, double time, std::span<const double> numbers) {
  if (impl_->queue.backlog() > kMostBacklog) {
    impl_->overrun = true;
    return;
  }
  impl_->queue.Push(Bytes({Kind::kNumbers, message_template, Nanoseconds(time)}),
                    {reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()});
}

void LogStream::WriteText(int channel, double time, std::string_view json) {
  if (impl_->queue.backlog() > kMostBacklog) {
    impl_->overrun = true;
    return;
  }
  impl_->queue.Push(Bytes({Kind::kText, channel, Nanoseconds(time)}), json);
}

std::string LogStream::Close() {
  Impl& stream = *impl_;
  if (stream.thread.joinable()) {
    {
      const std::lock_guard lock(stream.mutex);
      stream.closing = true;
    }
    stream.wake.notify_one();
    stream.thread.join();
  }
  if (stream.failure == 0 && !stream.lost && !stream.overrun) return "";
  const std::string why =
      stream.failure != 0 ? std::strerror(stream.failure) : "the disk did not keep up";  // NOLINT: glibc's
  return why + "; the log has the run up to " + stream.Until();
}

}  // namespace tether::evaluation
