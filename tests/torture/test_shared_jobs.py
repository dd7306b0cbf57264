# SPDX-License-Identifier: Apache-2.0
"""A client that cancels the jobs of others."""

import hashlib
import os
import pathlib
import tempfile
import unittest
from unittest import mock

import grpc
import meshes
import scripted
import strike
import torture
from carillon.v1 import decomposition_pb2, decomposition_service_pb2, material_pb2, modal_model_service_pb2
from daemon import Daemon

ROLES = {"alice": "submit", "bob": "submit", "mallory": "submit", "boss": "submit,administer"}
UNFINISHED = (decomposition_pb2.JOB_STATE_QUEUED, decomposition_pb2.JOB_STATE_RUNNING)


def token_of(name):
    return f"{name}: a token for this test"


class SharedJobsTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        access = self.folder / "access"
        access.touch(0o600)
        access.write_text("".join(f"{name} {roles} sha256:{hashlib.sha256(token_of(name).encode()).hexdigest()}\n"
                                  for name, roles in ROLES.items()))
        # The worker waits until it is ended.
        self.daemon = Daemon(self.folder, "--listen", "127.0.0.1:0", "--access-file", access,
                             "--precompute", scripted.worker(self.folder, "exec sleep 1000"))
        self.addCleanup(self.daemon.kill)
        self.address = self.daemon.listening[-1].split()[-1]
        self.clients = {name: self.client(name) for name in ROLES}

    def client(self, name):
        with mock.patch.dict(os.environ, CARILLON_TOKEN=token_of(name)):
            return strike.Client(self.address)

    def submit(self, name):
        return self.clients[name].create(
            meshes.bar(), "obj", material=material_pb2.Material(preset=meshes.MATERIAL)).name

    def cancel(self, client, job):
        """Returns the reason of a refusal, or nothing."""
        try:
            client.jobs.CancelJob(decomposition_service_pb2.CancelJobRequest(name=job))
        except grpc.RpcError as error:
            return strike.refusal(error).info.reason
        return ""

    def goes_on(self, job):
        answer = self.clients["alice"].jobs.GetJob(decomposition_service_pb2.GetJobRequest(name=job))
        return answer.job.state in UNFINISHED

    def test_a_job_ends_when_all_that_asked_for_it_have_cancelled_it(self):
        job = self.submit("alice")
        self.assertEqual(self.cancel(self.clients["mallory"], job), "JOB_OF_ANOTHER")
        self.submit("mallory")
        self.submit("bob")
        for name in ("mallory", "mallory", "bob"):
            self.assertEqual(self.cancel(self.clients[name], job), "")
            self.assertTrue(self.goes_on(job), name)
        self.assertEqual(self.cancel(self.client("alice"), job), "", "over a connection of its own")
        torture.wait_until(lambda: not self.goes_on(job), 30)

    def test_who_may_administer_cancels_for_all(self):
        for canceller in (self.clients["boss"], self.daemon.client()):
            job = self.submit("alice")
            self.submit("bob")
            self.assertEqual(self.cancel(canceller, job), "")
            torture.wait_until(lambda: not self.goes_on(job), 30)
        self.submit("alice")
        self.assertEqual(self.daemon.command("job", "cancel", job.split("/")[1]).returncode, 0)
        torture.wait_until(lambda: not self.goes_on(job), 30)

    def test_a_pinned_model_is_changed_by_administrators_only(self):
        model = scripted.make_model(self.folder)
        name = self.daemon.command("model", "import", model, "--label", "bell").stdout.strip()
        update = modal_model_service_pb2.UpdateModalModelRequest
        alice = self.clients["alice"].models
        alice.UpdateModalModel(update(name=name, label="chime"))
        self.clients["boss"].models.UpdateModalModel(update(name=name, pinned=True))
        for change in ({"pinned": False}, {"label": "mine"}, {"add_tags": ["mine"]},
                       {"material": material_pb2.Material(preset="glass")}):
            with self.assertRaises(grpc.RpcError) as refused:
                alice.UpdateModalModel(update(name=name, **change))
            self.assertEqual(strike.refusal(refused.exception).info.reason, "ROLE_MISSING", change)
        boss = self.clients["boss"].models
        self.assertEqual(boss.UpdateModalModel(update(name=name, pinned=False)).modal_model.label, "chime")
        alice.UpdateModalModel(update(name=name, label="mine"))

    def restart(self):
        self.daemon.kill()
        self.daemon.start()
        self.address = self.daemon.listening[-1].split()[-1]
        self.clients = {name: self.client(name) for name in ROLES}

    def test_a_restart_gives_no_job_to_others(self):
        job = self.submit("alice")
        self.submit("bob")
        self.submit("mallory")
        self.assertEqual(self.cancel(self.clients["bob"], job), "")
        self.restart()
        self.assertTrue(self.goes_on(job))
        self.assertEqual(self.cancel(self.clients["bob"], job), "JOB_OF_ANOTHER")
        self.assertEqual(self.cancel(self.clients["mallory"], job), "")
        self.restart()
        self.assertEqual(self.cancel(self.clients["mallory"], job), "JOB_OF_ANOTHER")
        self.submit("mallory")
        self.assertEqual(self.cancel(self.clients["mallory"], job), "")
        self.assertTrue(self.goes_on(job))
        self.assertEqual(self.cancel(self.clients["alice"], job), "")
        torture.wait_until(lambda: not self.goes_on(job), 30)


if __name__ == "__main__":
    unittest.main()
