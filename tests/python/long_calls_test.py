"""Long calls: the GIL, threads, progress, Ctrl-C."""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np

import tensorray as tr

SCENE = {"light": {"photons": 5000, "wavelengths": {"count": 8}}, "receiver": {"resolution": 64},
         "integrator": {"type": "photon_distribution", "density": {"kind": "gaussian"}}}
LONG = {**SCENE, "light": {"photons": 1e9}}  # Hours.


def in_threads(count, work):
    threads = [threading.Thread(target=work, args=(i,)) for i in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


class LongCallsTest(unittest.TestCase):
    def test_several_threads_render_at_once(self):
        field = tr.make("vortex", resolution=24)
        expected = [tr.render(SCENE, field=field, seed=seed).linear for seed in range(4)]
        results = [None] * 4

        def work(seed):
            results[seed] = tr.render(SCENE, field=field, seed=seed, threads=1 + seed % 2).linear

        in_threads(4, work)
        for result, wanted in zip(results, expected):
            np.testing.assert_array_equal(result, wanted)

    def test_threads_use_one_new_field_at_once(self):
        field = tr.Field(tr.make("helix", resolution=24).tensors)
        ends = [None] * 6

        def work(i):
            mode = ("raw", "absolute")[i % 2]
            ends[i] = tr.trace(field, [10.0, 11.0, 30.0], [0, 0, -1], 0.1, eigenvalues=mode).positions

        in_threads(6, work)
        for i in range(2, 6):
            np.testing.assert_array_equal(ends[i], ends[i % 2])

    def test_other_threads_run_meanwhile(self):
        begun = threading.Event()

        def count():
            for _ in range(10):
                time.sleep(0.001)
            begun.wait()
            signal.raise_signal(signal.SIGINT)

        field, thread = tr.make("vortex", resolution=24), threading.Thread(target=count)
        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaises(KeyboardInterrupt):
                thread.start()
                tr.render(LONG, field=field, outputs=os.path.join(folder, "a.exr"),
                          progress=lambda *report: begun.set())
            self.assertEqual(os.listdir(folder), [])
        thread.join()

    def test_a_daemon_that_works_does_not_end_the_process_badly(self):
        code = """if True:
            import threading
            import tensorray as tr
            field, begun = tr.make("vortex", resolution=24), threading.Event()
            scene = {"light": {"photons": 1e9}, "integrator": {"type": "photon_distribution"}}
            threading.Thread(target=tr.render, args=(scene,), kwargs={
                "field": field, "progress": lambda *report: begun.set()}, daemon=True).start()
            begun.wait()
        """
        ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        # A thread that writes when Python ends may keep the stream locked that Python flushes then.
        self.assertEqual((ended.returncode, ended.stderr), (0, ""))

    def test_streams_that_only_write(self):
        class Writer:
            def write(self, text):
                pass

        closed = open(os.devnull, "w")
        closed.close()
        field, stream = tr.make("vortex", resolution=24), sys.stderr
        for stderr in (None, Writer(), closed):
            try:
                sys.stderr = stderr
                picture = tr.render(SCENE, field=field)
            finally:
                sys.stderr = stream
            self.assertTrue(np.isfinite(picture.linear).all())

    def test_an_exception_of_the_progress_ends_the_call(self):
        def stop(*_):
            raise LookupError("enough")

        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaisesRegex(LookupError, "enough"):
                tr.render(LONG, field=tr.make("vortex", resolution=24), progress=stop,
                          outputs=os.path.join(folder, "a.exr"))
            self.assertEqual(os.listdir(folder), [])

    def test_bars(self):
        for before, progress, is_shown in (("", True, True), ("", None, False),
                                           ("import sys; sys.modules['tqdm.auto'] = None", True, True)):
            program = (f"{before}\nimport tensorray as tr\n"
                       f"tr.render({SCENE}, field=tr.make('vortex', resolution=16), progress={progress})")
            ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
            self.assertEqual(ended.returncode, 0, ended.stderr)
            self.assertEqual("%" in ended.stderr, is_shown)
            self.assertEqual(ended.stderr != "", is_shown)


if __name__ == "__main__":
    unittest.main()
