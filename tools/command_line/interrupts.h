#pragma once
/// @file tools/command_line/interrupts.h
/// How the programs handle signals.

#include "base/progress.h"

namespace tensorray {

/// Makes SIGINT (Ctrl-C) and SIGTERM cancel the returned progress, which lives as long as the program. A second
/// signal ends the program at once. Broken pipes and file-size limits become errors of the write that meets them.
Progress& progress_until_interrupted();

}  // namespace tensorray
