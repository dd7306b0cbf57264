# SPDX-License-Identifier: Apache-2.0
"""Faust's bank of modes, pm.modalModel, compiled by g++ for this very processor. The compiler takes minutes for many
modes, and small banks are Faust's fastest."""

import subprocess

import measuring

ARCHITECTURE = """
#include <cstdio>
#include <cstdlib>
#include <vector>
#include <faust/dsp/dsp.h>
#include <faust/gui/UI.h>
#include <faust/gui/meta.h>
<<includeIntrinsic>>
<<includeclass>>
int main(int, char** values) {
  const int bank_count = std::atoi(values[1]);
  const long frame_count = std::atol(values[2]);
  std::vector<mydsp> banks(bank_count);
  for (auto& bank : banks) bank.init(48000);
  std::vector<FAUSTFLOAT> block(128);
  FAUSTFLOAT* outputs[] = {block.data()};
  std::FILE* file = values[3] != nullptr ? std::fopen(values[3], "wb") : nullptr;
  for (long n = 0; n < frame_count; n += 128) {
    for (auto& bank : banks) {
      bank.compute(128, nullptr, outputs);
      if (file == nullptr) continue;
      for (const FAUSTFLOAT x : block) {
        const double sample = x;
        std::fwrite(&sample, sizeof sample, 1, file);
      }
    }
  }
  if (file != nullptr) std::fclose(file);
}
"""


def _list(values):
    return "(" + ",".join(f"{value:.17g}" for value in values) + ")"


def build(folder, population, options):
    """The program that renders banks of these modes."""
    name = "faust" + "".join(options)
    frequencies, decays, gains = zip(*population)
    (folder / "modes.dsp").write_text(
        'import("stdfaust.lib");\nimpulse = 1 - 1\';\n'
        f"f(i) = ba.take(i + 1, {_list(frequencies)});\nt(i) = ba.take(i + 1, {_list(decays)});\n"
        f"g(i) = ba.take(i + 1, {_list(gains)});\n"
        f"process = impulse <: par(i, {len(population)}, pm.modeFilter(f(i), t(i), g(i))) :> _;\n",
        encoding="ascii")
    (folder / "architecture.cpp").write_text(ARCHITECTURE, encoding="ascii")
    subprocess.run(["faust", *options, "-a", "architecture.cpp", "-o", name + ".cpp", "modes.dsp"], cwd=folder,
                   check=True)
    subprocess.run(["g++", "-O3", "-march=native", "-ffast-math", "-w", "-o", name, name + ".cpp"], cwd=folder,
                   check=True)
    return folder / name


def throughput(folder, population, options=("-vec", "-vs", "32"), bank_count=8):
    program = build(folder, population, list(options))
    run = lambda seconds: measuring.cpu_seconds([program, bank_count, int(seconds * 48000)])
    return len(population) * bank_count * measuring.rate(run, 1, 11)


def sound(folder, population, options, frame_count):
    import numpy
    program = build(folder, population, list(options))
    path = folder / "faust.raw"
    measuring.cpu_seconds([program, 1, frame_count, path])
    return numpy.fromfile(path, dtype=float)[:frame_count]
