"""Sticky ball on an elastic or viscoelastic half-space: rings of uniform pressure and a dense matrix.

The tension ``exp(-gap)`` is frozen, the contact under it is solved by its active set, and both repeat until nothing
changes. Newton's method with the contact frozen ends the iteration. Lengths are in ranges, pressures in largest
tensions. Nothing is shared with the package.
"""

import numpy as np
from scipy.special import ellipe, ellipk


def ring_matrix(count, radius):
    """Radii and areas of rings of equal width, and displacements under a unit pressure on each, unit modulus."""
    edges = np.linspace(0, radius, count + 1)
    middles = (edges[1:] + edges[:-1]) / 2

    def under_disc(edge):
        moved = np.zeros(count)
        if edge > 0:
            inside = middles <= edge
            moved[inside] = 4 * edge / np.pi * ellipe((middles[inside] / edge) ** 2)
            ratio = (edge / middles[~inside]) ** 2
            moved[~inside] = 4 * middles[~inside] / np.pi * (ellipe(ratio) - (1 - ratio) * ellipk(ratio))
        return moved

    discs = np.array([under_disc(edge) for edge in edges]).T
    return middles, np.pi * (edges[1:] ** 2 - edges[:-1] ** 2), discs[:, 1:] - discs[:, :-1]


def pressed(matrix, open_gap, contact):
    """Contact pressure under a gap without it, by the active set."""
    while True:
        pressure = np.zeros(contact.size)
        if contact.any():
            pressure[contact] = np.linalg.solve(matrix[np.ix_(contact, contact)], -open_gap[contact])
        gap = open_gap + matrix @ pressure
        changed = (contact & (pressure > 0)) | (~contact & (gap < 0))
        if (changed == contact).all():
            return np.where(contact, 0.0, gap), pressure, contact
        contact = changed


def newton(matrix, open_gap, gap, contact):
    """Gap and contact pressure with the contact frozen; None if there is no stable state nearby."""
    free, found = ~contact, gap.copy()
    for _ in range(12):
        tension = np.exp(-found)
        jacobian = matrix * np.where(free, tension, 1.0)
        jacobian[free, free] -= 1.0
        excess = np.where(free, found, 0) - open_gap + matrix @ np.where(free, tension, 1.0)
        change = np.linalg.solve(jacobian, excess)
        found = np.where(free, found + change, 0)
        if not np.isfinite(found).all() or (found[free] <= 0).any() or (change[contact] < 0).any():
            return None
        if abs(change[free]).max(initial=0.0) < 1e-10:
            break
    else:
        return None
    response = matrix[np.ix_(free, free)]
    if contact.any():
        inside = np.linalg.solve(matrix[np.ix_(contact, contact)], matrix[np.ix_(contact, free)])
        response = response - matrix[np.ix_(free, contact)] @ inside
    mode, growth = np.ones(int(free.sum())), 0.0
    for _ in range(200):
        mode = response @ (np.exp(-found[free]) * mode)
        growth = abs(mode).max()
        mode /= growth
    return (found, np.where(contact, change, 0.0)) if growth < 1 and abs(found - gap).max() < 3 else None


def relaxed(matrix, surface, approach, gap, tolerance=1e-7):
    """Gap, and pressure less tension, of the state that a gap relaxes into under an approach."""
    contact = gap <= 0
    for iteration in range(4000):
        tension = np.exp(-np.maximum(gap, 0))
        moved, pressure, contact = pressed(matrix, surface - approach - matrix @ tension, contact)
        change = abs(np.exp(-moved) - tension).max()
        gap = moved
        if change < tolerance:
            break
        if change < 0.05 and iteration % 5 == 4:
            exact = newton(matrix, surface - approach, gap, contact)
            if exact is not None:
                return exact[0], exact[1] - np.exp(-exact[0])
    return gap, pressure - tension


def retracted(tabor, glassy, speed, top, bottom, *, hold=100.0, count=200, steps=600, width=2.2):
    """Approach [ranges], force over pi w R and contact radius over the one of Johnson, Kendall, Roberts at zero load.

    A ball is pulled off a Zener half-space after a jump and a hold. The compliance is
    ``glassy + (1 - glassy) (1 - exp(-t))`` over the relaxed one, which the Tabor number `tabor` is of. The speed is in
    ranges per retardation time. The pressure is linear within steps, and the weights of the exponential are exact.
    """
    softness = tabor**1.5  # largest tension over modulus, with lengths along the surface in sqrt(R range)
    zero_load = (4.5 * np.pi * softness) ** (1 / 3)
    middles, areas, matrix = ring_matrix(count, width * zero_load)
    matrix, surface = softness * matrix, middles**2 / 2
    crept, pressure, gap = np.zeros(count), np.zeros(count), surface.copy()
    away = np.linspace(0, (top - bottom) / speed, steps + 1)
    away = np.concatenate([[0], np.geomspace(1e-6 * away[1], away[1], 25), away[2:]])
    times = np.concatenate([[0], np.geomspace(1e-3, hold, 60), hold + away[1:]])
    rows, last = [], 0.0
    for time in times:
        step, last = time - last, time
        approach = top - speed * max(time - hold, 0.0)
        left = np.exp(-step)
        after = 1 - (1 - left) / step if step > 1e-5 else step / 2
        before = 1 - left - after if step > 1e-5 else step / 2
        crept = left * crept + before * pressure
        compliance = glassy + (1 - glassy) * after
        unloaded = surface + matrix @ ((1 - glassy) * crept)
        gap, pressure = relaxed(compliance * matrix, unloaded, approach, gap)
        crept = crept + after * pressure
        radius = np.sqrt(areas[gap == 0].sum() / np.pi) / zero_load
        rows.append((approach, (pressure * areas).sum() / np.pi, radius))
    return np.array(rows)
