#pragma once

#include <string>

namespace tether::sim {

/// What a plugin offers that has OpenGL without a display and writes PNG: few commands draw. It throws
/// nothing; what went wrong is returned as text, empty if all is well.
class Drawing {
 public:
  virtual ~Drawing() = default;

  /// Makes an OpenGL context that needs no display, current in this thread.
  virtual std::string MakeContext() = 0;
  /// Makes the context current in this thread again.
  virtual std::string MakeCurrent() = 0;
  /// A PNG file's bytes. `pixels` has 3 bytes a pixel, red first, the lowest row first.
  virtual std::string EncodePng(const unsigned char* pixels, int width, int height,
                                std::string& png) const = 0;
};

/// The plugin's function, `TetherMakeDrawing`; the caller owns what it makes.
using MakeDrawingFunction = Drawing*();

}  // namespace tether::sim
