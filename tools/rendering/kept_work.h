#pragma once
/// @file tools/rendering/kept_work.h
/// What a render continues: work of earlier runs, which their files hold.

#include <filesystem>
#include <functional>
#include <vector>

#include "base/process/work.h"
#include "scenes/scene/scene.h"
#include "tools/rendering/render_scene.h"

namespace tensorray {

struct KeptWork {
  std::vector<WorkUnit> units;   ///< Empty: none were begun.
  std::vector<WorkUnit> before;  ///< What is made before the units; empty if nothing is kept.
  std::filesystem::path file;    ///< Where they are from; empty if nothing is kept.
};

/// The checkpoint, if the run continues one, and what --light names, if the checkpoint has no light. Says it if that
/// file has none, either. @throw SceneError if one of the two is of another render; as read_work.
KeptWork read_kept_work(const std::filesystem::path& checkpoint, const RenderRun& run, const Scene& scene);

/// What is made before the units, as a list: empty if it is not kept.
std::vector<WorkUnit> kept_before(WorkUnit before);

/// Calls `work`. @throw whatever it throws; DamagedWork as std::runtime_error that names `from`, unless that is empty.
void naming_kept_work(const std::filesystem::path& from, const std::function<void()>& work);

}  // namespace tensorray
