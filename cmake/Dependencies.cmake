# Every library the program is built on, as imported targets. ARCHITECTURE.md says who may use which.

find_package(PkgConfig REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(TBB REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(fmt REQUIRED)
find_package(CLI11 REQUIRED)
find_package(assimp REQUIRED)

# OpenVDB's find module sits outside CMake's search path on Debian.
file(GLOB OPENVDB_MODULE_PATHS /usr/lib/*/cmake/OpenVDB /usr/lib/cmake/OpenVDB /usr/local/lib*/cmake/OpenVDB)
list(APPEND CMAKE_MODULE_PATH ${OPENVDB_MODULE_PATHS})
find_package(OpenVDB REQUIRED COMPONENTS openvdb)

find_package(embree 4 QUIET)
if(NOT embree_FOUND)
  find_package(embree 3 REQUIRED)
endif()

# The CMake packages of these two name folders that distributions do not install; their pkg-config modules are sound.
pkg_check_modules(OpenImageIO REQUIRED IMPORTED_TARGET OpenImageIO>=2.4)
pkg_check_modules(OpenColorIO REQUIRED IMPORTED_TARGET OpenColorIO>=2.1)

find_package(VTK REQUIRED COMPONENTS CommonCore CommonDataModel IOXML)
