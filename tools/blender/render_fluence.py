"""Renders the light inside a volume (output.fluence) with Cycles, as a glowing fog where it is gathered.

    blender --background --python tools/blender/render_fluence.py -- light.fluence.vdb picture.png [BODY.ply]

Light that the field does not change has the fluence 1 and is clear. The fog is as bright as what is above 1.1; its colour
goes from orange to white at a fluence of 4. It is seen from +x, -y and +z.
"""

import sys

import bpy
import mathutils

arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
if len(arguments) not in (2, 3):
    sys.exit(__doc__)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.object.volume_import(filepath=arguments[0])
volume = bpy.context.object
bpy.context.view_layer.update()
corners = [volume.matrix_world @ mathutils.Vector(corner) for corner in volume.bound_box]
center, size = sum(corners, mathutils.Vector()) / 8, (corners[6] - corners[0]).length

fog = bpy.data.materials.new("fog")
fog.use_nodes = True
nodes, links = fog.node_tree.nodes, fog.node_tree.links
nodes.clear()
fluence = nodes.new("ShaderNodeAttribute")
fluence.attribute_name = "fluence"
excess = nodes.new("ShaderNodeMath")
excess.operation = "SUBTRACT"
excess.inputs[1].default_value = 1.1
brightness = nodes.new("ShaderNodeMath")
brightness.operation = "MULTIPLY"
brightness.inputs[1].default_value = 12 / size
positive = nodes.new("ShaderNodeMath")
positive.operation = "MAXIMUM"
positive.inputs[1].default_value = 0
ramp = nodes.new("ShaderNodeBlackbody")
warmth = nodes.new("ShaderNodeMapRange")
warmth.inputs["From Min"].default_value, warmth.inputs["From Max"].default_value = 1, 4
warmth.inputs["To Min"].default_value, warmth.inputs["To Max"].default_value = 2500, 9000
glow = nodes.new("ShaderNodeEmission")
output = nodes.new("ShaderNodeOutputMaterial")
links.new(fluence.outputs["Fac"], excess.inputs[0])
links.new(excess.outputs[0], positive.inputs[0])
links.new(positive.outputs[0], brightness.inputs[0])
links.new(fluence.outputs["Fac"], warmth.inputs["Value"])
links.new(warmth.outputs["Result"], ramp.inputs["Temperature"])
links.new(ramp.outputs["Color"], glow.inputs["Color"])
links.new(brightness.outputs[0], glow.inputs["Strength"])
links.new(glow.outputs[0], output.inputs["Volume"])
volume.data.materials.append(fog)

if len(arguments) > 2:
    bpy.ops.import_mesh.ply(filepath=arguments[2])

scene = bpy.context.scene
world = bpy.data.worlds.new("world")
world.use_nodes = True
world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.02, 0.025, 0.035, 1)
scene.world = world
lamp = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
lamp.data.energy = 1.5
lamp.rotation_euler = (0.6, 0.3, 0)
scene.collection.objects.link(lamp)
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location = center + size * mathutils.Vector((0.75, -1.1, 0.55))
camera.rotation_euler = (center - camera.location).to_track_quat("-Z", "Y").to_euler()
camera.data.lens = 45
camera.data.clip_end = 10 * size
scene.collection.objects.link(camera)
scene.camera = camera
scene.render.engine = "CYCLES"
scene.cycles.samples = 32
scene.cycles.use_denoising = False  # Debian's Blender has no denoiser.
scene.render.resolution_x, scene.render.resolution_y = 1000, 750
scene.view_settings.view_transform = "Filmic"
scene.render.filepath = arguments[1]
bpy.ops.render.render(write_still=True)
