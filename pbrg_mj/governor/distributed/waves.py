"""Scattering waves on the links of `network_rounds`, compiled: what robots put on a link and make of what comes.

Arguments are those of `network_rounds`: `LinkArrays`, `LinkParameters`, `Events`.
"""

from __future__ import annotations

import numpy as np

from pbrg_mj.kernel import kernel


@kernel
def put_sums(links, parameters, now):
    """Put the sum of all waves sent so far, and how many they are, on every link.

    Arguments: `LinkArrays`, `LinkParameters`, `Events`; sums are (2, E, 4n + 2), counts (E,).
    """
    flight, sent = links.flight, links.sent
    slot = now.now % flight.shape[2]
    for e in range(len(parameters.reverse)):
        flight[0, e, slot] = sent[0, e]
        flight[1, e, slot] = sent[1, e]
        links.flight_waves[e, slot] = links.sent_waves[e]


@kernel
def exchange_waves(old, seen, links, parameters, moves):
    """Use a wave and send one at the end of every link of the robots that move; write what their updates see.

    `old` are `Estimates`, `seen` (z, zeta, link by link) are `ReceivedStates`, `links` `LinkArrays`, `parameters`
    `LinkParameters`, `moves` (n,) bool.
    """
    sent, unused, up = links.sent, links.unused, links.up
    first, reverse, eta = parameters.first, parameters.reverse, parameters.impedance
    root, det = np.sqrt(2.0 * eta), eta * eta + 2.0 * eta + 4.0  # det of eta I + 2 M
    for i in range(len(moves)):
        for e in range(first[i], first[i + 1] if moves[i] else first[i]):
            out = reverse[e]
            z, zeta = old.z[i], old.zeta[i]
            copies = 1 + parameters.reserve if links.sent_waves[out] == 0 else 1
            links.sent_waves[out] += copies
            if not up[e]:  # no line yet: r_i = y_i, no flow
                for c in range(len(z)):
                    sent[0, out, c] += copies * (np.sqrt(0.5 * eta) * z[c])
                    sent[1, out, c] += copies * (np.sqrt(0.5 * eta) * zeta[c])
                continue
            count = links.unused_waves[e]
            links.unused_waves[e] = count - 1
            for c in range(len(z)):
                b, b_zeta = unused[0, e, c] / count, unused[1, e, c] / count
                unused[0, e, c] -= b
                unused[1, e, c] -= b_zeta
                x = root * b + 2.0 * (z[c] - zeta[c])
                y = root * b_zeta + 2.0 * z[c]
                r = (eta * x + 2.0 * y) / det
                r_zeta = ((eta + 2.0) * y - 2.0 * x) / det
                seen[0, e, c] = 2.0 * r - z[c]
                seen[1, e, c] = 2.0 * r_zeta - zeta[c]
                sent[0, out, c] += copies * (root * r - b)
                sent[1, out, c] += copies * (root * r_zeta - b_zeta)
