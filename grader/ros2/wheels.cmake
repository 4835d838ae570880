# Make a plain `colcon build` use the wheels' packages. setup.bash names this file as CMAKE_TOOLCHAIN_FILE, which CMake
# reads from the environment; it does not read CMAKE_PROJECT_INCLUDE from there.
set(CMAKE_PROJECT_INCLUDE "${CMAKE_CURRENT_LIST_DIR}/../host/wheel_prefix.cmake")
