#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What operators install: the unit is hardened, and alerts and dashboard use metrics that the daemon has."""

import json
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
UNIT = ROOT / "deploy/systemd/carillond.service"
METRIC = re.compile(r"\b(?:carillon|process)_[a-z_]+\b")
MOST_EXPOSURE = 2.0


def metrics_of_daemon():
    text = (ROOT / "server/daemon/daemon_metrics.cc").read_text()
    return set(re.findall(r'"((?:carillon|process)_[a-z_]+)"', text))


class UnitTest(unittest.TestCase):
    def test_the_unit_is_exposed_below_two(self):
        printed = subprocess.run(["systemd-analyze", "security", "--offline=true", "--no-pager", UNIT],
                                 capture_output=True, text=True, check=True).stdout
        exposure = float(re.search(r"Overall exposure level for \S+: ([\d.]+)", printed)[1])
        self.assertLess(exposure, MOST_EXPOSURE)

    def test_systemd_understands_every_line_of_the_unit(self):
        printed = subprocess.run(["systemd-analyze", "verify", UNIT], capture_output=True, text=True,
                                 check=False).stderr
        complaints = [line for line in printed.splitlines()
                      if "carillond.service" in line and "is not executable" not in line]
        self.assertEqual(complaints, [])

    def test_the_watchdog_is_fed_by_a_unit_of_the_right_type(self):
        lines = UNIT.read_text().splitlines()
        self.assertIn("Type=notify", lines)
        self.assertTrue(any(line.startswith("WatchdogSec=") for line in lines))


class MetricsTest(unittest.TestCase):
    def test_alerts_and_dashboard_name_metrics_of_the_daemon(self):
        alerts = (ROOT / "deploy/prometheus/alerts.yml").read_text()
        expressions = " ".join(line for line in alerts.splitlines() if "summary" not in line)
        dashboard = json.loads((ROOT / "deploy/prometheus/grafana_dashboard.json").read_text())
        for panel in dashboard["panels"]:
            for target in panel["targets"]:
                expressions += " " + target["expr"]
        named = set(METRIC.findall(expressions))
        self.assertGreater(len(named), 15)
        self.assertEqual(named - metrics_of_daemon(), set())
        daemon = (ROOT / "server/daemon/daemon_metrics.cc").read_text()
        for label, values in re.findall(r'(\w+)=~?"([a-z_|]+)"', expressions):
            if label != "job":  # Prometheus adds that
                self.assertIn(f'.label_name = "{label}"', daemon)
                for value in values.split("|"):
                    self.assertIn(f'Of("{value}"', daemon)

    def test_the_page_for_operators_names_metrics_of_the_daemon(self):
        named = set(METRIC.findall((ROOT / "docs/run.md").read_text()))
        self.assertGreater(len(named), 5)
        self.assertEqual(named - metrics_of_daemon(), set())


if __name__ == "__main__":
    unittest.main()
