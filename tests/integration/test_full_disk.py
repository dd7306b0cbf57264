# SPDX-License-Identifier: Apache-2.0
"""A disk without room: whoever asks is told, the daemon lives, and goes on when there is room again."""

import resource

import grpc

import scripted
import strike
from carillon.v1 import audio_service_pb2, modal_model_service_pb2
from daemon import DaemonTest


class FullDiskTest(DaemonTest):
    def leave_room(self, byte_count):
        """No file of the daemon may grow beyond so many bytes; its children inherit it."""
        resource.prlimit(self.daemon.process.pid, resource.RLIMIT_FSIZE, (byte_count, resource.RLIM_INFINITY))

    def import_model(self, number):
        records = scripted.read_records(scripted.make_model(self.folder))
        self.client.models.ImportModalModel(
            modal_model_service_pb2.ImportModalModelRequest(
                record=record, name=f"modalModels/{number:064x}") for record in records)

    def tearDown(self):
        self.leave_room(resource.RLIM_INFINITY)

    def test_an_import_without_room_is_refused_and_succeeds_later(self):
        self.leave_room(100_000)
        with self.assertRaises(grpc.RpcError) as refused:
            self.import_model(1)
        self.assertRegex(refused.exception.details(), "^DATABASE_(FULL|IO_ERROR): ")
        self.client.audio.GetMixer(audio_service_pb2.GetMixerRequest())
        self.leave_room(resource.RLIM_INFINITY)
        self.import_model(1)

    def test_a_body_asked_for_without_room_is_refused_and_made_when_asked_again(self):
        self.leave_room(200_000)
        with self.assertRaises((strike.Refused, grpc.RpcError)):
            self.client.model()
        self.leave_room(resource.RLIM_INFINITY)
        self.client.model()
