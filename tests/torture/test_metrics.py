# SPDX-License-Identifier: Apache-2.0
"""The metrics that Prometheus reads are those of the clients that are there."""

import re
import unittest
import urllib.request

import torture
from carillon.v1 import contact_pb2, contact_service_pb2


class MetricsTest(torture.ServedTest):
    def test_metrics_count_what_clients_do(self):
        self.serve("--metrics", f"127.0.0.1:{torture.free_port()}")
        address = self.daemon.arguments[-1]

        def read():
            with urllib.request.urlopen(f"http://{address}/metrics", timeout=10) as answer:
                text = answer.read().decode()
            return dict(re.findall(r"^([a-z_]+(?:\{[^}]*\})?) (\S+)$", text, re.MULTILINE))
        before = read()
        self.assertEqual(before["carillon_scenes"], "0")
        self.assertEqual(before["carillon_device_playing"], "1")
        scene = torture.SoundingScene(self.daemon)
        try:
            torture.wait_until(lambda: float(read()['carillon_impulses_total{outcome="in_time"}']) > 0, 30)
            torture.wait_until(lambda: float(read()['carillon_modes{state="sounding"}']) > 0, 30)
            during = read()
        finally:
            scene.stop()
        self.assertEqual(during["carillon_scenes"], "1")
        self.assertEqual(during['carillon_calls{kind="contact_stream"}'], "1")
        self.assertEqual(during['carillon_calls{kind="listener"}'], "1")
        self.assertGreater(float(during["carillon_connections"]), 0)
        self.assertGreater(float(during["carillon_database_bytes"]), 0)
        self.assertGreater(float(during['carillon_jobs_ended_total{state="succeeded"}']), 0)
        bad = contact_pb2.Contact(kind=contact_pb2.CONTACT_KIND_IMPACT, object=99, point_m=contact_pb2.Vec3(),
                                  impulse_newton_seconds=contact_pb2.Vec3(x=1))
        list(self.client.contacts.StreamContacts(iter([
            contact_service_pb2.StreamContactsRequest(
                start=contact_service_pb2.ContactStreamStart(scene=scene.scene, step_s=0.01)),
            contact_service_pb2.StreamContactsRequest(steps=[contact_pb2.ContactStep(contacts=[bad])])])))
        self.assertEqual(read()['carillon_impulses_rejected_total{reason="OBJECT_NOT_FOUND"}'], "1")


if __name__ == "__main__":
    unittest.main()
