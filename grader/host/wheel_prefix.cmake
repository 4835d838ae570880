# Make `find_package` of the ROS 2 wheels usable: they export include directories of the machine that built them.
#
# Passed as -DCMAKE_PROJECT_INCLUDE, so it runs right after project(). What it does is put off to the end of the
# directory, when every find_package() of the CMakeLists.txt has made its imported targets, and then takes those
# directories out of INTERFACE_INCLUDE_DIRECTORIES that do not exist here. Without it CMake stops with
# "Imported target ... includes non-existent path".
function(kit_drop_missing_include_directories)
  get_property(targets DIRECTORY PROPERTY IMPORTED_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(directories ${target} INTERFACE_INCLUDE_DIRECTORIES)
    if(NOT directories)
      continue()
    endif()
    set(kept "")
    foreach(directory IN LISTS directories)
      if(directory MATCHES "^\\$<" OR EXISTS "${directory}")
        list(APPEND kept "${directory}")
      endif()
    endforeach()
    set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${kept}")
  endforeach()
endfunction()

cmake_language(DEFER CALL kit_drop_missing_include_directories)

# Generate no C++ type support for introspection, which no Python loads. (That for C is loaded: rmw_fastrtps_cpp describes
# types by it, and without it no publisher can be made.) ament_cmake_core defines its macros once, so this one stays;
# CMake keeps the first as _ament_register_extension.
find_package(ament_cmake_core QUIET)
if(COMMAND ament_register_extension)
  macro(ament_register_extension extension_point package_name cmake_filename)
    if(NOT "${package_name}" STREQUAL "rosidl_typesupport_introspection_cpp")
      _ament_register_extension("${extension_point}" "${package_name}" "${cmake_filename}")
    endif()
  endmacro()
endif()
