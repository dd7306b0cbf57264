# SPDX-License-Identifier: Apache-2.0
"""Requests that are damaged or dangerous are refused, and leave nothing behind."""

import unittest

import grpc

import meshes
from carillon.v1 import admin_service_pb2, admin_service_pb2_grpc, material_pb2, modal_model_service_pb2
from daemon import DaemonTest

MATERIAL = material_pb2.Material(preset=meshes.MATERIAL)


def raw_stream(channel, method):
    """A method that takes a stream of bytes instead of messages."""
    return channel.stream_unary(method)


class RequestTest(DaemonTest):
    def setUp(self):
        self.channel = grpc.insecure_channel(self.daemon.server)
        self.addCleanup(self.channel.close)
        self.admin = admin_service_pb2_grpc.AdminServiceStub(self.channel)

    def assert_refused(self, call, reason):
        with self.assertRaises(grpc.RpcError) as refused:
            call()
        self.assertTrue(refused.exception.details().startswith(reason + ": "), refused.exception.details())

    def test_a_message_that_does_not_parse_ends_an_upload_and_stores_nothing(self):
        stats = admin_service_pb2.GetDatabaseStatsRequest()
        before = self.admin.GetDatabaseStats(stats).mesh_count
        good = modal_model_service_pb2.UploadMeshRequest(data=meshes.bar()[:100]).SerializeToString()
        for bad in (b"\x0a\xff\xff\xff\xff\x0f", b"\x0b", b"\x00\x00", b"\xff"):
            upload = raw_stream(self.channel, "/carillon.v1.ModalModelService/UploadMesh")
            self.assert_refused(lambda bad=bad, upload=upload: upload(iter((good, bad))), "REQUEST_MALFORMED")
        self.assertEqual(self.admin.GetDatabaseStats(stats).mesh_count, before)

    def test_collecting_garbage_needs_a_budget_or_a_word(self):
        self.client.wait(self.client.create(meshes.bar(), "obj", material=MATERIAL))
        models = [found.name for found in self.client.list()]
        request = admin_service_pb2.CollectGarbageRequest
        self.assert_refused(lambda: self.admin.CollectGarbage(request()), "INVALID_SETTINGS")
        self.assert_refused(lambda: self.admin.CollectGarbage(request(dry_run=True)), "INVALID_SETTINGS")
        self.assert_refused(lambda: self.admin.CollectGarbage(request(budget_bytes=1, delete_unpinned=True)),
                            "INVALID_SETTINGS")
        self.assert_refused(lambda: self.admin.CollectGarbage(request(budget_bytes=1, delete_unused_meshes=True)),
                            "INVALID_SETTINGS")
        self.assertEqual(self.admin.CollectGarbage(request(delete_unused_meshes=True)).deleted_count, 0)
        self.daemon.command("db", "collect", "--unused-meshes")
        self.assertEqual([found.name for found in self.client.list()], models)
        counted = self.admin.CollectGarbage(request(budget_bytes=1, dry_run=True))
        self.assertEqual(counted.deleted_count, len(models))
        self.assertEqual([found.name for found in self.client.list()], models)
        self.assertNotEqual(self.daemon.command("db", "collect", check=False).returncode, 0)
        printed = self.daemon.command("db", "collect", "--delete-unpinned", "--dry-run").stdout
        self.assertRegex(printed, f"^{len(models)} models? would be deleted")
        self.daemon.command("db", "collect", "--delete-unpinned")
        self.assertEqual(list(self.client.list()), [])

    def test_a_label_is_cut_between_letters_and_the_list_stays_readable(self):
        material = material_pb2.Material(preset=meshes.MATERIAL, poisson_ratio=0.3)
        model = self.client.wait(self.client.create(meshes.bar(), "obj", material=material))
        self.client.models.UpdateModalModel(modal_model_service_pb2.UpdateModalModelRequest(
            name=model, label="x" * 199 + "鐘"))
        self.assertIn("x" * 199, [found.label for found in self.client.list()])


if __name__ == "__main__":
    unittest.main()
