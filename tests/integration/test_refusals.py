# SPDX-License-Identifier: Apache-2.0
"""Each bad mesh gets its own reason and a way to repair it, and the daemon goes on playing."""

import subprocess
import unittest

import grpc

import meshes
import strike
from carillon.v1 import contact_pb2, error_pb2, material_pb2
from carillon.v1 import modal_model_service_pb2, scene_service_pb2
from daemon import BIN, DaemonTest

MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)
BOX = meshes.box((0.10, 0.03, 0.02))
MESH_LIMIT_BYTES = 256 << 20


def with_vertex(index, vertex):
    vertices = list(BOX[0])
    vertices[index] = vertex
    return meshes.obj(vertices, BOX[1])


BAD_MESHES = {
    "MESH_EMPTY": b"",
    "MESH_UNREADABLE": b"Dear Carillon,\nthis is a letter and not a mesh.\n",
    "MESH_NOT_CLOSED": meshes.obj(BOX[0], BOX[1][1:]),
    "MESH_SELF_INTERSECTING": meshes.obj(
        *meshes.joined(BOX, meshes.box((0.10, 0.03, 0.02), low=(0.05, 0.01, 0.01)))),
    "MESH_DUPLICATE_SHELL": meshes.obj(*meshes.joined(BOX, BOX)),
    "MESH_NOT_FINITE": with_vertex(3, ("nan", 0.03, 0)),
    "MESH_INDEX_OUT_OF_RANGE": meshes.obj(BOX[0], BOX[1] + ((0, 1, 99),)),
    # A splinter of a millimetre rings at 256 kHz, which no ear hears.
    "NO_MODE_IN_BAND": meshes.obj(*meshes.box([length / 200 for length in meshes.BAR_SIZE])),
}


# The options that help against them.
REMEDIES = {"MESH_NOT_CLOSED": ["--repair"], "MESH_SELF_INTERSECTING": ["--repair"],
            "MESH_DUPLICATE_SHELL": ["--repair"], "NO_MODE_IN_BAND": ["--band", "--size"]}


class RefusalTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        model = cls.client.wait(cls.client.create(meshes.bar(), "obj", material=MATERIAL))
        cls.scene = cls.client.scenes.CreateScene(scene_service_pb2.CreateSceneRequest()).name
        cls.handle = cls.client.scenes.AddObjects(scene_service_pb2.AddObjectsRequest(
            scene=cls.scene,
            objects=[scene_service_pb2.NewObject(modal_model=model, material=MATERIAL)])).objects[0].handle

    def setUp(self):
        self.addCleanup(self.assert_plays)

    def assert_plays(self):
        impulse = contact_pb2.Contact(
            kind=contact_pb2.CONTACT_KIND_IMPACT, object=self.handle, point_m=contact_pb2.Vec3(z=meshes.BAR_SIZE[2]),
            impulse_newton_seconds=contact_pb2.Vec3(z=-0.001))
        heard = self.client.listen(0.2, on_start=lambda: self.client.strike(self.scene, [impulse]))
        self.assertGreater(max(map(abs, heard.samples)), 1e-5)

    def assert_repairs(self, message):
        """A sentence of what was wrong and, after a colon or semicolon, what to do."""
        self.assertRegex(message, r"^.{8,}[:;] .{8,}")

    def refusal(self, call):
        """The ErrorInfo that a call or the job that it waits for ends with."""
        try:
            call()
        except strike.Refused as refused:
            return refused.info
        except grpc.RpcError as error:
            return strike.refusal(error).info
        return error_pb2.ErrorInfo()

    def test_over_grpc(self):
        for reason, data in BAD_MESHES.items():
            with self.subTest(reason):
                info = self.refusal(lambda data=data: self.client.wait(
                    self.client.create(data, "obj", material=MATERIAL)))
                self.assertEqual(info.reason, reason)
                self.assertEqual([remedy.option for remedy in info.remedies], REMEDIES.get(reason, []))
                self.assert_repairs(info.message)
                self.assert_plays()

    def test_on_the_command_line(self):
        path = self.folder / "bad.obj"
        for reason, data in BAD_MESHES.items():
            with self.subTest(reason):
                path.write_bytes(data)
                ended = self.daemon.command("model", "create", path, "--material", meshes.MATERIAL,
                                            "--wait", "--no-repair", check=False)
                self.assertEqual((ended.returncode, ended.stdout), (1, ""))
                tries = [line for line in ended.stderr.splitlines() if line.startswith("carillon: try ")]
                self.assertEqual([line.split()[2].rstrip(":") for line in tries], REMEDIES.get(reason, []))
                line = ended.stderr.splitlines()[-1 - len(tries)]
                self.assertTrue(line.startswith(f"carillon: {reason}: "), line)
                self.assert_repairs(line.removeprefix(f"carillon: {reason}: "))
                self.assert_plays()

    def test_file_over_the_limit(self):
        piece = modal_model_service_pb2.UploadMeshRequest(data=bytes(strike.PIECE_BYTES))
        pieces = (piece for _ in range(MESH_LIMIT_BYTES // strike.PIECE_BYTES + 1))
        info = self.refusal(lambda: self.client.models.UploadMesh(pieces))
        self.assertEqual(info.reason, "MESH_TOO_LARGE")
        self.assert_repairs(info.message)
        self.assert_plays()
        path = self.folder / "large.stl"
        with open(path, "wb") as large:
            large.truncate(MESH_LIMIT_BYTES + 1)
        ended = self.daemon.command("model", "create", path, "--material", meshes.MATERIAL,
                                    check=False)
        self.assertEqual(ended.returncode, 1)
        self.assertIn("carillon: MESH_TOO_LARGE: ", ended.stderr)

class CommandLineTest(DaemonTest):
    def command(self, *arguments):
        return self.daemon.command(*arguments, check=False)

    def test_exit_status_tells_refused_from_called_wrongly_from_no_daemon(self):
        self.assertEqual(self.command("status").returncode, 0)
        self.assertEqual(self.command("model", "show", "nothing").returncode, 1)
        self.assertEqual(self.command("model").returncode, 2)
        nowhere = subprocess.run([BIN / "carillon", "--server", f"unix:{self.folder}/none", "status"],
                                 capture_output=True, text=True, check=False)
        self.assertEqual(nowhere.returncode, 3)
        self.assertTrue(nowhere.stderr.startswith("carillon: SERVER_UNAVAILABLE: "), nowhere.stderr)


if __name__ == "__main__":
    unittest.main()
