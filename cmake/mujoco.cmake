# MuJoCo as Debian packages it. Its CMake target names /usr/include/libqhull_r, which only libqhull-dev would provide and
# which no header of MuJoCo includes; CMake refuses a target with a folder that is not there.
find_package(mujoco CONFIG REQUIRED)
get_target_property(mujoco_includes mujoco::mujoco INTERFACE_INCLUDE_DIRECTORIES)
list(FILTER mujoco_includes EXCLUDE REGEX "libqhull_r")
set_target_properties(mujoco::mujoco PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${mujoco_includes}")
