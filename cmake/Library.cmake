# For C++ programs of others: the shared library libtensorray, its public headers, and `find_package(tensorray)`.
#
# The header tensorray/tensorray.h includes what is public. It is installed with all headers that these include in turn,
# under their own paths.

set(public_headers volumes/files/tensor_files.h volumes/tensors/eigenvalues.h volumes/making/generators.h
    volumes/tensors/invariants.h volumes/bricks/tensor_field.h renderer/meshes/mesh.h tracing/trace/trace.h
    tracing/paths/paths.h tracing/flow/flow_map.h integrators/methods/read_scene.h scenes/scene/scene.h
    scenes/scene/render.h scenes/outputs/write_outputs.h)

# The headers of this project that `headers` include, and themselves.
function(with_included result)
  set(found "")
  set(todo ${ARGN})
  while(todo)
    list(POP_FRONT todo header)
    if(header IN_LIST found)
      continue()
    endif()
    list(APPEND found ${header})
    file(STRINGS ${PROJECT_SOURCE_DIR}/${header} includes REGEX "^#include \"")
    list(TRANSFORM includes REPLACE "^#include \"([^\"]*)\".*" "\\1")
    list(APPEND todo ${includes})
  endwhile()
  set(${result} ${found} PARENT_SCOPE)
endfunction()

# Not linked by the project's own programs, which start faster without it.
add_library(libtensorray SHARED ${PROJECT_SOURCE_DIR}/cmake/package/library.cpp)
target_link_libraries(libtensorray PRIVATE integrators tensorray_options)
set_target_properties(libtensorray PROPERTIES
                      LINK_LIBRARY_OVERRIDE "WHOLE_ARCHIVE,base,renderer,volumes,tracing,scenes,integrators")
target_link_options(libtensorray PRIVATE -Wl,--version-script=${PROJECT_SOURCE_DIR}/cmake/package/symbols.map)
add_dependencies(libtensorray tensorray_pictures)
set_target_properties(libtensorray PROPERTIES OUTPUT_NAME tensorray EXPORT_NAME tensorray VERSION ${PROJECT_VERSION}
                      SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
                      LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib BUILD_RPATH ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}
                      INSTALL_RPATH "$ORIGIN/tensorray")
target_include_directories(libtensorray INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/tensorray>
                           $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_link_libraries(libtensorray INTERFACE Eigen3::Eigen nlohmann_json::nlohmann_json fmt::fmt)
target_compile_features(libtensorray INTERFACE cxx_std_17)

list(TRANSFORM public_headers REPLACE "(.+)" "#include \"\\1\"" OUTPUT_VARIABLE PUBLIC_INCLUDES)
list(JOIN PUBLIC_INCLUDES "\n" PUBLIC_INCLUDES)
configure_file(${PROJECT_SOURCE_DIR}/cmake/package/tensorray.h.in ${CMAKE_BINARY_DIR}/package/tensorray.h @ONLY)

include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/tensorray)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/package/tensorrayConfig.cmake.in
                              ${CMAKE_BINARY_DIR}/package/tensorrayConfig.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/package/tensorrayConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)

with_included(installed_headers ${public_headers})
foreach(header ${installed_headers})
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tensorray/${folder} COMPONENT development)
endforeach()
install(FILES ${CMAKE_BINARY_DIR}/package/tensorray.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tensorray
        COMPONENT development)
# Optional: a folder that was set up for some parts alone does not have it.
install(TARGETS libtensorray EXPORT tensorrayTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT programs NAMELINK_COMPONENT development OPTIONAL)
install(EXPORT tensorrayTargets NAMESPACE tensorray:: DESTINATION ${package_folder} COMPONENT development)
install(FILES ${CMAKE_BINARY_DIR}/package/tensorrayConfig.cmake ${CMAKE_BINARY_DIR}/package/tensorrayConfigVersion.cmake
        DESTINATION ${package_folder} COMPONENT development)
