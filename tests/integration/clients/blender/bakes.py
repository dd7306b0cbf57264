# SPDX-License-Identifier: Apache-2.0
"""Run by Blender for test_blender.py: builds scenes, bakes them, and writes what came of it to bakes.json.

    blender --background --factory-startup --python bakes.py -- ADDONS FOLDER
"""

import json
import os
import pathlib
import sys

import bmesh
import bpy
import numpy

ADDONS, FOLDER = sys.argv[sys.argv.index("--") + 1:]
FOLDER = pathlib.Path(FOLDER)
sys.path.insert(0, ADDONS)
import carillon_blender  # noqa: E402
from carillon_blender import bodies, freshness, programs, rebake  # noqa: E402

carillon_blender.register()
found = {}


def empty_scene(name, fps):
    for obj in list(bpy.data.objects):
        if obj.type == 'MESH':
            bpy.data.objects.remove(obj)
    scene = bpy.context.scene
    if scene.rigidbody_world:
        bpy.ops.rigidbody.world_remove()
    scene.render.fps, scene.frame_start, scene.frame_end = fps, 1, 1 + fps
    scene.frame_set(1)
    bpy.ops.wm.save_as_mainfile(filepath=os.fspath(FOLDER / f"{name}.blend"))
    return scene


def add(name, kind, location, scale, rotation=(0, 0, 0), size=1):
    """A cube or a plane with rigid body physics."""
    make = bpy.ops.mesh.primitive_plane_add if name == "Floor" else bpy.ops.mesh.primitive_cube_add
    make(size=size, location=location, rotation=rotation)
    obj = bpy.context.object
    obj.name, obj.scale = name, scale
    if kind:
        bpy.ops.rigidbody.object_add(type=kind)
        obj.rigid_body.restitution = 0.6
    return obj


def bake(scene):
    result = bpy.ops.carillon.bake()
    faults = {obj.name: obj.carillon.fault for obj in scene.objects if obj.carillon.fault}
    return {"result": list(result), "report": scene.carillon.report, "fault": scene.carillon.fault, "faults": faults}


def strips(scene):
    return [{"name": strip.name, "channel": strip.channel, "start": strip.frame_start, "mute": strip.mute,
             "frames": strip.frame_final_duration, "volume": strip.volume,
             "path": bpy.path.abspath(strip.sound.filepath)}
            for strip in scene.sequence_editor.sequences]


def seen(scene, obj):
    frames = range(scene.frame_start, scene.frame_end + 1)
    return rebake.poses(scene, [obj], frames)[0].tolist()


def fall():
    """A bar, whose scale is far from even, falls on a floor; at a frame rate of which a
    tenth of a step is no number of single precision."""
    scene = empty_scene("fäll of a bar", 25)
    scene.frame_start, scene.frame_end = 5, 30
    bpy.ops.rigidbody.world_add()
    scene.rigidbody_world.point_cache.frame_start = 5
    add("Floor", 'PASSIVE', (0, 0, 0), (1, 1, 1), size=4)
    bar = add("Bar \\[1]", 'ACTIVE', (0, 0, 0.3), (0.3, 0.03, 0.015), (0.1, 0.2, 0))
    bar.carillon.material = "structural_steel"
    scene.carillon.normalize, scene.carillon.stems = False, True
    bpy.ops.object.camera_add(location=(0, -1, 0.3), rotation=(1.5708, 0, 0))
    scene.camera = bpy.context.object
    before = [(obj.name, obj.matrix_basis.copy()) for obj in scene.objects]
    found["fall"] = bake(scene)
    found["strips"] = strips(scene)
    found["unchanged"] = before == [(obj.name, obj.matrix_basis.copy()) for obj in scene.objects] and (
        scene.render.fps, scene.rigidbody_world.substeps_per_frame, scene.rigidbody_world.time_scale) == (25, 10, 1)
    found["seen"] = seen(scene, bar)
    return scene, bar


def freshness_of(scene, bar):
    marks = {}

    def mark(name):
        freshness.look(scene)
        marks[name] = scene.carillon.out_of_date

    mark("baked")
    scene.frame_set(20)
    mark("another frame")
    bar.carillon.material = "oak"
    mark("material")
    bar.carillon.material = "structural_steel"
    mark("material again")
    bar.location.z += 0.1
    mark("place")
    bar.location.z -= 0.1
    bar.rigid_body.friction = 0.1
    mark("friction")
    bar.rigid_body.friction = 0.5
    bar.data.vertices[0].co.x -= 0.1
    mark("shape")
    bar.data.vertices[0].co.x += 0.1
    mark("all again")
    found["marks"] = marks


def failures(scene, bar):
    refused = found["refused"] = {}
    bar.carillon.material = "steeel"
    refused["material"] = bake(scene)
    bar.carillon.material = "structural_steel"
    scene.render.frame_map_new = 200
    refused["time"] = bake(scene)
    scene.render.frame_map_new = 100
    path = os.environ["PATH"]
    os.environ["PATH"] = "/nowhere"
    refused["programs"] = bake(scene)
    os.environ["PATH"] = path
    mesh = bmesh.new()
    mesh.from_mesh(bar.data)
    bmesh.ops.delete(mesh, geom=[mesh.faces[:][0]], context='FACES_ONLY')
    mesh.to_mesh(bar.data)
    mesh.free()
    refused["open"] = bake(scene)
    bar.carillon.material = ""
    refused["no material"] = bake(scene)
    bpy.ops.object.text_add()
    bpy.context.object.name, bpy.context.object.carillon.material = "Letter", "brass"
    refused["no mesh"] = bake(scene)
    bar.carillon.material = "structural_steel"
    bar.scale.x *= -1
    refused["negative scale"] = bake(scene)
    bar.scale.x *= -1
    bar.shape_key_add(name="Basis")
    key = bar.shape_key_add(name="Long")
    key.data[0].co.x -= 0.2
    for frame, value in ((5, 0), (30, 1)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    refused["shape keys"] = bake(scene)
    found["strips after refusals"] = strips(scene)


def usual():
    """Two bodies with the settings that Blender gives them: a tilted bar, whose ends a step of the simulation pushes at
    once, and a steel ball, which is too small to be heard and passes the floor by half its radius within a step."""
    scene = empty_scene("usual", 24)
    scene.carillon.stems = scene.carillon.radiation = False
    bpy.ops.rigidbody.world_add()
    add("Ground", 'PASSIVE', (0, 0, -0.05), (4, 4, 0.1)).rigid_body.collision_shape = 'BOX'
    bar = add("Tilted", 'ACTIVE', (0, 0, 0.4), (0.3, 0.04, 0.01), (0, 0.4, 0))
    bpy.ops.object.transform_apply(location=False, rotation=False)
    bar.rigid_body.collision_shape, bar.rigid_body.restitution = 'BOX', 0
    bar.carillon.material = "soda_lime_glass"
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.015, location=(0.6, 0, 0.35))
    ball = bpy.context.object
    ball.name = "Ball"
    bpy.ops.rigidbody.object_add(type='ACTIVE')
    ball.rigid_body.collision_shape = 'SPHERE'
    ball.carillon.material = "structural_steel"
    found["usual"] = bake(scene)
    scene.sequence_editor.sequences["Carillon"].frame_start += 7
    found["baked again"] = bake(scene)
    found["usual strips"] = strips(scene)
    freshness.look(scene)
    found["stale"] = [scene.carillon.out_of_date]
    scene.sequence_editor.sequences.remove(scene.sequence_editor.sequences["Carillon"])
    freshness.look(scene)
    found["stale"].append(scene.carillon.out_of_date)


def keyed():
    """The bounce of a bar by keys alone, one for each frame, on a floor that is no rigid body. After the blow a marker
    changes to a camera that has the bar on its right."""
    scene = empty_scene("keyed", 60)
    scene.carillon.radiation = True
    add("Floor", None, (0, 0, 0), (1, 1, 1), size=4).carillon.material = "none"
    bar = add("Keyed", None, (0, 0, 0), (0.3, 0.03, 0.015))
    bar.carillon.material = "structural_steel"
    lands, speed, half = 0.2021, 9.81 * 0.2021, 0.0075
    for frame in range(scene.frame_start, scene.frame_end + 1):
        after = (frame - scene.frame_start) / 60 - lands
        bar.location.z = half + (-speed * after if after < 0 else 0.5 * speed * after) - 9.81 * after ** 2 / 2
        if bar.location.z < half:
            scene.frame_end = frame - 1
            break
        bar.keyframe_insert("location", frame=frame)
    bpy.ops.object.camera_add(location=(-1, 0, 0.3), rotation=(1.5708, 0, 0))
    for frame, camera in ((1, scene.camera), (18, bpy.context.object)):
        scene.timeline_markers.new("view", frame=frame).camera = camera
    found["keyed"] = bake(scene)
    scene.frame_set(30)
    freshness.look(scene)
    found["keyed stale"] = scene.carillon.out_of_date
    scene.frame_set(1)
    found["keyed lands"] = lands
    bar.animation_data_clear()
    found["still"] = bake(scene)


def compound():
    """A top with two legs, one of which just touches it, and the other ends inside of it."""
    scene = empty_scene("compound", 24)
    bpy.ops.rigidbody.world_add()
    top = add("Top", 'ACTIVE', (0, 0, 0.8), (0.5, 0.5, 0.03))
    bpy.ops.object.transform_apply(location=False, rotation=False)
    top.rigid_body.collision_shape, top.carillon.material = 'COMPOUND', "oak"
    for name, x, height in (("Touches", -0.2, -0.215), ("Inside", 0.2, -0.2)):
        leg = add(name, 'ACTIVE', (x, 0.2, height), (0.04, 0.04, 0.4))
        bpy.ops.object.transform_apply(location=False, rotation=False)
        leg.parent = top
    top.rotation_euler = (0.3, 0.1, 0)

    def read():
        depsgraph = bpy.context.evaluated_depsgraph_get()
        body = bodies.read(top, scene, depsgraph, True, True)
        edges = numpy.sort(body.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        volume = float(numpy.linalg.det(body.vertices[body.triangles]).sum() / 6)
        closed = bool((numpy.unique(edges, axis=0, return_counts=True)[1] == 2).all())
        return {"volume": volume, "closed": closed, "euler": len(body.vertices) - len(body.triangles) // 2,
                "collided": len(body.collider)}

    found["compound"] = read()
    bpy.data.objects["Inside"].carillon.material = bpy.data.objects["Touches"].carillon.material = "none"
    found["compound of none"] = read()


def margins():
    """The margin of a shape Mesh while the simulation moves spheres alone, and then a box, too."""
    scene = empty_scene("margins", 24)
    bpy.ops.rigidbody.world_add()
    ground = add("Ground", 'PASSIVE', (0, 0, -0.1), (2, 2, 0.2))
    ground.rigid_body.collision_shape = 'MESH'
    add("Marble", 'ACTIVE', (0, 0, 1), (0.1, 0.1, 0.1)).rigid_body.collision_shape = 'SPHERE'

    def rounding():
        return bodies.read(ground, scene, bpy.context.evaluated_depsgraph_get(), False, True).rounding

    found["margins"] = [rounding()]
    add("Die", 'ACTIVE', (0.5, 0, 1), (0.1, 0.1, 0.1))
    found["margins"].append(rounding())


programs.materials()
fall_scene, fall_bar = fall()
freshness_of(fall_scene, fall_bar)
failures(fall_scene, fall_bar)
keyed()
usual()
compound()
margins()
carillon_blender.unregister()
(FOLDER / "bakes.json").write_text(json.dumps(found))
