# SPDX-License-Identifier: Apache-2.0
"""A video of a scene that falls, with its sound: VTK draws the frames, which needs an X server such as Xvfb, and ffmpeg
packs them."""

import copy
import math
import pathlib
import subprocess
import tempfile

import falls

FRAMES_PER_S, WIDTH, HEIGHT = 25, 640, 360
LONGEST_S = 30
COLOURS = (("metal", (0.78, 0.80, 0.85)), ("alumin", (0.72, 0.78, 0.88)), ("wood", (0.78, 0.58, 0.36)),
           ("ceramic", (0.93, 0.90, 0.84)), ("plastic", (0.35, 0.60, 0.85)), ("letter", (0.85, 0.45, 0.30)))
SILENT, GROUND, BACKGROUND = (0.45, 0.45, 0.48), (0.30, 0.32, 0.34), (0.10, 0.11, 0.13)


def poses_of(engine, scene, **how):
    """Lists, of each frame, the (position, orientation w, x, y, z) of every body. The scene falls once more, with every
    body as one that sounds, because a trace has the poses of those alone."""
    import carillon
    everyone = copy.deepcopy(scene)
    for body in everyone["bodies"]:
        if "plane" not in body["shape"]:
            body["model"] = body.get("model", "modalModels/unused")
    with tempfile.TemporaryDirectory(prefix="carillon-") as folder:
        trace = pathlib.Path(folder, "poses.contacts")
        falls.record(engine, everyone, trace, **how)
        return frames_of(scene, carillon.Trace.read(trace).steps)


def frames_of(scene, steps):
    """As poses_of, of steps that have the poses of all bodies; body i is the object i + 1."""
    now = [(body.get("position_m", (0, 0, 0)), body.get("orientation", (1, 0, 0, 0))) for body in scene["bodies"]]
    frames, due = [], 0
    for step in steps:
        while step.time_s > due / FRAMES_PER_S and due < LONGEST_S * FRAMES_PER_S:
            frames.append(list(now))
            due += 1
        take(step, now)
    return frames


def take(step, now):
    """Moves the bodies to their poses in the step; object i + 1 is body i."""
    columns = step.poses
    for i, handle in enumerate(columns.object):
        now[handle - 1] = (columns.position_m[3 * i:3 * i + 3], columns.orientation[4 * i:4 * i + 4] or (1, 0, 0, 0))


def colour_of(body):
    material = body.get("material", "")
    return next((colour for word, colour in COLOURS if word in material), SILENT)


def as_surface(vtk, vertices, faces):
    points, cells = vtk.vtkPoints(), vtk.vtkCellArray()
    for vertex in vertices:
        points.InsertNextPoint(vertex)
    for face in faces:
        cells.InsertNextCell(len(face), list(face))
    surface = vtk.vtkPolyData()
    surface.SetPoints(points)
    surface.SetPolys(cells)
    return surface


def surfaces_of(vtk, body, folder):
    """What is drawn of a body, in its frame."""
    if "mesh" in body:
        reader = vtk.vtkOBJReader()
        reader.SetFileName(str(folder / body["mesh"]))
        reader.Update()
        return [reader.GetOutput()]
    shape = body["shape"]
    if "plane" in shape:
        return [as_surface(vtk, [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)])]
    if "ball" in shape:
        return [as_surface(vtk, *falls.ball_mesh(shape["ball"]["radius_m"]))]
    surfaces = []
    for box in shape["boxes"]:
        vertices, faces = falls.box_mesh(box["sides_m"])
        at, turn = box.get("position_m", (0, 0, 0)), box.get("orientation", (1, 0, 0, 0))
        surfaces.append(as_surface(vtk, [[a + b for a, b in zip(at, falls.rotated(turn, v))] for v in vertices], faces))
    return surfaces


def add_body(vtk, renderer, body, folder):
    """Returns the actors of the body."""
    actors = []
    for surface in surfaces_of(vtk, body, folder):
        normals, mapper, actor = vtk.vtkPolyDataNormals(), vtk.vtkPolyDataMapper(), vtk.vtkActor()
        normals.SetInputData(surface)
        normals.SetFeatureAngle(40)  # an edge below it is drawn round
        mapper.SetInputConnection(normals.GetOutputPort())
        mapper.ScalarVisibilityOff()
        actor.SetMapper(mapper)
        actor.GetProperty().SetColor(GROUND if "plane" in body["shape"] else colour_of(body))
        actor.GetProperty().SetAmbient(0.25)
        actor.GetProperty().SetSpecular(0.3)
        actor.GetProperty().SetSpecularPower(25)
        renderer.AddActor(actor)
        actors.append(actor)
    return actors


def place(actors, position, orientation):
    w, x, y, z = orientation
    length = math.sqrt(x * x + y * y + z * z)
    for actor in actors:
        actor.SetPosition(position)
        actor.SetOrientation(0, 0, 0)
        if length > 0:
            actor.RotateWXYZ(math.degrees(2 * math.atan2(length, w)), x, y, z)


def stage(vtk, scene):
    """The window, its renderer, light and camera: in front of the scene, a little above it."""
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    renderer.SetBackground(BACKGROUND)
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(4)
    window.SetSize(WIDTH, HEIGHT)
    window.AddRenderer(renderer)
    extent = scene["extent_m"]
    light = vtk.vtkLight()
    light.SetPosition(-extent, -2 * extent, 3 * extent)
    light.SetFocalPoint(0, 0, 0)
    renderer.AddLight(light)
    camera = renderer.GetActiveCamera()
    camera.SetViewUp(0, 0, 1)
    camera.SetFocalPoint(scene.get("look_at_m", (0, 0, 0.1 * extent)))
    camera.SetPosition(scene.get("camera_m", (0.4 * extent, -1.1 * extent, 0.5 * extent)))
    camera.SetViewAngle(36)
    renderer.ResetCameraClippingRange(-20, 20, -20, 20, -20, 20)
    return renderer, window


def draw(scene, folder, frames, take_frame):
    """Passes the bytes of each frame, RGB from the lowest row up, to `take_frame`."""
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
    renderer, window = stage(vtk, scene)
    actors = [add_body(vtk, renderer, body, folder) for body in scene["bodies"]]
    for poses in frames:
        for parts, (position, orientation) in zip(actors, poses):
            place(parts, position, orientation)
        renderer.ResetCameraClippingRange()
        window.Render()
        image = vtk.vtkWindowToImageFilter()
        image.SetInput(window)
        image.ReadFrontBufferOff()
        image.Update()
        take_frame(vtk_to_numpy(image.GetOutput().GetPointData().GetScalars()).tobytes())


def make(scene, frames, folder, sound, out):
    """Writes the video of a scene whose sound is a WAV file."""
    words = ["ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size",
             f"{WIDTH}x{HEIGHT}", "-framerate", str(FRAMES_PER_S), "-i", "-", "-i", sound, "-vf", "vflip", "-c:v",
             "libx264", "-pix_fmt", "yuv420p", "-crf", "26", "-c:a", "aac", "-b:a", "96k", "-t", str(LONGEST_S),
             "-movflags", "+faststart", out]
    with subprocess.Popen(list(map(str, words)), stdin=subprocess.PIPE) as ffmpeg:
        draw(scene, folder, frames, ffmpeg.stdin.write)
        ffmpeg.stdin.close()
        if ffmpeg.wait() != 0:
            raise RuntimeError(f"ffmpeg could not write {out}")
