# SPDX-License-Identifier: Apache-2.0
"""A bad mesh gets its own reason and a way to repair it, and the daemon goes on playing."""

import grpc

import meshes
import sound
import strike
from carillon.v1 import modal_model_service_pb2
from daemon import DaemonTest

BOX = meshes.box((0.10, 0.03, 0.02))
MESH_LIMIT_BYTES = 256 << 20


# By the reason of its refusal: a mesh, and the options that help.
BAD_MESHES = {
    "MESH_UNREADABLE": (b"Dear Carillon,\nthis is a letter and not a mesh.\n", []),
    "MESH_NOT_CLOSED": (meshes.obj(BOX[0], BOX[1][1:]), ["--repair"]),
    "MESH_SELF_INTERSECTING": (meshes.obj(
        *meshes.joined(BOX, meshes.box((0.10, 0.03, 0.02), low=(0.05, 0.01, 0.01)))), ["--repair"]),
    "MESH_DUPLICATE_SHELL": (meshes.obj(*meshes.joined(BOX, BOX)), ["--repair"]),
    # A splinter of a millimetre rings at 256 kHz, which no ear hears.
    "NO_MODE_IN_BAND": (meshes.obj(*meshes.box([length / 200 for length in meshes.BAR_SIZE])), ["--band", "--size"]),
}


class RefusalTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scene, cls.bar = cls.client.scene(cls.client.model())

    def setUp(self):
        self.addCleanup(self.assert_plays)

    def assert_plays(self):
        impulse = sound.impulse((0, 0, meshes.BAR_SIZE[2]), (0, 0, -0.001), self.bar.handle, duration_s=None)
        heard = self.client.listen(0.2, on_start=lambda: self.client.strike(self.scene, [impulse]))
        self.assertGreater(max(map(abs, heard.samples)), 1e-5)

    def assert_repairs(self, message):
        """A sentence of what was wrong and, after a colon or semicolon, what to do."""
        self.assertRegex(message, r"^.{8,}[:;] .{8,}")

    def test_on_the_command_line(self):
        path = self.folder / "bad.obj"
        for reason, (data, remedies) in BAD_MESHES.items():
            with self.subTest(reason):
                path.write_bytes(data)
                ended = self.daemon.command("model", "create", path, "--material", meshes.MATERIAL,
                                            "--wait", "--no-repair", check=False)
                self.assertEqual((ended.returncode, ended.stdout), (1, ""))
                tries = [line for line in ended.stderr.splitlines() if line.startswith("carillon: try ")]
                self.assertEqual([line.split()[2].rstrip(":") for line in tries], remedies)
                line = ended.stderr.splitlines()[-1 - len(tries)]
                self.assertTrue(line.startswith(f"carillon: {reason}: "), line)
                self.assert_repairs(line.removeprefix(f"carillon: {reason}: "))
                self.assert_plays()

    def test_file_over_the_limit(self):
        piece = modal_model_service_pb2.UploadMeshRequest(data=bytes(strike.PIECE_BYTES))
        pieces = (piece for _ in range(MESH_LIMIT_BYTES // strike.PIECE_BYTES + 1))
        with self.assertRaises(grpc.RpcError) as refused:
            self.client.models.UploadMesh(pieces)
        info = strike.refusal(refused.exception).info
        self.assertEqual(info.reason, "MESH_TOO_LARGE")
        self.assert_repairs(info.message)
        self.assert_plays()
        path = self.folder / "large.stl"
        with open(path, "wb") as large:
            large.truncate(MESH_LIMIT_BYTES + 1)
        self.assertEqual(self.daemon.refusal("model", "create", path, "--material", meshes.MATERIAL), "MESH_TOO_LARGE")
