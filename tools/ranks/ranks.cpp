#include "tools/ranks/ranks.h"

#include <cstdlib>
#include <stdexcept>
#include <string>

#include <dlfcn.h>

namespace tensorray {
namespace {

/// Whether mpirun, or a queue in its place, started this process with others.
bool has_others() {
  for (const char* count : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"})
    if (const char* const text = std::getenv(count)) return std::atoi(text) > 1;
  return std::getenv("PMIX_RANK") != nullptr;
}

/// Loads the part of the program that uses MPI. The run path of the program, which `dlopen` searches, is its own
/// folder. MPI loads parts of its own, which need its names.
JoinedRanks* (*load_mpi())(const Progress* progress) {
  void* const library = dlopen("libtensorray_mpi.so", RTLD_NOW | RTLD_GLOBAL);
  void* const function = library ? dlsym(library, "tensorray_join_ranks") : nullptr;
  if (!function)
    throw std::runtime_error(
        std::string("mpirun: this tensorray cannot use MPI; build it where MPI is installed (tools/setup release mpi), "
                    "or divide the work with --shard: ") +
        dlerror());
  return reinterpret_cast<JoinedRanks* (*)(const Progress*)>(function);
}

}  // namespace

std::unique_ptr<JoinedRanks> join_ranks(const Progress& progress) {
  if (!has_others()) return nullptr;
  std::unique_ptr<JoinedRanks> ranks(load_mpi()(&progress));
  if (ranks->count() > 1) return ranks;
  ranks->finish();
  return nullptr;
}

}  // namespace tensorray
