#pragma once
/// @file tools/benchmark/questions.h
/// The questions that `tensorray_bench` answers, one in each source file. A benchmark is named QUESTION/CASE/WAY. The
/// ways of one case are compared: main.cpp prints how many times faster each is than the first.

namespace tensorray::bench {

void add_rays();           ///< Is `trace` faster than a loop on OpenVDB's sampler?
void add_pictures();       ///< How long does a picture take, on one thread and on all?
void add_caustics();       ///< Which estimate of the light on a plate has the smallest error for its time?
void add_interpolation();  ///< How exact is a picture of few voxels?
void add_loading();        ///< How long does it take to load a file?
void add_view();           ///< How soon does the live view show a change?

}  // namespace tensorray::bench
