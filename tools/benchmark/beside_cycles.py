"""tensorray's path tracer beside Blender's Cycles: the same tubes, camera, lights and samples. tools/bench_cycles runs it.

Light is straight here: Cycles cannot bend it. What the field costs is measured apart, on the same field.

Both renderers have box filters, no adaptive sampling and no denoising, and the same greatest number of bounces. Time is
the difference between a render with all samples and one with few, so that loading and building are not in it. Noise is
the difference between two renders with other seeds, over the pixels that the tubes cover. Variance falls as 1 / time,
so that 1 / (variance × time) is what a renderer gives for the time: its efficiency.
"""

import argparse
import contextlib
import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
import time

import bpy
import mathutils
import numpy as np

import tensorray as tr

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
PROGRAM = os.path.join(ROOT, "build", "release", "bin", "tensorray")
SCENE = os.path.join(ROOT, "scenes", "point_load_paths.json")
#: The camera that scenes/point_load_paths.json chooses, and the light of a studio.
POSITION, TARGET, ANGLE = [1.24, -4.5, 0.33], [0, 0, -1], 30
SKY, LAMP, LAMP_DIRECTION, LAMP_ANGLE = 0.55, 0.6, [-0.1, 0.85, -0.9], 12
BOUNCES = 6  # Surfaces that scatter light.
FEW = 4      # Samples of the render whose time is subtracted.


def arguments():
    parser = argparse.ArgumentParser(prog="tools/bench_cycles", description=__doc__.split("\n")[0])
    parser.add_argument("--size", type=int, default=256, help="width and height of the picture (256)")
    parser.add_argument("--samples", type=int, default=64, help="samples of a pixel (64)")
    parser.add_argument("--threads", type=int, default=1, help="threads of each renderer (1)")
    parser.add_argument("--material", choices=["diffuse", "principled"], default="principled")
    parser.add_argument("--repeat", type=int, default=3, help="each time is the least of so many (3)")
    parser.add_argument("--pictures", help="a folder for the pictures of both")
    parser.add_argument("--json", action="store_true", help="print numbers instead of a table")
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])


def changes(options, samples):
    """The scene's keys that make it the scene of both renderers."""
    material = {"kind": options.material, **({"roughness": 0.4} if options.material == "principled" else {})}
    return {
        "integrator.context.box": False, "integrator.color.legend": False, "integrator.background": "transparent",
        "integrator.material": material, "integrator.max_depth": BOUNCES, "integrator.filter": "box",
        "integrator.noise": 0, "integrator.min_samples": samples, "integrator.max_samples": samples,
        "camera": {"position": POSITION, "target": TARGET, "angle": ANGLE,
                   "resolution": [options.size, options.size]},
        "lights": [{"kind": "constant", "strength": SKY},
                   {"kind": "directional", "direction": LAMP_DIRECTION, "angle": LAMP_ANGLE, "strength": LAMP}]}


def command_line(options, samples, outputs):
    """Runs the program. @return its statistics"""
    with tempfile.TemporaryDirectory() as folder:
        statistics = os.path.join(folder, "statistics.json")
        command = [PROGRAM, "render", SCENE, "-q", "--threads", str(options.threads), "--stats", statistics]
        for key, value in changes(options, samples).items():
            command += ["--set", f"{key}={json.dumps(value)}"]
        subprocess.run(command + ["-o", os.path.join(folder, "picture.exr")] + outputs, check=True)
        with open(statistics, encoding="utf-8") as file:
            return json.load(file)


class Tensorray:
    name = "tensorray"

    def __init__(self, options):
        self.options = options
        self.memory = command_line(options, 1, [])["peak_memory_bytes"]

    def render(self, samples, seed):
        """@return seconds, and the picture as rows of R, G, B, A"""
        result = tr.render(SCENE, changes=changes(self.options, samples), seed=seed, threads=self.options.threads,
                           progress=False)
        picture = np.concatenate([result.linear, result.alpha[..., None]], axis=-1)
        return result.statistics["seconds"]["draw"], picture.astype(np.float64)


class Cycles:
    name = "Cycles"

    def __init__(self, options):
        self.options = options
        bpy.ops.wm.read_factory_settings(use_empty=True)
        add_tubes(options)
        add_lights()
        add_camera()
        scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        scene.render.resolution_x = scene.render.resolution_y = options.size
        scene.render.film_transparent = True
        scene.render.threads_mode, scene.render.threads = "FIXED", options.threads
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth, scene.render.image_settings.color_mode = "32", "RGBA"
        cycles = scene.cycles
        cycles.device = "CPU"
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        cycles.pixel_filter_type = "BOX"
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = BOUNCES - 1
        self.memory = None

    def render(self, samples, seed):
        scene = bpy.context.scene
        scene.cycles.samples, scene.cycles.seed = samples, seed
        with tempfile.TemporaryDirectory() as folder:
            scene.render.filepath = os.path.join(folder, "picture.exr")
            start = time.perf_counter()
            with silence():
                bpy.ops.render.render(write_still=True)
            seconds = time.perf_counter() - start
            image = bpy.data.images.load(scene.render.filepath)
            pixels = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(pixels)
            bpy.data.images.remove(image)
        self.memory = self.memory or peak_memory()
        return seconds, pixels.reshape(self.options.size, self.options.size, 4)[::-1].astype(np.float64)


@contextlib.contextmanager
def silence():
    """Blender prints a line for each sample."""
    sys.stdout.flush()
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def peak_memory():
    with open("/proc/self/status", encoding="ascii") as file:
        return 1024 * next(int(line.split()[1]) for line in file if line.startswith("VmHWM"))


def add_on():
    spec = importlib.util.spec_from_file_location("tensorray_blender",
                                                  os.path.join(ROOT, "tools", "blender", "tensorray_blender.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def add_tubes(options):
    """The triangles that tensorray draws, with their colours."""
    helper = add_on()
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "tubes.ply")
        command_line(options, 1, ["-o", file])
        vertices, faces = helper.read_triangles(file)
    tubes = helper.add_mesh("tubes", np.stack([vertices[axis] for axis in "xyz"], axis=-1), faces,
                            bpy.context.scene.collection)
    mesh = tubes.data
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    colors = np.stack([vertices[band] for band in ("red", "green", "blue")] + [np.full(len(vertices), 255)], axis=-1)
    attribute = mesh.color_attributes.new(helper.COLORS, "BYTE_COLOR", "POINT")
    attribute.data.foreach_set("color_srgb", (colors / np.float32(255)).astype(np.float32).ravel())
    material = bpy.data.materials.new("tubes")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    surface = nodes["Principled BSDF"]
    if options.material == "diffuse":
        surface = nodes.new("ShaderNodeBsdfDiffuse")
        links.new(surface.outputs["BSDF"], nodes["Material Output"].inputs["Surface"])
    else:
        surface.inputs["Roughness"].default_value = 0.4
    color = nodes.new("ShaderNodeAttribute")
    color.attribute_name = helper.COLORS
    links.new(color.outputs["Color"], surface.inputs[0])
    mesh.materials.append(material)


def add_lights():
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = SKY
    bpy.context.scene.world = world
    lamp = bpy.data.lights.new("lamp", "SUN")
    lamp.energy = math.pi * LAMP  # Irradiance.
    lamp.angle = math.radians(LAMP_ANGLE)
    place = bpy.data.objects.new("lamp", lamp)
    place.rotation_euler = mathutils.Vector(LAMP_DIRECTION).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(place)


def add_camera():
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "VERTICAL", math.radians(ANGLE)
    camera.clip_start, camera.clip_end = 0.01, 1000
    place = bpy.data.objects.new("camera", camera)
    place.location = POSITION
    view = mathutils.Vector(TARGET) - mathutils.Vector(POSITION)
    place.rotation_euler = view.to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(place)
    bpy.context.scene.camera = place


def luminance(picture):
    return picture[..., :3] @ np.array([0.2126, 0.7152, 0.0722])


def measure(renderer, options):
    few = min(renderer.render(FEW, 1)[0] for _ in range(options.repeat))
    runs = [renderer.render(options.samples, 1 + i) for i in range(max(2, options.repeat))]
    seconds = min(run[0] for run in runs) - few
    first, second = runs[0][1], runs[1][1]
    tubes = (first[..., 3] == 1) & (second[..., 3] == 1)
    mean = luminance(first)[tubes].mean()
    noise = math.sqrt(np.mean((luminance(first) - luminance(second))[tubes] ** 2) / 2) / mean
    samples = options.size ** 2 * (options.samples - FEW)
    return {"name": renderer.name, "seconds": seconds, "samples_a_second": samples / seconds, "noise": noise,
            "efficiency": 1 / (noise ** 2 * seconds), "mean": mean, "covered": float(tubes.mean()),
            "memory_bytes": renderer.memory, "picture": first}


def measure_bending(options):
    """Ways through the field that the camera's and the surfaces' rays need, at the same size."""
    keys = {"integrator": {"type": "scene", "noise": 0, "max_samples": 16, "min_samples": 16},
            "camera": {"resolution": [options.size, options.size]}}
    fields = [tr.render(SCENE, changes={**keys, **more}, threads=options.threads, progress=False).statistics
              for more in ({}, {"bending.a": 0, "bending.b": 0})]
    seconds = [field["seconds"]["draw"] for field in fields]
    return {"ways_a_second": fields[0]["bent_rays"]["emitted"] / max(seconds[0] - seconds[1], 1e-3), "seconds_bent": seconds[0],
            "seconds_straight": seconds[1]}


def save(folder, results):
    os.makedirs(folder, exist_ok=True)
    for result in results:
        height, width = result["picture"].shape[:2]
        image = bpy.data.images.new(result["name"], width, height, alpha=True, float_buffer=True)
        image.pixels.foreach_set(result["picture"][::-1].astype(np.float32).ravel())
        image.file_format, image.filepath_raw = "PNG", os.path.join(folder, result["name"] + ".png")
        image.save()


def report(results, bending, options):
    print(f"{options.size} × {options.size} pixels, {options.samples} samples, {options.threads} threads, "
          f"{options.material}")
    print(f"{'':10} {'seconds':>8} {'samples/s':>10} {'noise':>8} {'efficiency':>11} {'mean':>7} {'covered':>8} "
          f"{'memory':>8}")
    for result in results:
        print(f"{result['name']:10} {result['seconds']:8.2f} {result['samples_a_second']:10.0f} {result['noise']:8.4f} "
              f"{result['efficiency'] / results[-1]['efficiency']:10.2f}× {result['mean']:7.4f} "
              f"{result['covered']:8.3f} {result['memory_bytes'] / 2**20:5.0f} MB")
    print(f"with the field: {bending['ways_a_second']:.0f} wavelengths' ways through it a second, "
          f"{bending['ways_a_second'] / 8:.0f} packets of 8 (a scene of {options.size}² pixels with 16 samples: "
          f"{bending['seconds_bent']:.1f} s, {bending['seconds_straight']:.1f} s without it)")


def main():
    options = arguments()
    cycles = measure(Cycles(options), options)  # First, so that its memory is Blender's alone.
    results = [measure(Tensorray(options), options), cycles]
    bending = measure_bending(options)
    if options.pictures:
        save(options.pictures, results)
    if options.json:
        for result in results:
            del result["picture"]
        print(json.dumps({"renderers": results, "bending": bending}, indent=2))
    else:
        report(results, bending, options)


main()
