#include "tether/sim/renderer.h"

#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include "testing/common/scratch_folder.h"
#include "testing/sim/test_scenes.h"
#include "tether/common/error.h"

namespace tether::sim {
namespace {

std::vector<unsigned char> ReadPng(const std::string& path, unsigned* width, unsigned* height) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&image, path.c_str())) return {};
  image.format = PNG_FORMAT_RGB;
  std::vector<unsigned char> pixels(PNG_IMAGE_SIZE(image));
  png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr);
  *width = image.width;
  *height = image.height;
  return pixels;
}

size_t Count(const std::vector<unsigned char>& pixels, const auto& matches) {
  size_t count = 0;
  for (size_t i = 0; i + 2 < pixels.size(); i += 3) count += matches(pixels[i], pixels[i + 1], pixels[i + 2]);
  return count;
}

TEST(RendererTest, PicturesShowTheWorldAsItIs) {
  scene::Scene scene;
  scene.objects = {MakeTable(), MakeObject("shelf", geometry::Box{{0.3, 0.3, 0.1}}, {0.35, -0.35, 0.05}),
                   MakeObject("box", geometry::Box{{0.05, 0.05, 0.05}}, {0.5, 0, 0.025}, 0.1),
                   MakeHook({0.9, 0.3, 0.01})};
  scene.objects[2].rgba = Eigen::Vector4d(1, 0, 0, 1);
  scene.robots = {MakePanda()};
  World world(scene, {{"panda", Panda()}});
  Renderer renderer(world, 640, 480);
  const char* keep = std::getenv("TETHER_KEEP_PICTURES");
  const ScratchFolder folder;
  const std::string path = keep ? std::string(keep) + "/world.png" : folder.File("world.png");
  renderer.WritePng(world, path);
  unsigned width = 0, height = 0;
  const std::vector<unsigned char> before = ReadPng(path, &width, &height);
  EXPECT_EQ(width, 640u);
  EXPECT_EQ(height, 480u);
  const auto red = [](int r, int g, int b) { return r > 80 && g < r / 3 && b < r / 3; };
  EXPECT_GT(Count(before, red), 50u);
  // Moving the table on rails builds the model anew; the renderer goes on.
  world.MoveObject("table", math::Pose(Eigen::Vector3d(0.5, 0, -0.25)), 0.01);
  world.PlaceObject("box", math::Pose(Eigen::Vector3d(0, 0, -40)));
  renderer.WritePng(world, path);
  EXPECT_EQ(Count(ReadPng(path, &width, &height), red), 0u);
}

TEST(RendererTest, MistakesAreExplained) {
  World world(scene::Scene(), {});
  EXPECT_THROW(Renderer(world, 0, 480), InputError);
  Renderer renderer(world, 64, 48);
  try {
    renderer.WritePng(world, "/nowhere/world.png");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("/nowhere/world.png"));
  }
}

}  // namespace
}  // namespace tether::sim
