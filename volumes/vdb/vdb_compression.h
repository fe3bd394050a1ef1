#pragma once

namespace tensorray {

/// How a VDB file's values are compressed, each leaf's on their own. Every OpenVDB tool reads all of them. zlib is
/// slower, and makes files smaller where values have few different bytes; files without any become the smallest in an
/// archive such as .tar.xz.
enum class VdbCompression { blosc, zip, none };

}  // namespace tensorray
