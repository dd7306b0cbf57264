# SPDX-License-Identifier: Apache-2.0
"""What a report says beside the figures of `carillon foley`: what in the scene is heard otherwise than one may expect,
and how long the models took."""

import itertools
import re
import time

import aud
import bpy
import mathutils.bvhtree
import numpy

from . import bodies, settings

INAUDIBLE = 1e-3  # -60 dB of the whole
LEAST_S = 5       # a model that takes less time is not worth a line


def of(scene, found):
    """Lines about the scene and its bodies."""
    lines = []
    if scene.carillon.use_camera and scene.camera is None:
        lines.append("warning: the scene has no camera to hear from: each body is heard from 1 m, in the middle")
    silent = []
    for body in found.bodies:
        obj = bpy.data.objects[body.name]
        material = obj.carillon.material or body.material
        if material not in ("", "none") and (obj.hide_render or obj.hide_viewport):
            lines.append(f"warning: {body.name} is hidden, and heard all the same: give it the material none")
        slots = [slot.material.name for slot in obj.material_slots if slot.material]
        if not material:
            silent.append(f'{body.name} (no material has the name of its Blender material, "{slots[0]}")' if slots
                          else body.name)
    lines += [f"warning: {names}: {why}" for names, why in bodies.unheard(scene).items()]
    if silent:
        lines.append("Silent, without a material: " + ", ".join(silent))
    return lines + [f"warning: {one} and {other} overlap in the first frame: what pushes them apart is heard as blows"
                    for one, other in _overlapping(scene, found)]


def _inset(body, matrix, metres_per_unit):
    """The surface of a body in the world, moved inward by a hundredth of its least side, so that bodies that merely
    touch are apart."""
    corners = body.vertices[body.triangles]
    areas = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = numpy.sign((areas * (corners[:, 0] - body.vertices.mean(0))).sum())
    normals = numpy.zeros_like(body.vertices)
    for corner in range(3):
        numpy.add.at(normals, body.triangles[:, corner], outward * areas)
    normals /= numpy.maximum(numpy.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    placed = body.vertices - 0.01 * numpy.ptp(body.vertices, 0).min() * normals
    return placed @ bodies.rotation(matrix).T + metres_per_unit * numpy.asarray(matrix, float)[:3, 3]


def _overlapping(scene, found):
    """Pairs of bodies whose surfaces cross at the first frame, one of which is simulated."""
    placed = [_inset(body, matrices[0], settings.metres_per_unit(scene))
              for body, matrices in zip(found.bodies, found.matrices)]
    trees = [mathutils.bvhtree.BVHTree.FromPolygons(vertices.tolist(), body.triangles.tolist())
             for body, vertices in zip(found.bodies, placed)]
    for a, b in itertools.combinations(range(len(trees)), 2):
        near = (placed[a].max(0) > placed[b].min(0)).all() and (placed[b].max(0) > placed[a].min(0)).all()
        if near and (found.bodies[a].mass or found.bodies[b].mass) and trees[a].overlap(trees[b]):
            yield found.bodies[a].name, found.bodies[b].name


def take_job(line, jobs):
    """Notes from a line of `carillon foley` how far the model of a body is, and when: name -> [begin, end, nodes]."""
    at = re.match(r"(.+?) +\d+ %  (.*)", line)
    if at:
        job = jobs.setdefault(at[1], [time.monotonic(), 0, ""])
        job[1] = time.monotonic()
        nodes = re.search(r"\d+ nodes", at[2])
        job[2] = nodes[0] if nodes else job[2]


def of_sound(scene, folder, figures, jobs):
    """Lines about the sound that `carillon foley` has written into a folder, and about the models that it awaited."""
    lines = []
    if figures.startswith("0 impacts"):
        full = ", and Normalize makes it loud" if scene.carillon.normalize else ""
        lines.append(f"warning: no impact in this range: what is heard rests, rolls or slides{full}")
    if "paper's coupling" in (folder / "summary").read_text(encoding="utf-8", errors="replace"):
        lines.append("warning: without Radiation, levels are not physical: a body may be too loud or too soft beside "
                     "another")
    whole = _peak(folder / "sound.wav")
    if whole == 0:
        lines.append("warning: the sound is silent: nothing strikes what has a material")
    for stem in sorted((folder / "stems").glob("*.wav")) if whole else ():
        share = _peak(stem) / whole
        if share < INAUDIBLE:
            why = (f"{-20 * numpy.log10(share):.0f} dB below the whole: small solid bodies have no audible tone; a "
                   "Wall gives one" if share > 0 else "nothing strikes it in this range, or it is small and solid")
            lines.append(f"warning: {re.sub(r'^[0-9]+-', '', stem.stem)}: cannot be heard: {why}")
    return lines + [f"{name}: {', '.join(filter(None, [nodes, f'{end - begin:.0f} s']))}"
                    for name, (begin, end, nodes) in jobs.items() if end - begin >= LEAST_S]


def _peak(path):
    samples = aud.Sound.file(str(path)).data()
    return float(numpy.abs(samples).max()) if samples.size else 0
