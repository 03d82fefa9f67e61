#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace tether::evaluation {

/// Compresses by Zstandard, fast rather than small.
class ZstdCompressor {
 public:
  ZstdCompressor();
  ~ZstdCompressor();
  ZstdCompressor(ZstdCompressor&&) noexcept;
  /// Appends one frame that holds `text`.
  void Append(std::string_view text, std::string* out);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads a frame of `size` bytes. False if it is malformed or of another size; memory grows no further than
/// what the frame really holds.
bool DecompressZstd(std::string_view frame, size_t size, std::string* text);

}  // namespace tether::evaluation
