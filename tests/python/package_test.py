"""The package: its names, documentation and type stubs; imports of other programs' files."""

import ast
import dataclasses
import inspect
import os
import subprocess
import tempfile
import unittest

import numpy as np

import tensorray as tr


def stub():
    with open(os.path.join(os.path.dirname(tr.__file__), "__init__.pyi")) as file:
        body = ast.parse(file.read()).body
    return {node.name: node for node in body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}


def stop(*_):
    raise LookupError("enough")


def names_of(arguments):
    names = [argument.arg for argument in arguments.args + arguments.kwonlyargs]
    return names + [extra.arg for extra in (arguments.vararg, arguments.kwarg) if extra]


class PackageTest(unittest.TestCase):
    def test_stubs_agree_with_the_functions(self):
        stubs = {name: node for name, node in stub().items() if not name.startswith("_")}
        self.assertEqual(set(stubs), {name for name in tr.__all__ if name not in ("INVARIANTS", "RAY_ENDS")})
        for name, node in stubs.items():
            value = getattr(tr, name)
            if isinstance(node, ast.FunctionDef):
                self.assertEqual(sorted(names_of(node.args)), sorted(inspect.signature(value).parameters), name)
                continue
            public = {member for member in vars(value) if not member.startswith("_")}
            if dataclasses.is_dataclass(value):
                public |= {member.name for member in dataclasses.fields(value)}
            stubbed = {part.target.id if isinstance(part, ast.AnnAssign) else part.name for part in node.body
                       if isinstance(part, (ast.AnnAssign, ast.FunctionDef))}
            self.assertEqual({part for part in stubbed if not part.startswith("_")}, public, name)

    def test_everything_is_documented(self):
        for name in tr.__all__:
            value = getattr(tr, name)
            if not callable(value) or name == "SceneError":
                continue
            self.assertGreater(len(value.__doc__ or ""), 40, name)
            if inspect.isfunction(value):
                for parameter in inspect.signature(value).parameters:
                    if parameter not in ("self", "progress", "file", "field", "kind"):
                        self.assertIn(parameter, value.__doc__, name)

    def test_the_version_is_that_of_the_program(self):
        ended = subprocess.run([os.environ["TENSORRAY_BINARY"], "--version"], capture_output=True, text=True)
        self.assertEqual(ended.stdout, f"tensorray {tr.__version__}\n")

    def test_the_schema_knows_the_keys(self):
        self.assertIn("field", tr.schema()["properties"])

    def test_the_examples_of_the_documentation_run(self):
        page = os.path.join(os.path.dirname(__file__), "..", "..", "docs", "python.md")
        with open(page) as file:
            lines = [line[4:] for line in file if line.startswith("    ") and "tools/python" not in line]
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            try:
                os.chdir(folder)
                names = {}
                exec(compile("".join(lines), page, "exec"), names)
                self.assertEqual(sorted(os.listdir(folder)), ["mine.exr", "mine.png"])
            finally:
                os.chdir(before)
        self.assertTrue(names["rays"].landed.any())

    def test_imports(self):
        program = os.path.join(os.path.dirname(os.environ["TENSORRAY_BINARY"]), "tensorray-import")
        if not os.path.exists(program):
            self.skipTest("tensorray-import is not built")
        tensors = np.random.default_rng(1).normal(size=(4, 5, 6, 3, 3)).astype("f4")
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "t.npy")
            np.save(file, tensors.reshape(4, 5, 6, 9))
            field = tr.import_file(file)
            with self.assertRaisesRegex(RuntimeError, "nothing.vtu"):
                tr.import_file(os.path.join(folder, "nothing.vtu"))
            for arguments, options in [((file,), {"order": "wrong"}), ((file,), {"step": "late"}), ((), {})]:
                with self.assertRaises((ValueError, RuntimeError)) as caught:
                    tr.import_file(*arguments, **options)
                self.assertNotIn("\n", str(caught.exception))
            seen = []
            tr.import_file(file, progress=lambda *report: seen.append(report))
            self.assertIn(("reading", 0, 1), seen)
            with self.assertRaisesRegex(LookupError, "enough"):
                tr.import_file(file, progress=stop)
        self.assertEqual(sorted(field.tensors.shape), sorted(tensors.shape))
        self.assertAlmostEqual(float(np.linalg.norm(field.tensors)), float(np.linalg.norm(tensors)), places=3)


if __name__ == "__main__":
    unittest.main()
