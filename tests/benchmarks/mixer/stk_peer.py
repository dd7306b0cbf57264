# SPDX-License-Identifier: Apache-2.0
"""STK's resonant filters, as its class Modal uses them; they compute in double."""

import measuring


def throughput(program, population):
    text = "".join(f"{f:.17g} {t60:.17g} {a:.17g}\n" for f, t60, a in population)

    run = lambda seconds: measuring.cpu_seconds([program, len(population), seconds], input=text.encode())
    return len(population) * measuring.rate(run, 1, 4)
