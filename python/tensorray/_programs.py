"""Where the programs of tensorray are: imports and reading .vtp files are the work of `tensorray-import`."""

import os
import shutil

from . import _tensorray


def folder():
    """The folder `bin` of the build folder, or of the prefix, that has this package; or that of another `tensorray`."""
    parent = os.path.dirname(os.path.abspath(_tensorray.__file__))
    while parent != os.path.dirname(parent):
        if os.path.exists(os.path.join(parent, "bin", "tensorray")):
            return os.path.join(parent, "bin")
        parent = os.path.dirname(parent)
    installed = shutil.which("tensorray")
    return os.path.dirname(installed) if installed else "/usr/bin"


def find():
    """Tells the module where the programs are."""
    _tensorray.use_programs_in(folder())
