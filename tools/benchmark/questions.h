#pragma once
/// The questions that `tensorray_bench` answers. A benchmark is named QUESTION/CASE/WAY. The ways of one case are
/// compared: main.cpp prints how many times faster each is than the first.

namespace tensorray::bench {

void add_rays();         ///< Is `trace` faster than a loop on OpenVDB's sampler?
void add_polariscope();  ///< How long does polarised light take, beside the samples of the field alone?
void add_renders();      ///< How long do whole renders take, and how exact are they? (renders.json)
void add_view();         ///< How soon does the live view show a change?

}  // namespace tensorray::bench
