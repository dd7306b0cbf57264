# SPDX-License-Identifier: Apache-2.0
"""Csound's opcode `mode`, which computes in double; modes above a third of the sample rate, where it is unstable, are
left out."""

import math

import measuring

HIGHEST_HZ = 48000 / math.pi - 100


def render(folder, population, instance_count, seconds):
    modes = "\n".join(
        f"a1 mode ain, {f:.9g}, {math.pi * f * t60 / math.log(1000):.9g}\nasum = asum + {a:.9g} * a1"
        for f, t60, a in population if f < HIGHEST_HZ)
    notes = f"i 1 0 {seconds}\n" * instance_count
    path = folder / "modes.csd"
    path.write_text(
        "<CsoundSynthesizer>\n<CsOptions>\n-n -d -m0\n</CsOptions>\n<CsInstruments>\nsr = 48000\nksmps = 128\n"
        f"nchnls = 1\n0dbfs = 1\ninstr 1\nain mpulse 1, 0\nasum = 0\n{modes}\nout asum\nendin\n</CsInstruments>\n"
        f"<CsScore>\n{notes}</CsScore>\n</CsoundSynthesizer>\n", encoding="ascii")
    return measuring.cpu_seconds(["csound", path])


def throughput(folder, population, instance_count=2):
    count = sum(f < HIGHEST_HZ for f, _, _ in population)
    run = lambda seconds: render(folder, population, instance_count, seconds)
    return count * instance_count * measuring.rate(run, 1, 4)
