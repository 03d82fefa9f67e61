#include "tether/evaluation/mcap/zstd.h"

#include <zstd.h>

#include <algorithm>
#include <new>

namespace tether::evaluation {
namespace {

constexpr int kLevel = 1;
constexpr size_t kPiece = size_t{1} << 18;

struct FreeDecoder {
  void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
};

}  // namespace

struct ZstdCompressor::Impl {
  Impl() : context(ZSTD_createCCtx()) {
    if (context == nullptr) throw std::bad_alloc();
  }
  ~Impl() { ZSTD_freeCCtx(context); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ZSTD_CCtx* context;
};

ZstdCompressor::ZstdCompressor() : impl_(std::make_unique<Impl>()) {}
ZstdCompressor::~ZstdCompressor() = default;
ZstdCompressor::ZstdCompressor(ZstdCompressor&&) noexcept = default;

void ZstdCompressor::Append(std::string_view text, std::string* out) {
  const size_t before = out->size();
  out->resize(before + ZSTD_compressBound(text.size()));
  const size_t size = ZSTD_compressCCtx(impl_->context, out->data() + before, out->size() - before,
                                        text.data(), text.size(), kLevel);
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();  // Its only reason here.
  out->resize(before + size);
}

bool DecompressZstd(std::string_view frame, size_t size, std::string* text) {
  const std::unique_ptr<ZSTD_DStream, FreeDecoder> stream(ZSTD_createDStream());
  if (stream == nullptr) throw std::bad_alloc();
  ZSTD_inBuffer in{frame.data(), frame.size(), 0};
  text->clear();
  for (;;) {
    const size_t before = text->size();
    // One byte more than there should be, so that a longer frame is noticed.
    text->resize(std::min(size + 1, before + kPiece));
    ZSTD_outBuffer out{text->data(), text->size(), before};
    const size_t rest = ZSTD_decompressStream(stream.get(), &out, &in);
    if (ZSTD_isError(rest) != 0) return false;
    text->resize(out.pos);
    if (rest == 0) return text->size() == size && in.pos == in.size;
    if (out.pos > size) return false;
    if (in.pos == in.size && out.pos == before) return false;  // It ends within the frame.
  }
}

}  // namespace tether::evaluation
