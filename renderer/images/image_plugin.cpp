#include <stdexcept>
#include <string>

#include <dlfcn.h>

#include "renderer/images/formats.h"

namespace tensorray {
namespace {

/// The run path of the program, which `dlopen` searches, is its own folder (CMAKE_BUILD_RPATH).
const ImagePlugin& load() {
  constexpr const char* file = "libtensorray_pictures.so";
#ifdef TENSORRAY_LOADED_FIRST
  dlopen(TENSORRAY_LOADED_FIRST, RTLD_LAZY | RTLD_LOCAL);  // For speed (CMakeLists.txt); without it all works, too.
#endif
  void* const library = dlopen(file, RTLD_LAZY | RTLD_LOCAL);
  void* const functions = library ? dlsym(library, "tensorray_image_plugin") : nullptr;
  if (!functions)
    throw std::runtime_error(std::string("cannot load ") + file + ", which must be beside the program: " + dlerror());
  return *static_cast<const ImagePlugin*>(functions);
}

}  // namespace

const ImagePlugin& image_plugin() {
  static const ImagePlugin& library = load();
  return library;
}

}  // namespace tensorray
