/// The module tensorray._tensorray. The package beside it (python/tensorray) has the functions for users; it makes
/// their arguments plain, so that the functions here have no defaults.

#include <new>
#include <stdexcept>
#include <string>

#include <pybind11/stl/filesystem.h>

#include "base/process/child_program.h"
#include "base/process/progress.h"
#include "base/text/text.h"
#include "python/module/scene_request.h"
#include "python/module/work.h"
#include "renderer/images/image.h"
#include "scenes/keys/json_reader.h"

namespace tensorray {
namespace {

namespace py = pybind11;

/// Raises an exception whose text may have bytes that are not UTF-8, as a file's name.
void raise(PyObject* type, const std::string& what) {
  const std::string line = escaped(what);
  const py::object text = py::reinterpret_steal<py::object>(
      PyUnicode_DecodeUTF8(line.data(), static_cast<Py_ssize_t>(line.size()), "surrogateescape"));
  if (text) PyErr_SetObject(type, text.ptr());
}

/// Exceptions with the line that the command line prints after its name.
void add_exceptions(py::module_& module) {
  // Never released: it must outlive the interpreter.
  static PyObject* const scene_error =
      py::exception<SceneError>(module, "SceneError", PyExc_ValueError).release().ptr();
  py::register_exception_translator([](std::exception_ptr error) {
    try {
      if (error) std::rethrow_exception(error);
    } catch (const SceneError& wrong) {
      raise(scene_error, wrong.what());
    } catch (const std::invalid_argument& wrong) {
      raise(PyExc_ValueError, wrong.what());
    } catch (const Cancelled&) {
      PyErr_SetString(PyExc_KeyboardInterrupt, "interrupted; nothing was written");
    } catch (const std::bad_alloc&) {
      PyErr_SetString(PyExc_MemoryError, "out of memory; lower the resolution, or the number of wavelengths");
    } catch (const py::builtin_exception&) {
      throw;  // pybind11's own.
    } catch (const std::runtime_error& failed) {
      raise(PyExc_RuntimeError, failed.what());
    }
  });
}

}  // namespace
}  // namespace tensorray

PYBIND11_MODULE(_tensorray, module) {
  using namespace tensorray;
  add_exceptions(module);
  add_fields(module);
  add_scene_request(module);
  add_renders(module);
  add_traces(module);
  module.def("use_programs_in", &use_programs_in);
  pybind11::module_::import("atexit").attr("register")(pybind11::cpp_function(&end_all_work));
  module.attr("version") = TENSORRAY_VERSION;
}
