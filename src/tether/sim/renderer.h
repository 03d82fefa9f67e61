#pragma once

#include <memory>
#include <string>

#include "tether/sim/world.h"

namespace tether::sim {

/// Draws pictures of a world off-screen (EGL, no display). One per thread.
class Renderer {
 public:
  /// Throws InputError, with what is missing, when no off-screen context can be made.
  Renderer(const World& world, int width, int height);
  ~Renderer();

  /// Writes a PNG of the world as it is now. Throws InputError if the file can't be written.
  void WritePng(const World& world, const std::string& path);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tether::sim
