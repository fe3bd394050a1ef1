#pragma once
/// @file tools/command_line/interrupts.h
/// What the programs do about signals.

#include "base/progress.h"

namespace tensorray {

/// Has Ctrl-C (SIGINT, SIGTERM) cancel the progress that is returned, which lives as long as the program; a second one
/// ends the program at once. A broken pipe and a file-size limit become errors of the write that meets them.
Progress& progress_until_interrupted();

}  // namespace tensorray
