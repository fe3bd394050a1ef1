# All libraries that the program uses, as imported targets. ARCHITECTURE.md lists which folder may use which library.

find_package(PkgConfig REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)
find_package(assimp REQUIRED)
find_package(PNG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(OpenEXR 3 REQUIRED)

# On Debian, OpenVDB's find module is outside CMake's search path.
file(GLOB OPENVDB_MODULE_PATHS /usr/lib/*/cmake/OpenVDB /usr/lib/cmake/OpenVDB /usr/local/lib*/cmake/OpenVDB)
list(APPEND CMAKE_MODULE_PATH ${OPENVDB_MODULE_PATHS})
find_package(OpenVDB REQUIRED COMPONENTS openvdb)

find_package(embree 4 QUIET)
if(NOT embree_FOUND)
  find_package(embree 3 REQUIRED)
endif()

# The CMake packages of these two refer to folders that distributions do not install; their pkg-config modules work.
pkg_check_modules(OpenImageIO REQUIRED IMPORTED_TARGET OpenImageIO>=2.4)
pkg_check_modules(OpenColorIO REQUIRED IMPORTED_TARGET OpenColorIO>=2.1)
pkg_check_modules(lcms2 REQUIRED IMPORTED_TARGET lcms2>=2.9)

pkg_check_modules(Highway REQUIRED IMPORTED_TARGET libhwy>=1.0)
# Code with vectors is compiled once for each instruction set: on x86 for SSE2, AVX2 and AVX-512. Those between them
# would make builds longer, and renders hardly faster. Structs of the kernel have vectors as members, which is not
# possible where their size is unknown at compile time.
target_compile_definitions(PkgConfig::Highway INTERFACE
  "HWY_DISABLED_TARGETS=(HWY_SSSE3|HWY_SSE4|HWY_AVX3_DL|HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128|HWY_RVV)")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Highway's NEON code uses these instructions, and GCC requires that its callers are compiled for them too.
  target_compile_options(PkgConfig::Highway INTERFACE -march=armv8-a+crypto)
endif()

if(TENSORRAY_IMPORT)
  find_package(VTK REQUIRED COMPONENTS CommonCore CommonDataModel CommonExecutionModel FiltersCore FiltersGeneral
               IOCGNSReader IOCore IOEnSight IOExodus IOGeometry IOLegacy IOParallel IOXML cgns exodusII hdf5)
  find_package(LibXml2 REQUIRED)

  # The CMake packages of these two libraries do not work with Debian's other packages.
  find_path(Teem_INCLUDE_DIR teem/nrrd.h REQUIRED)
  find_library(Teem_LIBRARY teem REQUIRED)
  add_library(Teem::teem INTERFACE IMPORTED)
  target_include_directories(Teem::teem INTERFACE ${Teem_INCLUDE_DIR})
  target_link_libraries(Teem::teem INTERFACE ${Teem_LIBRARY})

  find_path(NIfTI_INCLUDE_DIR nifti/nifti2_io.h REQUIRED)
  find_library(NIfTI_LIBRARY nifti2 REQUIRED)
  find_library(NIfTI_znz_LIBRARY znz REQUIRED)
  add_library(NIfTI::nifti2 INTERFACE IMPORTED)
  target_include_directories(NIfTI::nifti2 INTERFACE ${NIfTI_INCLUDE_DIR}/nifti)
  target_link_libraries(NIfTI::nifti2 INTERFACE ${NIfTI_LIBRARY} ${NIfTI_znz_LIBRARY})
endif()

if(TENSORRAY_VIEW)
  find_package(Boost 1.74 REQUIRED)  # Headers alone: Asio and Beast.
endif()

if(TENSORRAY_PYTHON)
  if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
    set(Python3_EXECUTABLE /usr/bin/python3)  # The system's, whose packages the module uses, and no other in PATH.
  endif()
  find_package(Python3 3.9 REQUIRED COMPONENTS Interpreter Development.Module)
  find_package(pybind11 2.10 REQUIRED)
endif()

if(NOT TENSORRAY_SANITIZE)  # MPI itself would have to be built with the sanitizers.
  find_package(MPI QUIET COMPONENTS C)
  if(NOT MPI_C_FOUND)
    message(STATUS "No MPI: mpirun cannot divide renders")
  endif()
endif()

if(TENSORRAY_TESTS)
  find_package(benchmark REQUIRED)
endif()
