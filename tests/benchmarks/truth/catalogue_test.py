# SPDX-License-Identifier: Apache-2.0
"""The catalogue as Python reads it, and the page that is printed from it."""

import math
import unittest

import catalogue
import materials


class CatalogueTest(unittest.TestCase):
    def test_a_constant_loss_factor_gives_decays_in_proportion_to_frequency(self):
        porcelain = catalogue.read()["porcelain"]
        self.assertAlmostEqual(porcelain.decay_per_s(1000), 4.3e-4 * math.pi * 1000)
        self.assertAlmostEqual(porcelain.decay_per_s(8000), 8 * porcelain.decay_per_s(1000))

    def test_a_table_is_straight_in_the_logarithms(self):
        acrylic = catalogue.read()["acrylic"]
        self.assertAlmostEqual(acrylic.loss_factor_at(1000), math.sqrt(0.04 * 0.02))
        self.assertEqual(acrylic.loss_factor_at(20), 0.04)
        self.assertEqual(acrylic.loss_factor_at(20000), 0.02)

    def test_the_papers_materials_keep_their_rayleigh_damping(self):
        bowl = catalogue.read()["bowl_metal"]
        omega = 2 * math.pi * 500
        self.assertAlmostEqual(bowl.decay_per_s(500), (1e-7 * omega**2 + 30) / 2)

    def test_the_page_has_the_tables_of_today(self):
        text = materials.PAGE.read_text()
        self.assertEqual(text, materials.page_with_tables(text), "run tests/benchmarks/truth/materials.py --write")
