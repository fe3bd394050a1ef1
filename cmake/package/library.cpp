// The library consists of the project's static libraries; CMake wants a source.
