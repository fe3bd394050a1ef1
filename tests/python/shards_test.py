"""Renders in shards: the bits of one render, with and without executors; errors; Ctrl-C."""

import concurrent.futures
import json
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np

import tensorray as tr

FIELD = {"generate": {"kind": "point_load", "resolution": 17}, "eigenvalues": "absolute", "scale": 4}
PATHS = {"field": FIELD, "camera": {"resolution": [30, 25]},
         "integrator": {"type": "path_tracing", "max_samples": 16, "min_samples": 8}}
WHOLE = {"field": FIELD, "camera": {"resolution": [25, 20]},
         "integrator": {"type": "scene", "max_samples": 8, "min_samples": 4, "bands": 4, "bands_per_sample": 4,
                        "caustic": {"resolution": 32, "rays": 1000, "passes": 1}}}
PLATE = {"field": FIELD, "light": {"photons": 2000, "wavelengths": {"count": 4}}, "receiver": {"resolution": [40, 30]},
         "integrator": {"type": "photon_distribution"}}
LONG = {**PATHS, "integrator": {"type": "path_tracing", "max_samples": 10**6, "noise": 0}}  # Hours.


class Dask:
    """What a Client of Dask has in common with executors, but nothing else."""

    class Future:
        def __init__(self, future):
            self.result, self.cancel, self.add_done_callback = future.result, future.cancel, future.add_done_callback

    def __init__(self, executor):
        self._executor = executor

    def submit(self, function, *arguments):
        function, arguments = pickle.loads(pickle.dumps((function, arguments)))
        return self.Future(self._executor.submit(function, *arguments))


class Failing:
    """Makes shards until one of them fails."""

    def __init__(self, error):
        self.error, self.futures = error, []

    def submit(self, function, *arguments):
        self.futures.append(concurrent.futures.Future())
        if len(self.futures) == 2:
            self.futures[-1].set_exception(self.error)
        return self.futures[-1]


class ShardsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pool = concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn"))
        cls.addClassCleanup(cls.pool.shutdown)

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = temporary.name

    def expect_same(self, a, b):
        self.assertEqual(a.channels, b.channels)
        for name in ("linear", "display"):
            self.assertEqual(getattr(a, name).tobytes(), getattr(b, name).tobytes(), name)

    def test_the_bits_are_those_of_one_render(self):
        # More shards than the picture has tiles; by processes; with all that a picture keeps.
        for scene, shards, executor in ((PATHS, 12, None), (WHOLE, 3, self.pool), (PLATE, 3, None)):
            whole, parts = (tr.render(scene, keep=["spectral", "photons"] if scene is PLATE else [], **more)
                            for more in ({}, dict(shards=shards, executor=executor, shard_folder=self.folder)))
            self.expect_same(parts, whole)
        self.assertEqual(parts.spectral.tobytes(), whole.spectral.tobytes())
        self.assertEqual(parts.photons.tobytes(), whole.photons.tobytes())
        self.assertEqual(os.listdir(self.folder), [])

    def test_fields_come_along(self):
        made = tr.make("vortex", resolution=[9, 10, 11])
        made.write(os.path.join(self.folder, "field.vdb"))
        scene = {key: value for key, value in PATHS.items() if key != "field"}
        for field in (made, tr.read_vdb(os.path.join(self.folder, "field.vdb")),
                      tr.Field(np.random.default_rng(1).normal(size=(9, 8, 7, 3, 3))[::2], voxel_size=0.3)):
            copy = pickle.loads(pickle.dumps(field))
            np.testing.assert_array_equal(copy.tensors, field.tensors)
            np.testing.assert_array_equal(copy.to_world, field.to_world)
            self.assertEqual((copy.name, copy.metadata), (field.name, field.metadata))
            self.expect_same(tr.render(scene, field, shards=2, executor=self.pool), tr.render(scene, copy))

    def test_scenes_and_fields_in_files(self):
        tr.make("vortex", resolution=9).write(os.path.join(self.folder, "field.vdb"))
        scene = {**PATHS, "field": {"file": "field.vdb"}}
        with open(os.path.join(self.folder, "scene.json"), "w") as file:
            json.dump(scene, file)
        whole = tr.render(scene, folder=self.folder)
        here = os.getcwd()
        self.pool.submit(os.getcwd).result()  # Its processes keep this working folder.
        try:
            os.chdir(self.folder)
            for source in (scene, "scene.json"):
                self.expect_same(tr.render(source, shards=2, executor=self.pool), whole)
        finally:
            os.chdir(here)

    def test_other_executors(self):
        whole = tr.render(PATHS)
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            for executor in (pool, Dask(pool)):
                self.expect_same(tr.render(PATHS, shards=3, executor=executor, threads=1), whole)

    def test_progress(self):
        seen = []
        tr.render(PATHS, shards=2, progress=lambda *report: seen.append(report))
        self.assertLessEqual({"shard 1/2", "shard 2/2"}, {phase.split(":")[0] for phase, _, _ in seen})
        seen.clear()
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            tr.render(PATHS, shards=2, executor=pool, progress=lambda *report: seen.append(report))
        self.assertEqual(seen[:2], [("shards", 0, 2), ("shards", 1, 2)])

    def test_wrong_scenes_are_found_before_the_first_shard(self):
        executor = Failing(None)
        for text, arguments in (("unknown key `/lihgt`", {"scene": {**PATHS, "lihgt": 1}}),
                                ("nowhere/a.png", {"outputs": "nowhere/a.png"}),
                                ("keep: unknown output", {"keep": "x"}),
                                ("number from 1", {"shards": 0}), ("number from 1", {"shards": 10**9})):
            with self.assertRaisesRegex((ValueError, RuntimeError), text):
                tr.render(**{"scene": PATHS, "shards": 2, "executor": executor, **arguments})
        for arguments in ({"executor": executor}, {"shard_folder": self.folder}):
            with self.assertRaisesRegex(ValueError, "number of shards"):
                tr.render(PATHS, **arguments)
        with self.assertRaises(TypeError):
            tr.render(PATHS, shards=2.5)
        self.assertEqual(executor.futures, [])

    def test_errors_name_the_shard_and_cancel_the_others(self):
        for error, kind, text in ((RuntimeError("no memory"), RuntimeError, "shard 2/4: no memory"),
                                  (tr.SceneError("`/light`: no"), tr.SceneError, "shard 2/4: `/light`: no"),
                                  (OSError("gone"), RuntimeError, "shard 2/4: gone"),
                                  (concurrent.futures.CancelledError(), RuntimeError, "shard 2/4: CancelledError")):
            executor = Failing(error)
            with self.assertRaises(kind) as caught:
                tr.render(PATHS, shards=4, executor=executor, shard_folder=self.folder)
            self.assertEqual(str(caught.exception), text)
            self.assertEqual([future.cancelled() for future in executor.futures], [True, False, True, True])
            self.assertEqual(os.listdir(self.folder), [])

    def test_errors_of_processes_name_the_shard(self):
        scene = {**PATHS, "field": {"file": os.path.join(self.folder, "nowhere.vdb")}}
        for executor in (None, self.pool):
            with self.assertRaisesRegex(RuntimeError, r"^shard [12]/2: .*nowhere\.vdb"):
                tr.render(scene, shards=2, executor=executor)

    def test_a_folder_that_is_not_shared_is_named(self):
        from tensorray import _shards
        with self.assertRaisesRegex(RuntimeError, "nowhere is not there: give shard_folder="):
            _shards.render_shard(os.path.join(self.folder, "nowhere"), 0, 2)

    def test_a_shard_ends_with_its_render(self):
        """Another shard fails: the process of this one becomes free."""
        pool = self.pool

        class Executor:
            def __init__(self):
                self.running, self.broken = None, concurrent.futures.Future()

            def submit(self, function, *arguments):
                if self.running is None:
                    self.running = pool.submit(function, *arguments)
                    return self.running
                threading.Timer(1, self.broken.set_exception, [RuntimeError("lost")]).start()
                return self.broken

        executor = Executor()
        with self.assertRaisesRegex(RuntimeError, "shard 2/2: lost"):
            tr.render(LONG, shards=2, executor=executor)
        with self.assertRaisesRegex(RuntimeError, "the render has ended|is not there"):
            executor.running.result()

    def test_interrupts(self):
        """Ctrl-C of the calling process alone."""
        for executor in ("None", "pool"):
            program = ("import concurrent.futures, multiprocessing, sys\nimport tensorray as tr\n"
                       "if __name__ == '__main__':\n"
                       "    context = multiprocessing.get_context('spawn')\n"
                       "    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as pool:\n"
                       f"        tr.render({LONG}, shards=3, executor={executor}, shard_folder='shards',\n"
                       "                  progress=lambda *report: print('working', flush=True))\n")
            with open(os.path.join(self.folder, "program.py"), "w") as file:
                file.write(program)
            os.makedirs(os.path.join(self.folder, "shards"), exist_ok=True)
            child = subprocess.Popen([sys.executable, "program.py"], cwd=self.folder, stdout=subprocess.PIPE,
                                     stderr=subprocess.PIPE, text=True)
            self.assertEqual(child.stdout.readline(), "working\n")
            child.send_signal(signal.SIGINT)
            _, error = child.communicate()
            self.assertEqual(error.strip().splitlines()[-1], "KeyboardInterrupt", error)
            self.assertEqual(os.listdir(os.path.join(self.folder, "shards")), [])


if __name__ == "__main__":
    unittest.main()
