"""Blender add-on: scenes of tensorray in Blender.

File > Import > tensorray (.json, .vdb) loads a scene's tubes, its plate with the caustic, and its bodies.
Render > tensorray renders the scene file as it is into an image.
Install it with Edit > Preferences > Add-ons > Install. It needs the Python package `tensorray` in the Python that
Blender uses: an installed python3-tensorray, or PYTHONPATH=build/release/python and blender --python-use-system-env.
For Blender 3.4 and newer.
"""

import json
import os
import re
import tempfile

import bpy
import numpy as np
from bpy.props import BoolProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

bl_info = {
    "name": "tensorray",
    "description": "Light that tensor fields bend: tubes, plates with their caustics, bodies, and renders",
    "blender": (3, 4, 0),
    "category": "Import-Export",
    "location": "File > Import, Render",
    "version": (0, 1, 0),
}

#: The name of the scene's file, kept with Blender's scene.
FILE_KEY = "tensorray_file"
#: The attribute with the tubes' colours. Cycles keeps the name "color" for itself.
COLORS = "tube color"
IS_NEW = bpy.app.version >= (4, 0, 0)
NUMPY_TYPES = {"float": "<f4", "double": "<f8", "uchar": "u1", "uint": "<u4", "int": "<i4"}


def package():
    try:
        import tensorray
    except ImportError as error:
        raise RuntimeError("the Python package tensorray is missing: install python3-tensorray, or start Blender with "
                           "PYTHONPATH=.../build/release/python and --python-use-system-env") from error
    return tensorray


def read_triangles(path):
    """A binary .ply of triangles, as tensorray writes it: an array with its vertices' properties, and indices."""
    with open(path, "rb") as file:
        elements = []
        while (line := file.readline().split()) != [b"end_header"]:
            if line[:1] == [b"element"]:
                elements.append((int(line[2]), []))
            elif line[:1] == [b"property"] and line[1] != b"list":
                elements[-1][1].append((line[2].decode(), NUMPY_TYPES[line[1].decode()]))
        vertices = np.fromfile(file, np.dtype(elements[0][1]), elements[0][0])
        faces = np.fromfile(file, np.dtype([("count", "u1"), ("indices", "<u4", 3)]), elements[1][0])
    return vertices, faces["indices"]


def add_mesh(name, positions, faces, collection):
    """An object with a mesh. faces: (n, 3) or (n, 4) indices."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", np.asarray(positions, np.float32).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", np.asarray(faces, np.int32).ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(len(faces), dtype=np.int32) * faces.shape[1])
    if not IS_NEW:
        mesh.polygons.foreach_set("loop_total", np.full(len(faces), faces.shape[1], np.int32))
    mesh.update(calc_edges=True)
    mesh.validate()
    added = bpy.data.objects.new(name, mesh)
    collection.objects.link(added)
    return added


def add_material(mesh, name, color_node, emits):
    """A material whose colour is that of a node: light that it emits, or that it reflects."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    surface = nodes["Principled BSDF"]
    if emits:
        surface = nodes.new("ShaderNodeEmission")
        links.new(surface.outputs["Emission"], nodes["Material Output"].inputs["Surface"])
    links.new(color_node(nodes).outputs["Color"], surface.inputs["Color" if emits else "Base Color"])
    mesh.materials.append(material)


def image_of(name, linear):
    """An image of scene-linear light, rows from the top; it stays in the .blend file."""
    height, width = linear.shape[:2]
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :linear.shape[2]] = linear[::-1]
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709" if IS_NEW else "Linear"
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def read_scene(path):
    """A scene file as a dictionary, or the scene of a field's file."""
    if not path.lower().endswith(".json"):
        return {"field": {"file": os.path.basename(path)}}
    with open(path, encoding="utf-8") as file:
        text = file.read()
    without_comments = re.sub(r'("(?:\\.|[^"\\])*")|//[^\n]*|/\*.*?\*/', lambda m: m.group(1) or "", text, flags=re.S)
    return json.loads(without_comments)


def with_method(scene, method, **keys):
    """A scene rendered by a method, with the scene's own keys of it."""
    own = scene.get("integrator", {})
    return {**scene, "integrator": {**(own if own.get("type") == method else {"type": method}), **keys}}


def load_tubes(scene, folder, collection):
    """The tubes about the paths of light, with their colours."""
    quick = with_method(scene, "path_tracing", max_samples=1, min_samples=1, shading="headlight")
    with tempfile.TemporaryDirectory() as temporary:
        file = os.path.join(temporary, "tubes.ply")
        package().render(quick, folder=folder, outputs=[file], changes={"camera.resolution": 2}, progress=False)
        vertices, faces = read_triangles(file)
    tubes = add_mesh("tubes", np.stack([vertices[axis] for axis in "xyz"], axis=-1), faces, collection)
    mesh = tubes.data
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    colors = np.stack([vertices[band] for band in ("red", "green", "blue")] + [np.full(len(vertices), 255)], axis=-1)
    attribute = mesh.color_attributes.new(COLORS, "BYTE_COLOR", "POINT")
    attribute.data.foreach_set("color_srgb", (colors / np.float32(255)).astype(np.float32).ravel())

    def color_node(nodes):
        node = nodes.new("ShaderNodeAttribute")
        node.attribute_name = COLORS
        return node
    add_material(mesh, "tubes", color_node, emits=False)
    return tubes


def load_plate(scene, folder, collection):
    """The plate with its caustic: the light is what it emits."""
    tr = package()
    lit = with_method(scene, "photon_distribution")
    picture = tr.render(lit, folder=folder, progress=False)
    place = tr.landings(lit, s=0.2, folder=folder, changes={"field.scale": picture.scale}, progress=False)
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]) * place.size
    positions = place.center + corners[:, :1] * place.right + corners[:, 1:] * place.up
    plate = add_mesh("plate", positions, np.array([[0, 1, 2, 3]]), collection)
    plate.data.uv_layers.new().data.foreach_set("uv", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))

    def image_node(nodes):
        node = nodes.new("ShaderNodeTexImage")
        node.image = image_of("caustic", picture.linear)
        return node
    add_material(plate.data, "plate", image_node, emits=True)
    return plate


def load_bodies(scene, folder, collection):
    """The scene's obstacles."""
    bodies = []
    for obstacle in scene.get("obstacles", []):
        file = os.path.join(folder, obstacle["file"])
        before = set(bpy.data.objects)
        if file.lower().endswith(".obj"):
            bpy.ops.wm.obj_import(filepath=file, forward_axis="Y", up_axis="Z")
        elif IS_NEW:
            bpy.ops.wm.ply_import(filepath=file, forward_axis="Y", up_axis="Z")
        else:
            bpy.ops.import_mesh.ply(filepath=file)
        for body in set(bpy.data.objects) - before:
            for other in body.users_collection:
                other.objects.unlink(body)
            collection.objects.link(body)
            bodies.append(body)
    return bodies


class LoadTensorray(bpy.types.Operator, ImportHelper):
    """Load the tubes, the plate with its caustic, and the bodies of a scene of tensorray, or of a field"""
    bl_idname = "import_scene.tensorray"
    bl_label = "Load tensorray scene"
    bl_options = {"UNDO"}
    filter_glob: StringProperty(default="*.json;*.vdb", options={"HIDDEN"})
    tubes: BoolProperty(name="Tubes", description="Tubes about the paths of light", default=True)
    plate: BoolProperty(name="Plate", description="The plate with its caustic", default=True)
    bodies: BoolProperty(name="Bodies", description="The obstacles", default=True)

    def execute(self, context):
        name = os.path.splitext(os.path.basename(self.filepath))[0]
        collection = bpy.data.collections.new(name)
        folder = os.path.dirname(os.path.abspath(self.filepath))
        try:
            scene = read_scene(self.filepath)
            if self.tubes:
                load_tubes(scene, folder, collection)
            if self.plate:
                load_plate(scene, folder, collection)
            if self.bodies:
                load_bodies(scene, folder, collection)
        except (ValueError, RuntimeError, OSError) as error:
            for added in list(collection.objects):
                bpy.data.objects.remove(added)
            bpy.data.collections.remove(collection)
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.scene.collection.children.link(collection)
        context.scene[FILE_KEY] = self.filepath
        return {"FINISHED"}


class RenderTensorray(bpy.types.Operator):
    """Render the scene file that was loaded into the image "tensorray", from Blender's camera if there is one"""
    bl_idname = "render.tensorray"
    bl_label = "tensorray"
    filepath: StringProperty(subtype="FILE_PATH", description="The scene's file; empty: the one that was loaded")
    changes: StringProperty(description='Changes of the scene, as {"integrator.noise": 0.02}')
    from_camera: BoolProperty(name="Blender's camera", default=True,
                              description="Look from Blender's camera, at its resolution, instead of the scene's")
    samples: IntProperty(default=0, min=0, description="Greatest number of samples of a pixel; 0: the scene's")

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        path = self.filepath or context.scene.get(FILE_KEY, "")
        try:
            if not path:
                raise ValueError("load a scene first: File > Import > tensorray")
            picture = package().render(path, changes=self.all_changes(context), progress=False)
        except (ValueError, RuntimeError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        old = bpy.data.images.get("tensorray")
        if old:
            bpy.data.images.remove(old)
        image_of("tensorray", picture.linear)
        self.report({"INFO"}, "the picture is the image \"tensorray\"")
        return {"FINISHED"}

    def all_changes(self, context):
        changes = json.loads(self.changes) if self.changes else {}
        if self.samples:
            changes.setdefault("integrator.max_samples", self.samples)
            changes.setdefault("integrator.min_samples", self.samples)
        if self.from_camera and context.scene.camera:
            changes = {**camera_changes(context.scene), **changes}
        return changes


def camera_changes(scene):
    """Blender's camera as keys of a scene. It looks along its −z axis; its field of view is the greater one."""
    camera, render = scene.camera, scene.render
    place = np.array(camera.matrix_world)
    position, forward, up = place[:3, 3], -place[:3, 2], place[:3, 1]
    size = [max(1, side * render.resolution_percentage // 100) for side in (render.resolution_x, render.resolution_y)]
    changes = {"camera.direction": None, "camera.position": position.tolist(),
               "camera.target": (position + forward).tolist(), "camera.up": up.tolist(), "camera.resolution": size}
    if camera.data.type == "ORTHO":
        height = camera.data.ortho_scale * size[1] / max(size)
        return {**changes, "camera.projection": "orthographic", "camera.height": height}
    half = np.tan(camera.data.angle / 2) * size[1] / max(size)
    return {**changes, "camera.projection": "perspective", "camera.angle": float(np.degrees(2 * np.arctan(half)))}


def import_item(menu, context):
    menu.layout.operator(LoadTensorray.bl_idname, text="tensorray (.json, .vdb)")


def render_item(menu, context):
    menu.layout.operator(RenderTensorray.bl_idname)


CLASSES = (LoadTensorray, RenderTensorray)
MENUS = (("TOPBAR_MT_file_import", import_item), ("TOPBAR_MT_render", render_item))


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    for menu, item in MENUS:
        getattr(bpy.types, menu).append(item)


def unregister():
    for menu, item in MENUS:
        getattr(bpy.types, menu).remove(item)
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)


if __name__ == "__main__":
    register()
