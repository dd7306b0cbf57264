# SPDX-License-Identifier: Apache-2.0
"""STK's resonant filters, as its class Modal uses them; they compute in double."""

import subprocess

import measuring


def throughput(program, population):
    text = "".join(f"{f:.17g} {t60:.17g} {a:.17g}\n" for f, t60, a in population)

    def run(seconds):
        before = measuring.os.times()
        subprocess.run([program, str(len(population)), str(seconds)], input=text.encode(), check=True,
                       stdout=subprocess.DEVNULL)
        return measuring.os.times().children_user - before.children_user

    return len(population) * measuring.rate(run, 1, 4)
