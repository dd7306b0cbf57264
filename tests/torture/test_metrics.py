# SPDX-License-Identifier: Apache-2.0
"""The metrics that Prometheus reads are those of the clients that are there."""

import sound
import torture
from carillon.v1 import contact_pb2, contact_service_pb2
from daemon import free_port, wait_until


class MetricsTest(torture.ServedTest):
    def test_metrics_count_what_clients_do(self):
        self.serve("--metrics", f"127.0.0.1:{free_port()}")
        before = self.daemon.metrics()
        self.assertEqual(before["carillon_scenes"], "0")
        self.assertEqual(before["carillon_device_playing"], "1")
        scene = torture.SoundingScene(self.daemon)
        try:
            wait_until(lambda: float(self.daemon.metrics()['carillon_impulses_total{outcome="in_time"}']) > 0)
            wait_until(lambda: float(self.daemon.metrics()['carillon_modes{state="sounding"}']) > 0)
            during = self.daemon.metrics()
        finally:
            scene.stop()
        self.assertEqual(during["carillon_scenes"], "1")
        self.assertEqual(during['carillon_calls{kind="contact_stream"}'], "1")
        self.assertEqual(during['carillon_calls{kind="listener"}'], "1")
        self.assertGreater(float(during["carillon_connections"]), 0)
        self.assertGreater(float(during["carillon_database_bytes"]), 0)
        self.assertGreater(float(during['carillon_jobs_ended_total{state="succeeded"}']), 0)
        bad = sound.impulse((0, 0, 0), (1, 0, 0), handle=99)
        list(self.client.contacts.StreamContacts(iter([
            contact_service_pb2.StreamContactsRequest(
                start=contact_service_pb2.ContactStreamStart(scene=scene.scene, step_s=0.01)),
            contact_service_pb2.StreamContactsRequest(steps=[contact_pb2.ContactStep(contacts=[bad])])])))
        self.assertEqual(self.daemon.metrics()['carillon_impulses_rejected_total{reason="OBJECT_NOT_FOUND"}'], "1")
