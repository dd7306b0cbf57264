#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Each alert fires in the state that it is for, and only then."""

import pathlib
import re
import unittest

import alert_rules

ROOT = pathlib.Path(__file__).resolve().parents[2]
RULES = ROOT / "deploy/prometheus/alerts.yml"
METRICS = ROOT / "server/daemon/daemon_metrics.cc"
DAY = 86400
GIB = 2.0**30

# Counters, whose names end in _total, are stated by their rise a second.
GOOD = {
    'up{job="carillon"}': 1,
    'carillon_device_playing': 1,
    'carillon_frames_lost_total': 0,
    'carillon_frames_rendered_total': 48000,
    'carillon_render_load_ratio': 0.3,
    'carillon_impulses_total{outcome="in_time"}': 1000,
    'carillon_impulses_total{outcome="late"}': 5,
    'carillon_impulses_total{outcome="merged"}': 10,
    'carillon_impulses_total{outcome="shed"}': 0,
    'carillon_impulses_total{outcome="dropped"}': 0,
    'carillon_impulses_rejected_total{reason="IMPULSE_TOO_LARGE"}': 0,
    'carillon_jobs_ended_total{state="succeeded"}': 0.1,
    'carillon_jobs_ended_total{state="failed"}': 0,
    'carillon_jobs_ended_total{state="cancelled"}': 0.1,
    'carillon_database_serving': 1,
    'carillon_decompositions_serving': 1,
    'carillon_disk_free_bytes': 50 * GIB,
    'carillon_models_quarantined': 0,
    'carillon_tls_certificate_left_seconds': 40 * DAY,
    'carillon_scenes': 10,
}
BAD = {
    "CarillonDown": {'up{job="carillon"}': 0},
    "CarillonDeviceSilent": {'carillon_device_playing': 0},
    "CarillonFramesLost": {'carillon_frames_lost_total': 48},
    "CarillonOverloaded": {'carillon_render_load_ratio': 0.9},
    "CarillonImpulsesShed": {'carillon_impulses_total{outcome="shed"}': 1},
    "CarillonImpulsesLate": {'carillon_impulses_total{outcome="late"}': 50},
    "CarillonImpulsesRejected": {'carillon_impulses_rejected_total{reason="IMPULSE_TOO_LARGE"}': 1},
    "CarillonJobsFail": {'carillon_jobs_ended_total{state="failed"}': 0.01},
    "CarillonDatabaseLost": {'carillon_database_serving': 0, 'carillon_decompositions_serving': 0},
    "CarillonDecompositionsStopped": {'carillon_decompositions_serving': 0},
    "CarillonDiskFull": {'carillon_disk_free_bytes': 0.5 * GIB},
    "CarillonModelsDamaged": {'carillon_models_quarantined': 1},
    "CarillonCertificateExpires": {'carillon_tls_certificate_left_seconds': 29 * DAY},
    "CarillonScenesFull": {'carillon_scenes': 500},
}


def firing(changed):
    """The alerts that fire where these values differ from those of a daemon that is well."""
    values = alert_rules.values_of(GOOD | changed)
    return {alert for alert, expression in alert_rules.rules(RULES).items() if alert_rules.fires(expression, values)}


class RulesTest(unittest.TestCase):
    def test_no_alert_fires_while_all_is_well(self):
        self.assertEqual(firing({}), set())

    def test_each_alert_fires_in_its_state_and_no_other_does(self):
        self.assertEqual(alert_rules.rules(RULES).keys(), BAD.keys())
        for alert, changed in BAD.items():
            with self.subTest(alert=alert):
                self.assertEqual(firing(changed), {alert})

    def test_dropped_impulses_alert_like_shed_ones(self):
        self.assertEqual(firing({'carillon_impulses_total{outcome="dropped"}': 1}), {"CarillonImpulsesShed"})

    def test_one_lost_block_in_two_minutes_alerts_nobody(self):
        self.assertEqual(firing({'carillon_frames_lost_total': 128 / 120}), set())

    def test_the_daemon_has_the_labels_of_the_states_above(self):
        daemon = METRICS.read_text()
        for label, value in re.findall(r'carillon_\w+\{(\w+)="([a-z_]+)"', " ".join(GOOD)):
            self.assertIn(f'.label_name = "{label}"', daemon)
            self.assertIn(f'Of("{value}"', daemon)


class EvaluationTest(unittest.TestCase):
    def setUp(self):
        self.values = alert_rules.values_of({'a': 3, 'b{k="x"}': 2, 'b{k="y"}': 5, 'c{k="x"}': 7, 'd_total': 0.5})

    def fires(self, expression):
        return alert_rules.fires(expression, self.values)

    def test_sides_with_different_labels_are_never_compared(self):
        self.assertFalse(self.fires('b{k="y"} > a'))
        self.assertTrue(self.fires('b{k="y"} > ignoring(k) a'))
        self.assertTrue(self.fires('b{k="y"} > on() a'))
        self.assertFalse(self.fires('b{k="y"} > c'))
        self.assertTrue(self.fires('b < c'))

    def test_operators_bind_as_in_prometheus(self):
        self.assertTrue(self.fires("a == 1 + 2"))
        self.assertTrue(self.fires("a * 2 + 1 == 7"))
        self.assertTrue(self.fires("2 < a"))
        self.assertTrue(self.fires('c and b{k="x"} == 2'))
        self.assertFalse(self.fires('c unless b{k="x"} == 2'))
        self.assertTrue(self.fires("b > 9 or a"))

    def test_a_counter_is_compared_by_its_rise(self):
        self.assertTrue(self.fires("increase(d_total[1m]) == 30"))
        self.assertTrue(self.fires("rate(d_total[5m]) == 0.5"))
        for wrong in ("d_total > 0", "rate(a[5m]) > 0"):
            with self.assertRaises(ValueError):
                self.fires(wrong)

    def test_what_is_not_understood_is_an_error(self):
        for wrong in ("sum(a) > 1", "a >", "a > 1 1", "1 + 1", "a % 2", "b > ignoring(k) a"):
            with self.assertRaises(ValueError):
                self.fires(wrong)


if __name__ == "__main__":
    unittest.main()
