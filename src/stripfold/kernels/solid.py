"""Element integrals of the solid, for :mod:`stripfold.kernels.elements`."""

from __future__ import annotations

import numpy as np

from stripfold.kernels.compiler import compiled

NODES, POINTS = 9, 6
"""Of an element of the solid; smaller elements are filled up with zeros."""


@compiled()
def gather(q, unknowns, x, z):
    for a in range(NODES):
        x[a] = q[unknowns[2 * a]]
        z[a] = q[unknowns[2 * a + 1]]


@compiled()
def gradient(g, x, z):
    """Displacement gradient at a point: xx, xz, zx, zz."""
    xx = xz = zx = zz = 0.0
    for a in range(NODES):
        xx += x[a] * g[0, a]
        xz += x[a] * g[1, a]
        zx += z[a] * g[0, a]
        zz += z[a] * g[1, a]
    return xx, xz, zx, zz


@compiled()
def strain_of(xx, xz, zx, zz):
    """Green-Lagrange strain of a displacement gradient: its xx, zz and xz."""
    return (xx + 0.5 * (xx * xx + zx * zx), zz + 0.5 * (xz * xz + zz * zz), 0.5 * (xz + zx + xx * xz + zx * zz))


@compiled()
def combine(g, b, f, column):
    """Sum of the rows of ``f``, each times a gradient of node ``b``; written out, so that it is vectorised."""
    g0, g1, g2, g3, g4, g5 = g[0, 0, b], g[0, 1, b], g[1, 0, b], g[1, 1, b], g[2, 0, b], g[2, 1, b]
    g6, g7, g8, g9, ga, gb = g[3, 0, b], g[3, 1, b], g[4, 0, b], g[4, 1, b], g[5, 0, b], g[5, 1, b]
    for a in range(2 * NODES):
        first = g0 * f[0, a] + g1 * f[1, a] + g2 * f[2, a] + g3 * f[3, a] + g4 * f[4, a] + g5 * f[5, a]
        last = g6 * f[6, a] + g7 * f[7, a] + g8 * f[8, a] + g9 * f[9, a] + ga * f[10, a] + gb * f[11, a]
        column[a] = first + last


@compiled()
def assemble(el, q0, q1, kappa, in_state, predicted, force, band, top, growth, columns):
    n_el, n_q = el.stiffness.shape
    x0, z0, x1, z1 = np.empty(NODES), np.empty(NODES), np.empty(NODES), np.empty(NODES)
    local, grown = np.empty((2, NODES)), np.empty((2, NODES))
    # Of the gradients in each entry of the tangent, by component of the column, gradient and row; and one column.
    factor = np.zeros((2, 2 * POINTS, 2 * NODES))
    column = np.empty(2 * NODES)
    with_tangent, with_predicted, with_growth = len(band) > 0, len(predicted) > 0, len(growth) > 0
    half = 1.0 if in_state else 0.5
    share = 1.0 if in_state else 0.5 + kappa
    lam, mu = el.lam, el.mu
    for e in range(n_el):
        for a in range(NODES):
            local[0, a] = local[1, a] = grown[0, a] = grown[1, a] = 0.0
        unknowns = el.unknowns[e]
        gather(q0, unknowns, x0, z0)
        gather(q1, unknowns, x1, z1)
        for p in range(n_q):
            w, g = el.stiffness[e, p], el.shape[e, p]
            xx0, xz0, zx0, zz0 = gradient(g, x0, z0)
            xx1, xz1, zx1, zz1 = gradient(g, x1, z1)
            a0, b0, c0 = strain_of(xx0, xz0, zx0, zz0)
            a1, b1, c1 = strain_of(xx1, xz1, zx1, zz1)
            # Stress at both ends of the step: xx, zz and xz.
            t0, t1 = lam * (a0 + b0), lam * (a1 + b1)
            a0, b0, c0 = t0 + 2.0 * mu * a0 + el.rest[p], t0 + 2.0 * mu * b0, 2.0 * mu * c0
            a1, b1, c1 = t1 + 2.0 * mu * a1 + el.rest[p], t1 + 2.0 * mu * b1, 2.0 * mu * c1
            sxx, szz, sxz = (
                (1.0 - share) * a0 + share * a1,
                (1.0 - share) * b0 + share * b1,
                (1.0 - share) * c0 + share * c1,
            )
            lxx, lxz = 1.0 + 0.5 * (xx0 + xx1), 0.5 * (xz0 + xz1)
            lzx, lzz = 0.5 * (zx0 + zx1), 1.0 + 0.5 * (zz0 + zz1)
            pxx, pxz = w * (lxx * sxx + lxz * sxz), w * (lxx * sxz + lxz * szz)
            pzx, pzz = w * (lzx * sxx + lzz * sxz), w * (lzx * sxz + lzz * szz)
            for b in range(NODES):
                local[0, b] += pxx * g[0, b] + pxz * g[1, b]
                local[1, b] += pzx * g[0, b] + pzz * g[1, b]
            if not with_tangent:
                continue
            if with_predicted:
                a1, b1, c1 = predicted[e, 4 * p] + el.rest[p], predicted[e, 4 * p + 3], predicted[e, 4 * p + 1]
            gxx = half * w * ((1.0 - share) * a0 + share * a1)
            gzz = half * w * ((1.0 - share) * b0 + share * b1)
            gxz = half * w * ((1.0 - share) * c0 + share * c1)
            wl, wm = w * share * lam, w * share * mu
            rxx, rxz, rzx, rzz = 1.0 + xx1, xz1, zx1, 1.0 + zz1
            if with_growth:
                # Derivatives along the strip are proportional to 1 / length, the weights to the length.
                stretch, shear = -(rxx * xx1 + rzx * zx1), -mu * (rxz * xx1 + rzz * zx1)
                txx, tzz = (lam + 2.0 * mu) * stretch, lam * stretch
                pxx, pxz = rxx * txx + rxz * shear - xx1 * a1, rxx * (shear + c1) + rxz * (tzz + b1) - xx1 * c1
                pzx, pzz = rzx * txx + rzz * shear - zx1 * a1, rzx * (shear + c1) + rzz * (tzz + b1) - zx1 * c1
                for b in range(NODES):
                    grown[0, b] += w * (pxx * g[0, b] + pxz * g[1, b])
                    grown[1, b] += w * (pzx * g[0, b] + pzz * g[1, b])
            # wm L R^T
            mxx, mxz = wm * (lxx * rxx + lxz * rxz), wm * (lxx * rzx + lxz * rzz)
            mzx, mzz = wm * (lzx * rxx + lzz * rxz), wm * (lzx * rzx + lzz * rzz)
            for a in range(NODES):
                gx, gz = g[0, a], g[1, a]
                lx, lz = lxx * gx + lxz * gz, lzx * gx + lzz * gz
                rx, rz = wm * (rxx * gx + rxz * gz), wm * (rzx * gx + rzz * gz)
                sx, sz = gxx * gx + gxz * gz, gxz * gx + gzz * gz
                factor[0, 2 * p, 2 * a] = wl * lx * rxx + mxx * gx + lxx * rx + sx
                factor[0, 2 * p + 1, 2 * a] = wl * lx * rxz + mxx * gz + lxz * rx + sz
                factor[1, 2 * p, 2 * a] = wl * lx * rzx + mxz * gx + lxx * rz
                factor[1, 2 * p + 1, 2 * a] = wl * lx * rzz + mxz * gz + lxz * rz
                factor[0, 2 * p, 2 * a + 1] = wl * lz * rxx + mzx * gx + lzx * rx
                factor[0, 2 * p + 1, 2 * a + 1] = wl * lz * rxz + mzx * gz + lzz * rx
                factor[1, 2 * p, 2 * a + 1] = wl * lz * rzx + mzz * gx + lzx * rz + sx
                factor[1, 2 * p + 1, 2 * a + 1] = wl * lz * rzz + mzz * gz + lzz * rz + sz
        for a in range(NODES):
            force[unknowns[2 * a]] += local[0, a]
            force[unknowns[2 * a + 1]] += local[1, a]
            for i in range(len(growth)):
                columns[i, unknowns[2 * a]] += growth[i, e] * grown[0, a]
                columns[i, unknowns[2 * a + 1]] += growth[i, e] * grown[1, a]
        if not with_tangent:
            continue
        for b in range(NODES):
            for m in range(2):
                combine(el.shape[e], b, factor[m], column)
                j = unknowns[2 * b + m]
                first = top + unknowns[0] - j
                if unknowns[2 * NODES - 1] - unknowns[0] == 2 * NODES - 1:
                    for a in range(2 * NODES):
                        band[j, first + a] += column[a]
                else:
                    for a in range(2 * NODES):
                        band[j, top + unknowns[a] - j] += column[a]


@compiled()
def predict(el, q, dq, growth):
    n_el, n_q = el.stiffness.shape
    out = np.empty((n_el, 4 * n_q))
    x0, z0, x1, z1 = np.empty(NODES), np.empty(NODES), np.empty(NODES), np.empty(NODES)
    for e in range(n_el):
        gather(q, el.unknowns[e], x0, z0)
        gather(dq, el.unknowns[e], x1, z1)
        for p in range(n_q):
            g = el.shape[e, p]
            xx, xz, zx, zz = gradient(g, x0, z0)
            dxx, dxz, dzx, dzz = gradient(g, x1, z1)
            if len(growth) > 0:
                # Derivatives along the strip are proportional to 1 / length.
                dxx -= growth[e] * xx
                dzx -= growth[e] * zx
            a, b, c = strain_of(xx, xz, zx, zz)
            a += (1.0 + xx) * dxx + zx * dzx
            b += (1.0 + zz) * dzz + xz * dxz
            c += 0.5 * ((1.0 + xx) * dxz + xz * dxx + (1.0 + zz) * dzx + zx * dzz)
            trace = el.lam * (a + b)
            out[e, 4 * p] = trace + 2.0 * el.mu * a
            out[e, 4 * p + 1] = out[e, 4 * p + 2] = 2.0 * el.mu * c
            out[e, 4 * p + 3] = trace + 2.0 * el.mu * b
    return out


@compiled()
def distance(el, q0, q1):
    total = 0.0
    x0, z0, x1, z1 = np.empty(NODES), np.empty(NODES), np.empty(NODES), np.empty(NODES)
    for e in range(len(el.unknowns)):
        gather(q0, el.unknowns[e], x0, z0)
        gather(q1, el.unknowns[e], x1, z1)
        for p in range(el.stiffness.shape[1]):
            g = el.shape[e, p]
            xx, xz, zx, zz = gradient(g, x0, z0)
            a0, b0, c0 = strain_of(xx, xz, zx, zz)
            xx, xz, zx, zz = gradient(g, x1, z1)
            a1, b1, c1 = strain_of(xx, xz, zx, zz)
            a, b, c = a1 - a0, b1 - b0, c1 - c0
            density = el.lam * (a + b) ** 2 + 2.0 * el.mu * (a * a + b * b + 2.0 * c * c)
            total += el.stiffness[e, p] * density
    return total


@compiled()
def rest_energy(el, q):
    total = 0.0
    x, z = np.empty(NODES), np.empty(NODES)
    for e in range(len(el.unknowns)):
        gather(q, el.unknowns[e], x, z)
        for p in range(el.stiffness.shape[1]):
            xx, xz, zx, zz = gradient(el.shape[e, p], x, z)
            total += el.stiffness[e, p] * el.rest[p] * strain_of(xx, xz, zx, zz)[0]
    return total


@compiled()
def least(el, q):
    smallest = np.inf
    x, z = np.empty(NODES), np.empty(NODES)
    for e in range(len(el.unknowns)):
        gather(q, el.unknowns[e], x, z)
        for p in range(el.stiffness.shape[1]):
            xx, xz, zx, zz = gradient(el.shape[e, p], x, z)
            along, across, shear = strain_of(xx, xz, zx, zz)
            smallest = min(smallest, 0.5 * (along + across) - np.hypot(0.5 * (along - across), shear))
    return smallest
