# Strict warnings for the project's own code, and `tensorray_library(NAME)`, which makes a static library from a folder.

add_library(tensorray_options INTERFACE)
# No code here looks at errno of mathematical functions; without it, a square root is one instruction.
target_compile_options(tensorray_options INTERFACE -fno-math-errno)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # The compiler collects its garbage from 4 GB on, not from 128 MB: a seventh of its time, for a fifth more memory.
  target_compile_options(tensorray_options INTERFACE --param=ggc-min-heapsize=4000000)
endif()
# To look for warnings takes a tenth of the time: where they are not errors, nothing does.
if(NOT TENSORRAY_WERROR)
  target_compile_options(tensorray_options INTERFACE -w)
else()
  target_compile_options(tensorray_options INTERFACE -Werror -Wall -Wextra -Wpedantic -Wconversion -Wnon-virtual-dtor
                         -Woverloaded-virtual -Wcast-align -Wunused -Wnull-dereference)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # False positives inside inlined Eigen and standard library code at -O3.
    target_compile_options(tensorray_options INTERFACE -Wno-maybe-uninitialized -Wno-null-dereference
                           -Wno-array-bounds -Wno-stringop-overflow -Wno-free-nonheap-object)
  endif()
  if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    target_compile_options(tensorray_options INTERFACE -Wno-sign-conversion)  # Which -Wconversion of GCC leaves out.
  endif()
  if(NOT TENSORRAY_UNITY)
    target_compile_options(tensorray_options INTERFACE -Wshadow)
  elseif(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # What is in the unnamed namespace of a source, its group may shadow, and its classes may contain.
    target_compile_options(tensorray_options INTERFACE -Wshadow=local -Wno-subobject-linkage)
  endif()
endif()
if(TENSORRAY_SANITIZE)
  target_compile_definitions(tensorray_options INTERFACE TENSORRAY_SANITIZED)  # Clang 14 has no macro for all of them.
  target_compile_options(tensorray_options INTERFACE -fsanitize=${TENSORRAY_SANITIZE} -fno-omit-frame-pointer)
  if(TENSORRAY_SANITIZE MATCHES undefined)
    target_compile_options(tensorray_options INTERFACE -fno-sanitize-recover=undefined)
    if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
      target_compile_options(tensorray_options INTERFACE
                             -fsanitize-ignorelist=${CMAKE_SOURCE_DIR}/tests/undefined_sanitizer.txt)
    endif()
  endif()
  target_link_options(tensorray_options INTERFACE -fsanitize=${TENSORRAY_SANITIZE})
endif()
# Python is not built with the sanitizer of addresses, and must load its library first. Programs use the same library,
# because those that Python starts inherit it.
if(TENSORRAY_SANITIZE MATCHES address AND CMAKE_CXX_COMPILER_ID MATCHES Clang)
  execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=libclang_rt.asan-${CMAKE_SYSTEM_PROCESSOR}.so
                  OUTPUT_VARIABLE library OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(EXISTS "${library}")  # Otherwise Python is left out.
    set(TENSORRAY_SANITIZER_LIBRARY "${library}")
    get_filename_component(folder "${library}" DIRECTORY)
    # It opens libraries for the program, and looks for them where DT_RPATH says, not DT_RUNPATH.
    target_link_options(tensorray_options INTERFACE -shared-libsan -Wl,-rpath,${folder} -Wl,--disable-new-dtags)
  endif()
endif()
if(TENSORRAY_FUZZ)
  target_compile_options(tensorray_options INTERFACE -fsanitize=fuzzer-no-link)
endif()

# Objects of a library are linked into programs and into the Python module, which is a shared library. The second option
# lets the compiler inline as it does for programs.
function(tensorray_relocatable name)
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${name} PRIVATE -fno-semantic-interposition)
endfunction()

# Half of the time to compile most files is the headers that nearly all of them include: these are compiled once, for
# relocatable code. With GCC they bring their level of optimisation to all that uses them, so that `scenes` has its own.
# Those of `integrators` are also the scene and its keys, on which all methods depend.
function(tensorray_common_headers name)
  set(headers <Eigen/Geometry> <algorithm> <filesystem> <functional> <map> <memory> <optional> <string> <variant>
              <vector> <tbb/parallel_for.h>)
  if(name STREQUAL base)
    target_precompile_headers(base PRIVATE ${headers})
  elseif(name STREQUAL scenes)
    target_precompile_headers(scenes PRIVATE ${headers} <fmt/format.h> <nlohmann/json.hpp>)
  elseif(name STREQUAL integrators)
    target_precompile_headers(integrators PRIVATE ${headers} <fmt/format.h> <nlohmann/json.hpp>
                              ${PROJECT_SOURCE_DIR}/scenes/description/scene_keys.h
                              ${PROJECT_SOURCE_DIR}/scenes/scene/scene.h ${PROJECT_SOURCE_DIR}/scenes/scene/render.h)
  else()
    target_precompile_headers(${name} REUSE_FROM base)
  endif()
endfunction()

# Compiles the sources of a target in groups of 16, where headers and templates, which take most of the time, are compiled
# once. Names in unnamed namespaces must then differ within the target.
function(tensorray_compile_together target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${TENSORRAY_UNITY} UNITY_BUILD_BATCH_SIZE 16)
endfunction()

# tensorray_library(NAME [EXCEPT PATTERN...]): a static library of all sources in this folder and its subfolders,
# without those of file(GLOB) patterns (CONFIGURE_DEPENDS finds new files by itself).
function(tensorray_library name)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" EXCEPT)
  file(GLOB sources CONFIGURE_DEPENDS *.cpp */*.cpp)
  if(ARG_EXCEPT)
    file(GLOB others CONFIGURE_DEPENDS ${ARG_EXCEPT})
    list(REMOVE_ITEM sources ${others})
  endif()
  add_library(${name} STATIC ${sources})
  tensorray_compile_together(${name})
  tensorray_relocatable(${name})
  target_link_libraries(${name} PUBLIC Eigen3::Eigen PRIVATE tensorray_options)
  tensorray_common_headers(${name})
endfunction()
