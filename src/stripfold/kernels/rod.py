"""Element integrals of the rod, for :mod:`stripfold.kernels.elements`."""

from __future__ import annotations

import numpy as np

from stripfold.kernels.compiler import compiled


@compiled()
def slopes(el, e, q, d):
    """Derivatives of the displacement, x and z, at the points of an element: ``d``, shape (7, 2)."""
    shape, first, scale = el.shape[0, 0], el.unknowns[e, 0], 1.0 / el.size[e]
    for p in range(7):
        x = z = 0.0
        for a in range(0, 4, 2):
            x += shape[p, a] * (q[first + 2 * a] * scale) + shape[p, a + 1] * q[first + 2 * a + 2]
            z += shape[p, a] * (q[first + 2 * a + 1] * scale) + shape[p, a + 1] * q[first + 2 * a + 3]
        d[p, 0] = x
        d[p, 1] = z


@compiled()
def stiffness(el, e, p):
    """Stiffness of a strain times its weight in the integral over the element."""
    return el.size[e] * el.stiffness[0, p] + el.stiffness[1, p] / el.size[e]


@compiled()
def strain_of(d, strain):
    for p in range(3):
        strain[p] = d[p, 0] + 0.5 * (d[p, 0] * d[p, 0] + d[p, 1] * d[p, 1])
    for p in range(3, 5):
        strain[p] = d[p + 2, 1] + d[p, 0] * d[p + 2, 1] - d[p, 1] * d[p + 2, 0]
        strain[p + 2] = d[p + 2, 0]
        strain[p + 4] = d[p + 2, 1]


@compiled()
def assemble(el, q0, q1, kappa, in_state, predicted, force, band, top, growth, columns):
    shape = el.shape[0, 0]
    d0, d1, e0, e1 = np.empty((7, 2)), np.empty((7, 2)), np.empty(9), np.empty(9)
    local, left, right, grown = np.empty(8), np.empty(8), np.empty(8), np.empty(8)
    k = np.empty((8, 8))
    elastic, stress, geometric, modulus = np.empty(9), np.empty(9), np.empty(9), np.empty(9)
    scale = np.ones(8)
    with_tangent, with_predicted, with_growth = len(band) > 0, len(predicted) > 0, len(growth) > 0
    half = 1.0 if in_state else 0.5
    for e in range(len(el.unknowns)):
        for a in (0, 1, 4, 5):
            scale[a] = 1.0 / el.size[e]
        slopes(el, e, q0, d0)
        slopes(el, e, q1, d1)
        strain_of(d0, e0)
        strain_of(d1, e1)
        for p in range(9):
            d = stiffness(el, e, p)
            share = 1.0 if in_state else 0.5 + kappa * el.viscous[p]
            elastic[p] = d * ((1.0 - share) * e0[p] + share * e1[p])
            stress[p] = elastic[p] + el.rest[p]
            end = predicted[e, p] if with_predicted else d * e1[p]
            geometric[p] = half * ((1.0 - share) * d * e0[p] + share * end + el.rest[p])
            modulus[p] = share * d
        for a in range(8):
            local[a] = grown[a] = 0.0
            for b in range(8):
                k[a, b] = 0.0
        for p in range(3):
            f, c, g = shape[p], modulus[p], geometric[p]
            lx, lz = 1.0 + 0.5 * (d0[p, 0] + d1[p, 0]), 0.5 * (d0[p, 1] + d1[p, 1])
            rx, rz = 1.0 + d1[p, 0], d1[p, 1]
            for a in range(4):
                local[2 * a] += stress[p] * lx * f[a]
                local[2 * a + 1] += stress[p] * lz * f[a]
            if with_growth:
                # Stiffness proportional to the length; for displacements the scale takes that away.
                for a in range(1, 4, 2):
                    grown[2 * a] += g * lx * f[a]
                    grown[2 * a + 1] += g * lz * f[a]
            if with_tangent:
                kxx, kxz, kzx, kzz = c * lx * rx + g, c * lx * rz, c * lz * rx, c * lz * rz + g
                for a in range(4):
                    for b in range(4):
                        ff = f[a] * f[b]
                        k[2 * a, 2 * b] += kxx * ff
                        k[2 * a, 2 * b + 1] += kxz * ff
                        k[2 * a + 1, 2 * b] += kzx * ff
                        k[2 * a + 1, 2 * b + 1] += kzz * ff
        for p in range(3, 5):
            f, s, c, g = shape[p], shape[p + 2], modulus[p], geometric[p]
            lx, lz = 1.0 + 0.5 * (d0[p, 0] + d1[p, 0]), 0.5 * (d0[p, 1] + d1[p, 1])
            lxx, lzz = 0.5 * (d0[p + 2, 0] + d1[p + 2, 0]), 0.5 * (d0[p + 2, 1] + d1[p + 2, 1])
            rx, rz, rxx, rzz = 1.0 + d1[p, 0], d1[p, 1], d1[p + 2, 0], d1[p + 2, 1]
            for a in range(4):
                left[2 * a], left[2 * a + 1] = f[a] * lzz - s[a] * lz, s[a] * lx - f[a] * lxx
                right[2 * a], right[2 * a + 1] = c * (f[a] * rzz - s[a] * rz), c * (s[a] * rx - f[a] * rxx)
                local[2 * a] += stress[p] * left[2 * a] + stress[p + 2] * s[a]
                local[2 * a + 1] += stress[p] * left[2 * a + 1] + stress[p + 4] * s[a]
            if with_growth:
                # Stiffness proportional to 1 / length, and the displacements' scale.
                for a in range(4):
                    grown[2 * a] -= elastic[p] * left[2 * a] + elastic[p + 2] * s[a]
                    grown[2 * a + 1] -= elastic[p] * left[2 * a + 1] + elastic[p + 4] * s[a]
                for a in range(0, 4, 2):
                    grown[2 * a] -= g * left[2 * a] + geometric[p + 2] * s[a]
                    grown[2 * a + 1] -= g * left[2 * a + 1] + geometric[p + 4] * s[a]
            if with_tangent:
                for a in range(8):
                    for b in range(8):
                        k[a, b] += left[a] * right[b]
                for a in range(4):
                    for b in range(4):
                        ss, cross = s[a] * s[b], g * (f[a] * s[b] - s[a] * f[b])
                        k[2 * a, 2 * b] += modulus[p + 2] * ss
                        k[2 * a, 2 * b + 1] += cross
                        k[2 * a + 1, 2 * b] -= cross
                        k[2 * a + 1, 2 * b + 1] += modulus[p + 4] * ss
        first = el.unknowns[e, 0]
        for a in range(8):
            force[first + a] += local[a] * scale[a]
        if with_tangent:
            for b in range(8):
                for a in range(8):
                    band[first + b, top + a - b] += k[a, b] * scale[a] * scale[b]
        if with_growth:
            for a in range(8):
                # The scaled displacements are proportional to 1 / length.
                for b in (0, 1, 4, 5):
                    grown[a] -= k[a, b] * scale[b] * q1[first + b]
                for i in range(len(growth)):
                    columns[i, first + a] += growth[i, e] * grown[a] * scale[a]


@compiled()
def predict(el, q, dq, growth):
    shape = el.shape[0, 0]
    d, c = np.empty((7, 2)), np.empty((7, 2))
    out = np.empty((len(el.unknowns), 9))
    for e in range(len(out)):
        slopes(el, e, q, d)
        slopes(el, e, dq, c)
        strain_of(d, out[e])
        grown = growth[e] if len(growth) > 0 else 0.0
        if grown != 0.0:
            first = el.unknowns[e, 0]
            # The scaled displacements are proportional to 1 / length, and so is the curvature.
            for p in range(7):
                for a in range(0, 4, 2):
                    factor = grown * shape[p, a] / el.size[e]
                    c[p, 0] -= factor * q[first + 2 * a]
                    c[p, 1] -= factor * q[first + 2 * a + 1]
            for p in range(3, 9):
                out[e, p] *= 1.0 - grown
        for p in range(3):
            out[e, p] += (1.0 + d[p, 0]) * c[p, 0] + d[p, 1] * c[p, 1]
        for p in range(3, 5):
            out[e, p] += (1.0 + d[p, 0]) * c[p + 2, 1] + c[p, 0] * d[p + 2, 1]
            out[e, p] -= d[p, 1] * c[p + 2, 0] + c[p, 1] * d[p + 2, 0]
            out[e, p + 2] += c[p + 2, 0]
            out[e, p + 4] += c[p + 2, 1]
        for p in range(9):
            out[e, p] *= stiffness(el, e, p)
            if p < 3:
                out[e, p] *= 1.0 + grown
    return out


@compiled()
def distance(el, q0, q1, viscous):
    total = 0.0
    d, e0, e1 = np.empty((7, 2)), np.empty(9), np.empty(9)
    for e in range(len(el.unknowns)):
        slopes(el, e, q0, d)
        strain_of(d, e0)
        slopes(el, e, q1, d)
        strain_of(d, e1)
        for p in range(9):
            weight = el.viscous[p] if viscous else 1.0
            total += weight * stiffness(el, e, p) * (e1[p] - e0[p]) ** 2
    return total


@compiled()
def rest_energy(el, q):
    total = 0.0
    d, strain = np.empty((7, 2)), np.empty(9)
    for e in range(len(el.unknowns)):
        slopes(el, e, q, d)
        strain_of(d, strain)
        for p in range(9):
            total += el.rest[p] * strain[p]
    return total


@compiled()
def least(el, q):
    smallest = np.inf
    d, strain = np.empty((7, 2)), np.empty(9)
    for e in range(len(el.unknowns)):
        slopes(el, e, q, d)
        strain_of(d, strain)
        for p in range(3):
            smallest = min(smallest, strain[p])
    return smallest
