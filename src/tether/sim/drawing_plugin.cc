#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <png.h>

#include "tether/sim/drawing.h"

namespace tether::sim {
namespace {

class EglDrawing final : public Drawing {
 public:
  EglDrawing() = default;
  ~EglDrawing() override {
    if (context_ == EGL_NO_CONTEXT) return;
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
  }
  EglDrawing(const EglDrawing&) = delete;
  EglDrawing& operator=(const EglDrawing&) = delete;

  std::string MakeContext() override {
    const auto get_display =
        reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
    if (get_display == nullptr) return "EGL has no eglGetPlatformDisplayEXT";
    display_ = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (display_ == EGL_NO_DISPLAY || !eglInitialize(display_, nullptr, nullptr)) {
      return "EGL's surfaceless platform isn't there";
    }
    const EGLint wanted[] = {EGL_SURFACE_TYPE,
                             EGL_PBUFFER_BIT,
                             EGL_RENDERABLE_TYPE,
                             EGL_OPENGL_BIT,
                             EGL_RED_SIZE,
                             8,
                             EGL_GREEN_SIZE,
                             8,
                             EGL_BLUE_SIZE,
                             8,
                             EGL_DEPTH_SIZE,
                             24,
                             EGL_NONE};
    EGLConfig config;
    EGLint count = 0;
    if (!eglChooseConfig(display_, wanted, &config, 1, &count) || count == 0) {
      return "EGL has no configuration for OpenGL";
    }
    if (!eglBindAPI(EGL_OPENGL_API)) return "EGL has no OpenGL";
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, nullptr);
    return context_ == EGL_NO_CONTEXT ? "EGL makes no OpenGL context" : MakeCurrent();
  }

  std::string MakeCurrent() override {
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) return "";
    return "EGL can't use its context without a surface";
  }

  std::string EncodePng(const unsigned char* pixels, int width, int height, std::string& png) const override {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(width);
    image.height = static_cast<png_uint_32>(height);
    image.format = PNG_FORMAT_RGB;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    png.assign(size, '\0');
    // A negative stride: the first row is the lowest.
    if (!png_image_write_to_memory(&image, png.data(), &size, 0, pixels, -3 * width, nullptr)) {
      return image.message;
    }
    png.resize(size);
    return "";
  }

 private:
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace
}  // namespace tether::sim

extern "C" tether::sim::Drawing* TetherMakeDrawing() { return new tether::sim::EglDrawing; }
