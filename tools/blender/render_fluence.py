"""Renders the light inside a volume (output.fluence) with Cycles, as a fog that glows where light is gathered.

    blender --background --python-exit-code 1 --python tools/blender/render_fluence.py -- light.fluence.vdb picture.png

Light that the field does not change has the fluence 1 and is clear. The fog is as bright as what is above 1.1; its
colour goes from orange to white at a fluence of 4. It is seen from +x, -y and +z.
"""

import os
import sys

import bpy
from mathutils import Vector


def load(path):
    """The volume of a file, its centre and the length of its diagonal."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.object.volume_import(filepath=path)
    volume = bpy.context.object
    bpy.context.view_layer.update()
    corners = [volume.matrix_world @ Vector(corner) for corner in volume.bound_box]
    return volume, sum(corners, Vector()) / 8, (corners[6] - corners[0]).length


def fog(size):
    """A material that glows with the fluence above 1.1."""
    material = bpy.data.materials.new("fog")
    material.use_nodes = True
    nodes, link = material.node_tree.nodes, material.node_tree.links.new
    nodes.clear()

    def math(operation, value, by):
        node = nodes.new("ShaderNodeMath")
        node.operation = operation
        node.inputs[1].default_value = by
        link(value, node.inputs[0])
        return node.outputs[0]

    attribute = nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "fluence"
    fluence = attribute.outputs["Fac"]
    temperature = nodes.new("ShaderNodeMapRange")
    for name, value in {"From Min": 1, "From Max": 4, "To Min": 2500, "To Max": 9000}.items():
        temperature.inputs[name].default_value = value
    link(fluence, temperature.inputs["Value"])
    color = nodes.new("ShaderNodeBlackbody")
    link(temperature.outputs["Result"], color.inputs["Temperature"])
    glow = nodes.new("ShaderNodeEmission")
    link(color.outputs["Color"], glow.inputs["Color"])
    link(math("MULTIPLY", math("MAXIMUM", math("SUBTRACT", fluence, 1.1), 0), 12 / size), glow.inputs["Strength"])
    link(glow.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
    return material


def add_camera(scene, center, size):
    scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.camera.location = center + size * Vector((0.75, -1.1, 0.55))
    scene.camera.rotation_euler = (center - scene.camera.location).to_track_quat("-Z", "Y").to_euler()
    scene.camera.data.lens = 45
    scene.camera.data.clip_end = 10 * size
    scene.collection.objects.link(scene.camera)


def add_background(scene):
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.02, 0.025, 0.035, 1)


def render(scene, picture):
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 32
    scene.cycles.use_denoising = False  # Debian's Blender has no denoiser.
    scene.render.resolution_x, scene.render.resolution_y = 1000, 750
    scene.view_settings.view_transform = "Filmic"
    scene.render.filepath = os.path.abspath(picture)
    bpy.ops.render.render(write_still=True)


def main():
    files = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    if len(files) != 2:
        sys.exit(__doc__)
    if not os.path.isfile(files[0]):
        sys.exit(f"render_fluence: {files[0]}: no such file; make it with -o FILE.fluence.vdb")
    volume, center, size = load(os.path.abspath(files[0]))
    volume.data.materials.append(fog(size))
    scene = bpy.context.scene
    add_camera(scene, center, size)
    add_background(scene)
    render(scene, files[1])


main()
