# SPDX-License-Identifier: Apache-2.0
"""The motion of a scene: the bodies, and their poses and the camera's from the first frame to the last."""

import dataclasses

import bpy
import numpy

from . import bodies, rebake, settings
from .gltf import GltfWriter
from .programs import Fault

# A simulation that keyed bodies disturb may differ by this much from the one that was seen, m.
ALIKE_M = 1e-3


@dataclasses.dataclass
class Motion:
    bodies: list
    matrices: numpy.ndarray  # of the bodies, and of the camera as the last (B + 1, F, 4, 4)
    frames_per_s: float
    how: str                 # what the poses are, as text
    steps: bool = False      # each frame is a step of the simulation
    shown: tuple = (1, 24)   # the scene's first frame, and its frames a second
    length_s: float = 0      # from the beginning of the first frame to the end of the last one
    cuts: tuple = ()         # frames at which a marker changes the camera
    hints: list = dataclasses.field(default_factory=list)  # why all of the simulation may look odd, and the remedy

    def write(self, path, scene):
        scale = settings.metres_per_unit(scene)
        writer = GltfWriter(numpy.arange(self.matrices.shape[1]) / self.frames_per_s)
        placed = [bodies.split(matrices) for matrices in self.matrices]
        for body, (positions, turns) in zip(self.bodies, placed):
            writer.add_body(body, scale * positions, turns)
        if scene.camera and scene.carillon.use_camera:
            writer.add_camera("camera", scale * placed[-1][0], placed[-1][1])
        writer.write(path)


def read(scene, tell):
    """Reads the motion of a scene, which is a copy and is changed. Calls tell(share, text) at each stage."""
    if scene.render.frame_map_old != scene.render.frame_map_new:
        raise Fault("TIME_REMAPPED", "the scene's time is remapped (Output > Frame Range > Time Stretching): set Old "
                                     "and New alike")
    objects = bodies.taking_part(scene)
    if not objects:
        unheard = "; ".join(f"{names}: {why}" for names, why in bodies.unheard(scene).items())
        raise Fault("NO_BODY", world_is_off(scene) or unheard or
                    f"{scene.name} has no rigid body, and no object has a material of Carillon: give the "
                    "objects that sound a material, and their floor the material none")
    bodies.check_scales(objects)
    free = [obj for obj in objects if obj in bodies.in_world(scene) and bodies.is_free(obj)]
    tell(0.05, "Reading the animation")
    shown = scene.frame_start, rebake.frames_per_s(scene)
    length_s = (scene.frame_end + 1 - scene.frame_start) / shown[1]
    cuts = rebake.cuts(scene)
    found = _read_simulated(scene, objects, free, cuts, tell) if free else _read_keyed(scene, objects)
    found.shown, found.length_s, found.cuts = shown, length_s, cuts
    return found


def world_is_off(scene):
    """What to do about a simulation that does not run, or an empty text."""
    world = scene.rigidbody_world
    if world is None or world.enabled or not any(obj.rigid_body for obj in scene.objects):
        return ""
    return "the simulation is switched off: tick Scene properties > Rigid Body World"


def _check_rigid(scene, objects):
    """Refuses objects whose mesh changes: only rigid bodies have impulses."""
    if scene.carillon.force:
        return
    frames = numpy.linspace(scene.frame_start, scene.frame_end, 5).round()
    names = [obj.name for obj in objects if bodies.deforms(obj, scene, frames)]
    if names:
        raise Fault("BODY_DEFORMS", f"{', '.join(names)}: shape keys or modifiers change the shape, and only what "
                                    "keeps its shape can be heard: take them away, or the material and the rigid "
                                    "body", names)


def _surfaces(scene, objects, matrices, simulated):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return [bodies.read(obj, scene, depsgraph, _moves(m), simulated) for obj, m in zip(objects, matrices)]


def _moves(matrices):
    return numpy.ptp(matrices, axis=0).max() > 1e-7


def _read_keyed(scene, objects):
    n = scene.carillon.sub_frames or _key_density(objects)
    frames = scene.frame_start + numpy.arange((scene.frame_end - scene.frame_start) * n + 1) / n
    matrices = rebake.poses(scene, [*objects, None], frames)
    _check_rigid(scene, objects)
    scene.frame_set(scene.frame_start)
    return Motion(_surfaces(scene, objects, matrices, False), matrices, n * rebake.frames_per_s(scene),
                  "the keys, one pose for each frame" if n == 1 else f"the keys, {n} poses for each frame")


def _key_density(objects):
    """The number of keys in a frame, by the median distance of the keys, and at least one."""
    distances = [after.co[0] - before.co[0] for obj in objects if obj.animation_data and obj.animation_data.action
                 for curve in obj.animation_data.action.fcurves
                 for before, after in zip(curve.keyframe_points, curve.keyframe_points[1:])]
    return max(1, round(1 / max(0.01, float(numpy.median(distances))))) if distances else 1


def _read_simulated(scene, objects, free, cuts, tell):
    cache = scene.rigidbody_world.point_cache
    start, last = cache.frame_start, min(scene.frame_end, cache.frame_end)
    shown = scene.frame_start
    begin = min(start, shown)
    rate, n = rebake.frames_per_s(scene), scene.carillon.sub_frames or rebake.divisor(scene)
    steps = scene.rigidbody_world.substeps_per_frame
    seen = rebake.poses(scene, [*objects, None], range(begin, last + 1))
    _check_rigid(scene, objects)
    scene.frame_set(begin)
    surfaces = _surfaces(scene, objects, seen, True)
    matrices, how = seen, "the frames of the simulation"
    hints, is_baked = [], cache.is_baked
    if last < scene.frame_end:
        hints.append(f"the simulation's cache ends at frame {last}, before the scene does, and what moves stops there: "
                     "set Rigid Body World > Cache > End")
    if steps % n == 0:
        tell(0.15, "Simulating each step as a frame")
        rows = [objects.index(obj) for obj in free]
        driven = [i for i, obj in enumerate(objects) if obj.rigid_body and obj not in free and _moves(seen[i])]
        fine = rebake.resimulate(scene, free, [objects[i] for i in driven], seen[driven, start - begin:], start, last,
                                 n)
        apart = numpy.abs(fine[:, ::n] - seen[rows, start - begin:]).max((0, 2, 3))
        alike = apart.max() <= ALIKE_M / settings.metres_per_unit(bpy.context.scene)
        how = _comparison(apart, start, alike, "each step" if n == steps else f"{n} steps for each frame")
        if is_baked and not alike:
            hints.append("the simulation was baked before something was changed: Rigid Body World > Cache > Delete "
                         "Bake, and bake it again")
        if alike:
            matrices = _between(seen, n)
            for cut in [frame - begin for frame in cuts if begin < frame <= last]:
                matrices[-1, (cut - 1) * n:cut * n] = seen[-1, cut - 1]  # until the cut the camera keeps its place
            matrices[rows, (start - begin) * n:] = fine
    n = n if matrices is not seen else 1
    return Motion(surfaces, matrices[:, (shown - begin) * n:], n * rate, how, n == steps, hints=hints)


def _comparison(apart, start, alike, steps):
    if apart.max() == 0:
        return f"{steps} of the simulation, bit for bit the same animation"
    first = start + numpy.argmax(apart > 0)
    if alike:
        return f"{steps} of the simulation, which differs by up to {apart.max():.2g} from frame {first} on"
    return f"the frames alone, since simulating {steps} gave another animation from frame {first} on"


def _between(seen, n):
    """n poses for each frame, on straight lines, as the simulator moves what is driven."""
    at = numpy.arange((seen.shape[1] - 1) * n + 1)
    before = numpy.minimum(at // n, seen.shape[1] - 2)
    share = ((at - before * n) / n)[None, :, None, None]
    return (1 - share) * seen[:, before] + share * seen[:, before + 1]
