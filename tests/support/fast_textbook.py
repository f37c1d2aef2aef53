"""The textbook's tube for many states at once, with Gauss's quadrature in NumPy: shares nothing with the package.

Slow and careful is freelearn.testing.reference.textbook, against which this is tested.
"""

from __future__ import annotations

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
BALLOON = 2.5


class Tube:
    """One tube with neo-Hookean wall and standard fibers. gamma [rad], L, Ri, Ro [m], C1, C2 [Pa]."""

    def __init__(self, gamma, L, Ri, Ro, C1, C2):
        self.gamma, self.L, self.Ri, self.Ro, self.C1, self.C2 = gamma, L, Ri, Ro, C1, C2

    def _wall(self, length, twist, ri):
        """Radii (n, k), their weights, and the four stresses' differences there."""
        stretch, turn = (length / self.L)[:, None], (twist / self.L)[:, None]
        inner = ri[:, None]
        outer = np.sqrt(inner**2 + (self.Ro**2 - self.Ri**2) / stretch)
        half = (outer - inner) / 2
        r = inner + half * (1 + NODES)
        R = np.sqrt(self.Ri**2 + stretch * (r**2 - inner**2))
        hoop = r / R
        across = hoop * np.sin(self.gamma) + r * turn * np.cos(self.gamma)
        along = stretch * np.cos(self.gamma)
        pull = 2 * self.C2 * (across**2 + along**2 - 1)
        radial = self.C1 * (R / (r * stretch)) ** 2
        ring = self.C1 * (hoop**2 + (r * turn) ** 2) + pull * across**2 - radial
        axial = self.C1 * stretch**2 + pull * along**2 - radial
        shear = self.C1 * r * turn * stretch + pull * across * along
        return r, half * WEIGHTS, ring, axial, shear

    def held(self, length, twist, ri):
        """The pressure that the wall balances."""
        r, w, ring, _, _ = self._wall(length, twist, ri)
        return (w * ring / r).sum(1)

    def radius(self, length, twist, pressure):
        """Inner radii that carry the pressures, NaN where none does."""
        low, high = np.full(len(length), 0.02 * self.Ri), np.full(len(length), BALLOON * self.Ri)
        lost = self.held(length, twist, high) < pressure
        for _ in range(44):
            middle = (low + high) / 2
            above = self.held(length, twist, middle) > pressure
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        return np.where(lost, np.nan, (low + high) / 2)

    def loads(self, length, twist, pressure):
        """Force and moment (n, 2) of states (n,)."""
        length, twist, pressure = np.broadcast_arrays(*map(np.atleast_1d, (length, twist, pressure)))
        ri = self.radius(length, twist, pressure)
        r, w, ring, axial, shear = self._wall(length, twist, ri)
        force = -2 * np.pi * (w * (axial - ring / 2) * r).sum(1)
        return np.stack([force, -2 * np.pi * (w * shear * r**2).sum(1)], axis=-1)

    def slopes(self, length, twist, pressure):
        """∂(F, M)/∂(l, φ) by central differences, (n, 2, 2)."""
        length, twist = np.broadcast_arrays(*map(np.atleast_1d, (length, twist)))
        by = []
        for dl, dt in ((1e-7, 0.0), (0.0, 1e-6)):
            more, less = self.loads(length + dl, twist + dt, pressure), self.loads(length - dl, twist - dt, pressure)
            by.append((more - less) / (2 * max(dl, dt)))
        return np.stack(by, axis=-1)

    def places(self, loads, pressure, low, high, grid=(9, 21)):
        """Every place (length, twist) in a box that carries the loads, (c, 2): Newton's method from everywhere."""
        width = high - low
        shares = np.stack(np.meshgrid(*(np.linspace(0, 1, n) for n in grid), indexing="ij"), -1).reshape(-1, 2)
        x, live, settled = low + shares * width, np.ones(len(shares), bool), np.zeros(len(shares), bool)
        for _ in range(30):
            at = np.flatnonzero(live)
            if not len(at):
                break
            miss = self.loads(*x[at].T, pressure) - loads
            rate = self.slopes(*x[at].T, pressure) * width
            fine = np.isfinite(rate).all((1, 2)) & np.isfinite(miss).all(1)
            det = rate[:, 0, 0] * rate[:, 1, 1] - rate[:, 0, 1] * rate[:, 1, 0]
            step = np.stack(
                [rate[:, 0, 1] * miss[:, 1] - rate[:, 1, 1] * miss[:, 0],
                 rate[:, 1, 0] * miss[:, 0] - rate[:, 0, 0] * miss[:, 1]], -1,
            ) / np.where(fine & (det != 0), det, np.nan)[:, None]  # fmt: skip
            size = np.abs(step).max(1)
            step = step * np.minimum(0.1 / size, 1.0)[:, None]
            x[at] += np.nan_to_num(step) * width
            share = (x[at] - low) / width
            settled[at] = size < 1e-7
            live[at] = (size >= 1e-7) & (np.abs(share - 0.5) < 1.0).all(1)
        found = x[settled]
        share = (found - low) / width
        found, share = (part[((share > 0) & (share < 1)).all(1)] for part in (found, share))
        kept = []
        for i in range(len(found)):
            if all(np.abs(share[i] - share[j]).max() > 1e-5 for j in kept):
                kept.append(i)
        return found[kept]
