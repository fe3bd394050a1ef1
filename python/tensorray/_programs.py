"""Where the programs of tensorray are: imports and .vtp files are the work of `tensorray-import`."""

import os
import shutil

from . import _tensorray


def folder():
    """The folder of the programs: `bin` beside the package in a build folder, or that of an installed `tensorray`."""
    beside = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "bin")
    built = os.path.join(os.path.dirname(os.path.abspath(_tensorray.__file__)), "..", "..", "bin")
    for candidate in (built, beside):
        if os.path.exists(os.path.join(candidate, "tensorray")):
            return os.path.realpath(candidate)
    installed = shutil.which("tensorray")
    return os.path.dirname(installed) if installed else "/usr/bin"


def find():
    """Tells the module where the programs are."""
    _tensorray.use_programs_in(folder())
