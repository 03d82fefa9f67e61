#include "tether/sim/renderer.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <mujoco/mujoco.h>

#include "tether/common/error.h"
#include "tether/common/file.h"
#include "tether/common/plugin.h"
#include "tether/robot/mujoco_setup.h"
#include "tether/sim/drawing.h"
#include "tether/sim/world_impl.h"

namespace tether::sim {
namespace {

constexpr const char* kRemedy =
    "EGL with Mesa's surfaceless platform is needed (Debian: libegl1, libgl1-mesa-dri)";

[[noreturn]] void ThrowNoContext(const std::string& missing) {
  throw InputError("no picture can be drawn: " + missing, kRemedy);
}

/// An OpenGL context without display or window.
class OffscreenContext {
 public:
  OffscreenContext() {
    auto* const make =
        reinterpret_cast<MakeDrawingFunction*>(LoadPlugin("drawing", "TetherMakeDrawing", kRemedy));
    drawing_.reset(make());
    if (const std::string missing = drawing_->MakeContext(); !missing.empty()) ThrowNoContext(missing);
  }

  void MakeCurrent() const {
    if (const std::string missing = drawing_->MakeCurrent(); !missing.empty()) ThrowNoContext(missing);
  }
  const Drawing& drawing() const { return *drawing_; }

 private:
  std::unique_ptr<Drawing> drawing_;
};

// A view from the front and the side that is filled by the arms and by everything that isn't as large as a
// table.
mjvCamera FrameScene(const mjModel* model, const mjData* data, double aspect) {
  constexpr double kLarge = 0.6;
  constexpr double kAzimuth = 140, kElevation = -28;
  constexpr double kFilled = 0.92;     // share of the picture
  std::vector<Eigen::Vector4d> balls;  // centre and radius
  for (const bool take_large : {false, true}) {
    if (!balls.empty()) break;
    for (int geom = 0; geom < model->ngeom; ++geom) {
      const double radius = model->geom_rbound[geom];
      if (radius <= 0 || (!take_large && radius > kLarge)) continue;
      const mjtNum* centre = data->geom_xpos + 3 * geom;
      balls.emplace_back(centre[0], centre[1], centre[2], radius);
    }
  }
  if (balls.empty()) balls.emplace_back(0, 0, 0, 0.5);
  const double azimuth = kAzimuth * M_PI / 180, elevation = kElevation * M_PI / 180;
  const Eigen::Vector3d forward(std::cos(elevation) * std::cos(azimuth),
                                std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  const Eigen::Vector3d right(std::sin(azimuth), -std::cos(azimuth), 0);
  const Eigen::Vector3d up = right.cross(forward);
  const double half_height = kFilled * std::tan(model->vis.global.fovy * M_PI / 360);
  const double half_width = aspect * half_height;

  // Centring changes how large things look, and the distance where the centre is: a few rounds settle both.
  Eigen::Vector3d middle = balls.front().head<3>();
  double distance = 2;
  for (int round = 0; round < 30; ++round) {
    Eigen::Array2d low = Eigen::Array2d::Constant(1e9), high = -low;
    for (const Eigen::Vector4d& ball : balls) {
      const Eigen::Vector3d offset = ball.head<3>() - middle;
      const double depth = std::max(0.1, distance + offset.dot(forward));
      const Eigen::Array2d seen(offset.dot(right) / depth, offset.dot(up) / depth);
      low = low.min(seen - ball[3] / depth);
      high = high.max(seen + ball[3] / depth);
    }
    const Eigen::Array2d centre = (low + high) / 2, size = (high - low) / 2;
    middle += distance * (centre[0] * right + centre[1] * up);
    distance *= std::max(size[0] / half_width, size[1] / half_height);
  }
  mjvCamera camera;
  mjv_defaultCamera(&camera);
  for (int i = 0; i < 3; ++i) camera.lookat[i] = middle[i];
  camera.distance = distance;
  camera.azimuth = kAzimuth;
  camera.elevation = kElevation;
  return camera;
}

}  // namespace

struct Renderer::Impl {
  Impl(const World& world, int width_in, int height_in) : width(width_in), height(height_in) {
    mjv_defaultScene(&scene);
    mjr_defaultContext(&graphics);
    mjv_defaultOption(&visual);
    // The size of the off-screen buffer is a part of the model.
    const std::unique_ptr<mjModel, DeleteMujoco> model(mj_copyModel(nullptr, world.impl_->model.get()));
    model->vis.global.offwidth = width;
    model->vis.global.offheight = height;
    try {
      mjr_makeContext(model.get(), &graphics, mjFONTSCALE_100);
      mjr_setBuffer(mjFB_OFFSCREEN, &graphics);
    } catch (const robot::MujocoError& error) {
      ThrowNoContext(error.what());
    }
    mjv_makeScene(model.get(), &scene, 2000);
    camera = FrameScene(model.get(), world.impl_->data.get(), static_cast<double>(width) / height);
  }
  ~Impl() {
    mjr_freeContext(&graphics);
    mjv_freeScene(&scene);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  OffscreenContext context;
  int width, height;
  mjvScene scene;
  mjrContext graphics;
  mjvOption visual;
  mjvCamera camera;
};

Renderer::Renderer(const World& world, int width, int height) {
  if (width < 16 || height < 16 || width > 4096 || height > 4096) {
    throw InputError("a picture of " + std::to_string(width) + " × " + std::to_string(height) + " pixels",
                     "16 to 4096 pixels a side are accepted");
  }
  impl_ = std::make_unique<Impl>(world, width, height);
}
Renderer::~Renderer() = default;

void Renderer::WritePng(const World& world, const std::string& path) {
  Impl& r = *impl_;
  r.context.MakeCurrent();
  const mjModel* model = world.impl_->model.get();
  // Derived poses are those of the last step's beginning: bring a copy up to date, the world itself stays as
  // it is.
  const std::unique_ptr<mjData, DeleteMujoco> data(mj_makeData(model));
  mju_copy(data->qpos, world.impl_->data->qpos, model->nq);
  mj_kinematics(model, data.get());
  mj_comPos(model, data.get());
  mj_camlight(model, data.get());
  mjv_updateScene(model, data.get(), &r.visual, nullptr, &r.camera, mjCAT_ALL, &r.scene);
  r.scene.flags[mjRND_SHADOW] = 1;
  r.scene.flags[mjRND_REFLECTION] = 0;
  const mjrRect view = {0, 0, r.width, r.height};
  mjr_render(view, &r.scene, &r.graphics);
  std::vector<unsigned char> pixels(3 * static_cast<size_t>(r.width) * r.height);
  mjr_readPixels(pixels.data(), nullptr, view, &r.graphics);

  std::string picture;
  const std::string problem = r.context.drawing().EncodePng(pixels.data(), r.width, r.height, picture);
  if (!problem.empty()) throw InputError("the picture for '" + path + "' can't be made: " + problem);
  WriteFile(path, picture);
}

}  // namespace tether::sim
