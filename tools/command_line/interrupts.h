#pragma once
/// @file tools/command_line/interrupts.h
/// How the programs handle signals.

#include "base/process/progress.h"

namespace tensorray {

/// Makes SIGINT (Ctrl-C) and SIGTERM cancel the returned progress, which lives as long as the program. A second
/// signal ends the program at once. Broken pipes and file-size limits become errors of the write that meets them.
Progress& progress_until_interrupted();

/// Whether SIGUSR1, which asks for a picture of what there is so far, has come since the last call. It does nothing
/// else.
bool take_picture_request();

}  // namespace tensorray
